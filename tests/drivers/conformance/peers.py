"""Foreign implementations of Modbus, built and run: libmodbus (C) and simonvetter/modbus (Go)."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def build_c(name: str, folder: Path) -> Path:
    """Build a program on libmodbus; skip, loudly, where it cannot be had."""
    flags = None
    if shutil.which("gcc") and shutil.which("pkg-config"):
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
        )
    if flags is None or flags.returncode:
        pytest.skip(
            "NOT TESTED against libmodbus: gcc, pkg-config or libmodbus is missing "
            "(Debian, Ubuntu: apt install gcc pkg-config libmodbus-dev)"
        )
    program = folder / name
    options = ["-Wall", "-Wextra", "-Werror", "-O1", "-o", str(program)]
    subprocess.run(["gcc", *options, str(HERE / f"{name}.c"), *flags.stdout.split()], check=True)
    return program


def build_go(folder: Path) -> Path:
    """Build the server on simonvetter/modbus; skip, loudly, where it cannot be had."""
    go = shutil.which("go") or shutil.which("/usr/local/go/bin/go")
    if go is None:
        pytest.skip("NOT TESTED against a Go server: there is no Go (Debian, Ubuntu: apt install golang)")
    source = HERE / "go_server"
    fetched = subprocess.run(
        [go, "mod", "download"], cwd=source, capture_output=True, text=True, check=False, timeout=300
    )
    if fetched.returncode:
        pytest.skip(
            f"NOT TESTED against a Go server: its module cannot be fetched ({fetched.stderr.strip()})"
        )
    program = folder / "go_server"
    subprocess.run(
        [go, "build", "-buildvcs=false", "-o", str(program), "."],
        cwd=source,
        check=True,
        timeout=600,
        env={**os.environ, "CGO_ENABLED": "0"},
    )
    return program


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


@contextmanager
def running(*command: str) -> Iterator[int]:
    """Run a server until left; yield the port that it says it listens on."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            word, port = process.stdout.readline().split()
            assert word == "ready"
            yield int(port)
        finally:
            process.stdin.close()
            process.wait(60)
