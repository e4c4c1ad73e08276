"""The files for a stand computer and for containers: read by the programs that they are for."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.conftest import ROOT

DEPLOYMENT = ROOT / "deployment"
CONTAINERFILE = DEPLOYMENT / "Containerfile"
RUN = ROOT / "sample_runs" / "runs" / "003-harmonic-20mm-20mm-0.318Hz.h5"
_BUILDER_ENVIRONMENT = re.compile(r"(?i)(pip_\w+|https?_proxy|no_proxy|ssl_cert_file)")


def _instructions() -> list[tuple[str, str]]:
    text = re.sub(r"\\\n\s*", "", CONTAINERFILE.read_text(encoding="utf-8"))
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in lines)]


def test_the_container_runs_as_a_user_without_rights_and_installs_by_hash() -> None:
    instructions = _instructions()
    assert [rest for word, rest in instructions if word == "USER"] == ["bufferstand"]
    (build,) = [rest for word, rest in instructions if word == "RUN" and "venv" in rest]
    (lock,) = re.findall(r"--require-hashes -r (\S+)", build)
    assert (ROOT / lock).is_file()
    assert ("ENTRYPOINT", '["bufferstand"]') in instructions


def test_what_a_build_needs_is_not_kept_from_it() -> None:
    ignored = (ROOT / ".containerignore").read_text(encoding="utf-8").split()
    assert not {"bufferstand", "LICENSE", "README.md", "pyproject.toml", "requirements-run.lock"} & set(
        ignored
    )
    assert {".git", ".venv"} <= set(ignored)


@pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="needs systemd-analyze: the unit is not checked"
)
def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    unit = (DEPLOYMENT / "bufferstand-desk.service").read_text(encoding="utf-8")
    (program,) = re.findall(r"^ExecStart=(\S+)", unit, re.MULTILINE)
    assert program == "/opt/bufferstand/bin/bufferstand"
    copy = tmp_path / "bufferstand-desk.service"
    copy.write_text(unit.replace(program, "/bin/true"), encoding="utf-8")
    done = subprocess.run(
        ["systemd-analyze", "verify", str(copy)], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_each_udev_rule_matches_something_and_sets_something() -> None:
    text = (DEPLOYMENT / "70-bufferstand.rules").read_text(encoding="utf-8")
    rules = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert rules
    for rule in rules:
        parts = [re.fullmatch(r'[A-Z]+(?:\{\w+\})?(==|=)"[^"]*"', part) for part in rule.split(", ")]
        assert all(parts), rule
        assert {part.group(1) for part in parts if part is not None} == {"==", "="}


class _Buildah:
    """Builds and runs without a daemon, with its images in a folder."""

    def __init__(self, folder: Path) -> None:
        self.storage = [
            "--storage-driver",
            "vfs",
            "--root",
            str(folder / "r"),
            "--runroot",
            str(folder / "x"),
        ]

    def __call__(self, *arguments: str, cwd: Path | None = None, fails: bool = False) -> str:
        done = subprocess.run(
            ["buildah", *self.storage, *arguments],
            capture_output=True,
            text=True,
            check=False,
            cwd=cwd,
            timeout=1800,
        )
        assert (done.returncode != 0) == fails, done.stdout[-2000:] + done.stderr[-4000:]
        return (done.stderr if fails else done.stdout).strip()


def _missing() -> Sequence[str]:
    return [name for name in ("buildah", "mmdebstrap") if shutil.which(name) is None]


@pytest.fixture(scope="module")
def container(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[_Buildah, str]]:
    """The image of this tree, on a Debian with Python, and a container of it."""
    if missing := _missing():
        pytest.skip(f"needs {' and '.join(missing)} (apt install): the container is not built")
    if os.geteuid() != 0:
        pytest.skip("needs root: the container is not built")
    folder = tmp_path_factory.mktemp("container")
    build, source, debian = _Buildah(folder), folder / "source", folder / "debian.tar"
    subprocess.run(
        ["mmdebstrap", "--quiet", "--variant=minbase", "--include=python3,python3-venv,ca-certificates",
         "--mode=root", "bookworm", str(debian)],
        check=True, timeout=1200,
    )  # fmt: skip
    base = build("from", "scratch")
    build("add", "--quiet", base, str(debian), "/")
    build("commit", "--quiet", base, "localhost/debian-with-python")
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(source)], check=True, timeout=300)
    given = [f"--env={name}" for name in os.environ if _BUILDER_ENVIRONMENT.fullmatch(name)]
    folders = ["/etc/ssl/certs", os.environ.get("PIP_FIND_LINKS", "")]
    shared = [f"--volume={path}:{path}:ro" for path in folders if path.startswith("/")]
    build(
        "bud", "--quiet", "--isolation", "chroot", "--network", "host", *given, *shared,
        "--build-arg", "BASE=localhost/debian-with-python",
        "--file", "deployment/Containerfile", "--tag", "bufferstand", ".",
        cwd=source,
    )  # fmt: skip
    yield build, build("from", "localhost/bufferstand")
    shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.long
@pytest.mark.slow
def test_the_container_makes_a_report_as_a_user_without_rights(
    container: tuple[_Buildah, str], tmp_path: Path
) -> None:
    build, name = container
    data = tmp_path / "data"
    data.mkdir()
    shutil.copy(RUN, data)
    os.chown(data, 1000, 1000)
    run = ("run", "--isolation", "chroot", "--volume", f"{data}:/data", name, "--")
    assert build(*run, "id", "--user") == "1000"
    assert "record" in build(*run, "bufferstand", "--help")
    build(*run, "bufferstand", "report", ".", "--out", "reports")
    written = sorted((data / "reports").iterdir())
    assert [file.name for file in written] == ["data-report.html", "data-report.pdf"]
    assert {file.stat().st_uid for file in written} == {1000}
    refused = build(*run, "bufferstand", "evaluate", "nothing.h5", fails=True)
    assert "nothing.h5" in refused
    assert "Traceback" not in refused
