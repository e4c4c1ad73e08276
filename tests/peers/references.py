"""The reference controllers of ``examples``: built with every warning and sanitizer, and run as processes."""

from __future__ import annotations

import shutil
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.peers.controllers import Case, stand_text

EXAMPLES = Path(__file__).parents[2] / "examples"
IN_C = EXAMPLES / "controller_c"
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
def reference_stand(folder: Path, words: Sequence[str | Path], profile: str = "ring") -> Iterator[Path]:
    """Run a reference controller; give the stand file beside it. It must end well, and say nothing then."""
    folder.mkdir(parents=True, exist_ok=True)
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
            address = f'host = "127.0.0.1"\nport = {port}'
            path = folder / "stand.toml"
            path.write_text(stand_text(Case("c"), profile, address), encoding="utf-8")
            yield path
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
    assert (process.returncode, said.read_text()) == (0, ""), "a sanitizer, or the controller, complains"
