"""The prebuilt libraries are what their source makes, and the source is sound."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import fmpy
import numpy as np
import pytest

from bufferstand.model.export.build import (
    ARITHMETIC,
    BINARIES,
    COMPILERS,
    SOURCE_FOLDER,
    WARNINGS,
    build,
    compiler,
    digests,
)
from bufferstand.model.export.fmu import LIBRARIES, SOURCES
from bufferstand.model.spring import SPECTRUM_TAU_S
from tests.model_export.cases import springs, stepped, wandering
from tests.model_export.host import CO_SIMULATION, Host

HERE = Path(__file__).parent
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


@pytest.fixture(scope="module")
def record():
    return json.loads((BINARIES / "build.json").read_text(encoding="utf-8"))


def test_the_libraries_were_built_from_this_source(record):
    """Needs no compiler: a change of the source without a rebuild fails here."""
    assert digests(SOURCE_FOLDER, SOURCES) == record["sources"]
    for platform, name in LIBRARIES.items():
        assert digests(BINARIES / platform, (name,))[name] == record[platform]["sha256"]
        assert (BINARIES / platform / name).stat().st_size < 100_000


def rebuilt(platform, record, folder) -> Path:
    """Build in a folder of another name; with the compiler of the record it must give the same bytes."""
    tool = compiler(platform)
    if tool is None:
        pytest.skip(f"needs {COMPILERS[platform]}")
    library = build(platform, folder)
    if tool == record[platform]["compiler"]:
        assert library.read_bytes() == (BINARIES / platform / LIBRARIES[platform]).read_bytes()
    return library


def test_a_rebuilt_linux_library_is_the_same_and_gives_the_same_figures(record, exported, tmp_path):
    shutil.copytree(exported(units="mm-kN")[1], tmp_path / "fmu")
    rebuilt("linux64", record, tmp_path / "fmu" / "binaries" / "linux64")
    model = springs()["buffer"]
    strokes = wandering(model)
    host = Host(tmp_path / "fmu", CO_SIMULATION).start()
    assert np.array_equal(host.run(strokes, 0.001), stepped(model, strokes, 0.001, 25.0, 25.0))
    host.close()


@pytest.mark.parametrize("platform", sorted(LIBRARIES))
def test_the_compiler_of_the_record_gives_the_shipped_library_bit_for_bit(platform, record, tmp_path):
    """In CI, too: ``.ci/peers`` installs both compilers where it may."""
    stated, here = record[platform]["compiler"], compiler(platform)
    if here != stated:
        pytest.skip(
            f"THE SHIPPED {platform} LIBRARY IS NOT COMPARED: it was built by “{stated}”, here is “{here}”"
        )
    shipped = (BINARIES / platform / LIBRARIES[platform]).read_bytes()
    assert build(platform, tmp_path / "a folder").read_bytes() == shipped


@needs_gcc
@pytest.mark.parametrize("prefix", [(), ("-DFMI2_FUNCTION_PREFIX=spring_",)])
def test_the_source_agrees_with_the_standards_own_headers(prefix):
    """As a tool compiles it that brings them; fmpy has a copy."""
    standard = Path(fmpy.__file__).parent / "c-code"
    command = ["gcc", "-fsyntax-only", *ARITHMETIC, *WARNINGS, *prefix, f"-I{standard}", SOURCES[0]]
    told = subprocess.run(command, cwd=SOURCE_FOLDER, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stderr) == (0, "")


def test_the_linux_library_runs_on_old_systems():
    """No symbol newer than RHEL 7's glibc 2.17, and none but libc's and libm's."""
    content = (BINARIES / "linux64" / LIBRARIES["linux64"]).read_bytes()
    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"GLIBC_([0-9.]+)\0", content)}
    assert versions
    assert max(versions) <= (2, 17)
    needed = set(re.findall(rb"\0(lib[a-z0-9+_-]+\.so[.0-9]*)(?=\0)", content))
    assert needed <= {b"libm.so.6", b"libc.so.6"}


def test_the_windows_library_needs_nothing_but_windows():
    content = (BINARIES / "win64" / LIBRARIES["win64"]).read_bytes()
    named = {name.lower() for name in re.findall(rb"[A-Za-z0-9_+-]+\.dll", content)}
    assert named == {b"kernel32.dll", b"msvcrt.dll", b"bufferstand_spring.dll"}
    exported_names = set(re.findall(rb"\0(fmi2[A-Za-z]+)(?=\0)", content))
    source = (SOURCE_FOLDER / SOURCES[0]).read_text(encoding="utf-8")
    assert {
        n.encode() for n in re.findall(r"^FMI2_Export .*?(fmi2[A-Z]\w+)\(", source, re.M)
    } <= exported_names
    assert len(exported_names) == 44


def test_the_spectrum_is_the_librarys():
    text = (SOURCE_FOLDER / "bufferstand_spring.h").read_text(encoding="utf-8")
    found = re.search(r"#define BS_SPECTRUM_S(.*?)\n\n", text, re.S)
    assert found
    assert tuple(float(v) for v in found[1].replace("\\", " ").split(",")) == SPECTRUM_TAU_S


@needs_gcc
def test_the_source_is_sound_under_sanitizers(exported, tmp_path):
    """Address, leak and undefined behaviour, in both interfaces and through every misuse of master.c."""
    flags = ["-std=c99", "-g", "-O1", "-ffp-contract=off", "-fsanitize=address,undefined"]
    flags += ["-fno-sanitize-recover=all", *WARNINGS, f"-I{SOURCE_FOLDER}", f"-I{HERE}"]
    compiled = ["gcc", *flags, str(HERE / "master.c"), "-o", str(tmp_path / "master"), "-lm"]
    built = subprocess.run(compiled, capture_output=True, text=True, check=False)
    if "libasan" in built.stderr or "libubsan" in built.stderr:
        pytest.skip("this gcc has no sanitizers")
    assert built.returncode == 0, built.stderr
    for name in ("spectrum", "insulated"):
        content = exported(name, units="mm-kN")[1]
        guid = re.search(r'guid="([^"]*)"', (content / "modelDescription.xml").read_text(encoding="utf-8"))
        assert guid
        uri = (content / "resources").as_uri()
        done = subprocess.run(
            [tmp_path / "master", uri, guid[1], "2000"],
            capture_output=True, text=True, check=False, timeout=120,
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        found = np.array(done.stdout.split(), dtype=float)
        strokes = np.array([50.0 - 60.0 * np.cos(0.01 * k) for k in range(2000)])
        begin = springs()[name].temperature.reference_C
        # The host begins at stroke 0; numpy's cosine may differ from C's in the last bit.
        expected = stepped(springs()[name], strokes, 0.001, begin, begin)[:, 0]
        assert np.abs(found - expected).max() < 1e-9 * expected.max()


@needs_gcc
def test_every_form_of_a_resource_path(tmp_path):
    program = tmp_path / "paths"
    subprocess.run(
        [
            "gcc",
            "-std=c99",
            *WARNINGS,
            f"-I{SOURCE_FOLDER}",
            str(HERE / "paths.c"),
            "-o",
            str(program),
            "-lm",
        ],
        check=True,
    )

    def paths(windows, *uris):
        told = subprocess.run([program, windows, *uris], check=True, capture_output=True, text=True)
        return told.stdout.splitlines()

    linux = {
        "file:///a/b": "/a/b/f",
        "file:/a/b": "/a/b/f",
        "file://localhost/a/b/": "/a/b/f",
        "file:///a%20b%c3%a4/%25": "/a bä/%/f",
        "file:///a%2": "/a%2/f",
        "/a%20b": "/a%20b/f",
        "file:///C:/a": "/C:/a/f",
    }
    assert paths("0", *linux) == list(linux.values())
    windows = {
        "file:///C:/a%20b": "C:/a b/f",
        "file:/C:/a": "C:/a/f",
        "file:///C|/a": "C:/a/f",
        "file://server/share/a": "//server/share/a/f",
        "file://localhost/D:/a/": "D:/a/f",
        "C:\\a b\\": "C:\\a b\\f",
    }
    assert paths("1", *windows) == list(windows.values())
