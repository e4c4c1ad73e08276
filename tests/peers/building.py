"""Build the two controllers; skip, loudly, where a compiler or library is missing."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def build_c(folder: Path) -> Path:
    """Build the controller on libmodbus."""
    flags = None
    if shutil.which("gcc") and shutil.which("pkg-config"):
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
        )
    if flags is None or flags.returncode:
        pytest.skip(
            "NOT TESTED against the C controller: gcc, pkg-config or libmodbus is missing "
            "(Debian, Ubuntu: apt install gcc pkg-config libmodbus-dev)"
        )
    program = folder / "c_controller"
    sources = map(str, sorted((HERE / "c_controller").glob("*.c")))
    options = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O2", "-o", str(program)]
    subprocess.run(["gcc", *options, *sources, *flags.stdout.split(), "-lm", "-lpthread"], check=True)
    return program


def build_go(folder: Path) -> Path:
    """Build the controller in Go, which needs nothing but Go's standard library."""
    go = shutil.which("go") or shutil.which("/usr/local/go/bin/go")
    if go is None:
        pytest.skip(
            "NOT TESTED against the Go controller: there is no Go (Debian, Ubuntu: apt install golang)"
        )
    program = folder / "go_controller"
    subprocess.run(
        [go, "build", "-buildvcs=false", "-o", str(program), "."],
        cwd=HERE / "go_controller",
        check=True,
        timeout=600,
        env={**os.environ, "CGO_ENABLED": "0", "GOTOOLCHAIN": "local", "GOFLAGS": "-mod=mod"},
    )
    return program
