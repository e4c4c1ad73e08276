"""A served stand that waits says so, and nothing else can be taken for one."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path

import pytest

from bufferstand.drivers.simulated.serving.server import ServerOptions, StandServer
from bufferstand.drivers.simulated.serving.waiting_sign import NAME, WaitingSign, is_waiting
from bufferstand.drivers.stand_file.schema import Endpoints, StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from tests.drivers.simulated.standing import stand_file

MODEL = Path(__file__).parents[3] / "sample_runs/models/category-a-elastomer.toml"
ADDRESS = "127.0.0.1:15021"
KILLED = """
import os, pathlib, sys
from bufferstand.drivers.simulated.serving.waiting_sign import WaitingSign
sign = WaitingSign(pathlib.Path(sys.argv[1]), sys.argv[2])
os.kill(os.getpid(), 9)
"""


def at(folder: Path, host: str, port: int) -> StandFile:
    return with_endpoints(stand_file(folder), Endpoints(host=host, port=port))


@pytest.mark.parametrize(
    ("host", "port", "waits"),
    [
        ("127.0.0.1", 15021, True),
        ("localhost", 15021, True),
        ("127.0.0.1", 15022, False),
        ("192.168.0.10", 15021, False),
    ],
)
def test_only_the_address_that_a_living_stand_holds_waits(
    tmp_path: Path, host: str, port: int, waits: bool
) -> None:
    path, file = tmp_path / NAME, at(tmp_path, host, port)
    assert not is_waiting(path, file), "there is none"
    sign = WaitingSign(path, ADDRESS)
    assert is_waiting(path, file) is waits
    sign.close()
    assert not path.exists()


def test_a_file_that_a_killed_stand_has_left_says_nothing(tmp_path: Path) -> None:
    path, file = tmp_path / NAME, at(tmp_path, "127.0.0.1", 15021)
    done = subprocess.run([sys.executable, "-c", KILLED, str(path), ADDRESS], check=False)
    assert done.returncode == -9
    assert path.read_text(encoding="utf-8") == ADDRESS
    assert not is_waiting(path, file)


def test_a_second_stand_in_the_same_folder_has_no_sign(tmp_path: Path) -> None:
    path = tmp_path / NAME
    first = WaitingSign(path, ADDRESS)
    second = WaitingSign(path, "127.0.0.1:15022")
    assert is_waiting(path, at(tmp_path, "127.0.0.1", 15021))
    assert not is_waiting(path, at(tmp_path, "127.0.0.1", 15022))
    second.close()
    assert is_waiting(path, at(tmp_path, "127.0.0.1", 15021)), "the other's is left alone"
    first.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "wait", "waits"), [(1.0, False, False), (1.0, True, True), (10.0, False, True)]
)
def test_a_served_stand_says_so_where_it_waits(tmp_path: Path, speed: float, wait: bool, waits: bool) -> None:
    async def serve() -> tuple[bool, bool]:
        wires = tmp_path / "w"
        options = ServerOptions(model=MODEL, speed=speed, port=0, wires=wires, wait_for_reader=wait)
        server = StandServer(stand_file(tmp_path), options, WallClock(speed))
        served = await server.open()
        file = at(tmp_path, served.host, served.port)
        seen = is_waiting(wires / NAME, file)
        await server.close()
        return seen, is_waiting(wires / NAME, file)

    assert asyncio.run(serve()) == (waits, False)
