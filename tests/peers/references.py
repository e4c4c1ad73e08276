"""The reference controllers of ``sample_runs/controllers``, built with sanitizers and run as processes."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from bufferstand.cli.samples import copy_samples
from tests.peers.structured_text import parse, translate

CONTROLLERS = Path(__file__).parents[2] / "sample_runs" / "controllers"
IN_C, IN_ST = CONTROLLERS / "c", CONTROLLERS / "st"
STRICT = ("-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Werror")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")


def modbus_flags() -> list[str]:
    """Get what the compiler is told about libmodbus; skip, loudly, where it or a compiler is missing."""
    if shutil.which("gcc") and shutil.which("make") and shutil.which("pkg-config"):
        asked = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
        )
        if asked.returncode == 0:
            return asked.stdout.split()
    pytest.skip(
        "NOT TESTED: the reference controllers: gcc, make, pkg-config or libmodbus is missing "
        "(Debian, Ubuntu: apt install gcc make pkg-config libmodbus-dev)"
    )


def build_reference(folder: Path, *flags: str) -> Path:
    """Build the controller in C by its own Makefile, with warnings as errors and sanitizers."""
    modbus_flags()
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / "controller"
    options = " ".join((*STRICT, *(flags or SANITIZED)))
    subprocess.run(["make", "-s", "-C", IN_C, f"PROGRAM={program}", f"CFLAGS={options}"], check=True)
    return program


@contextmanager
def reference_stand(folder: Path, words: Sequence[str | Path], origin: Path = IN_C) -> Iterator[Path]:
    """Run a reference controller beside a copy of the samples; give its stand file. It must end in silence.

    Parameters
    ----------
    folder : Path
        Where the samples are copied to, as ``bufferstand samples`` does.
    words : sequence of str or Path
        What runs it.
    origin : Path
        The samples' folder of it.
    """
    copy_samples(folder / "samples")
    said = folder / "said.txt"
    with (
        said.open("w") as errors,
        subprocess.Popen(
            [*map(str, words), "--port", "0"], stdout=subprocess.PIPE, stderr=errors, text=True
        ) as process,
    ):
        try:
            assert process.stdout is not None
            word, port = process.stdout.readline().split()
            assert word == "ready"
            path = folder / "samples" / "controllers" / origin.name / "stand.toml"
            text = path.read_text(encoding="utf-8")
            assert "port = 1502\n" in text
            path.write_text(text.replace("port = 1502\n", f"port = {port}\n"), encoding="utf-8")
            yield path
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
    assert (process.returncode, said.read_text()) == (0, ""), "a sanitizer, or the controller, complains"


PLC_RUNTIME = Path(__file__).parent / "plc_runtime"
ST_FILES = ("types", "words", "crc32", "ring", "motions", "commands", "lock", "controller", "main")
"""In the order in which a compiler that reads one file wants them."""


def st_program() -> str:
    """Get the whole ST program as one text."""
    return "\n".join((IN_ST / f"{name}.st").read_text(encoding="utf-8") for name in ST_FILES)


def _link_plc(folder: Path, sources: Sequence[Path], *flags: str | Path) -> Path:
    """Link a program that became C with the runtime, the server and the machine of the controller in C."""
    program = folder / "plc"
    parts = [PLC_RUNTIME / "runtime.c", IN_C / "server.c", IN_C / "hal_simulated.c", *sources]
    places = [f"-I{place}" for place in (IN_C, PLC_RUNTIME, folder)]
    words = ["gcc", "-std=gnu11", "-O2", *flags, *places, "-o", program]
    subprocess.run([*map(str, [*words, *parts]), *modbus_flags(), "-lm", "-lpthread"], check=True)
    return program


def build_plc_by_matiec(folder: Path) -> Path:
    """Build the reference PLC program by matiec; skip, loudly, where there is none.

    No package registry has it: built from its sources, ``iec2c`` is to be on the PATH, or named by
    ``BUFFERSTAND_IEC2C``; its ``lib`` lies beside it.
    """
    modbus_flags()
    compiler = os.environ.get("BUFFERSTAND_IEC2C") or shutil.which("iec2c")
    if compiler is None:
        pytest.skip(
            "NOT TESTED: the reference PLC program by matiec, since there is no iec2c: put it on the PATH, "
            "or name it by BUFFERSTAND_IEC2C (by the translator of tests/peers/structured_text it is tested)"
        )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.st").write_text(st_program(), encoding="utf-8")
    library = Path(compiler).resolve().parent / "lib"
    subprocess.run(
        [compiler, "-I", library, "-T", folder, folder / "program.st"], check=True, capture_output=True
    )
    made = [folder / "STAND.c", folder / "PLC.c", PLC_RUNTIME / "by_matiec.c"]
    return _link_plc(folder, made, "-w", f"-I{library / 'C'}")  # what it makes is full of warnings


def build_plc_by_translator(folder: Path, *flags: str) -> Path:
    """Build the reference PLC program by our own translator, with warnings as errors and sanitizers."""
    modbus_flags()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.c").write_text(translate(parse(st_program())), encoding="utf-8")
    return _link_plc(folder, [PLC_RUNTIME / "by_translator.c"], *STRICT, *(flags or SANITIZED))


BUILD_PLC = {"matiec": build_plc_by_matiec, "our translator": build_plc_by_translator}
