"""The simulated controller on a serial line, byte by byte; and its lock for one writer."""

from __future__ import annotations

import asyncio
import os
import select
import struct
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymodbus.framer.rtu import FramerRTU

from bufferstand.drivers.register_maps.profile import load_profile
from bufferstand.drivers.simulated.machine.writer_lock import HELD_S, SingleWriterLock
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import SILENCE_S, RtuStandServer
from bufferstand.foundation.errors import BadInput
from tests.drivers.servers import loop_thread
from tests.drivers.simulated.standing import HandClock, device

RING = load_profile("ring")


def framed(request: bytes, unit: int = 1) -> bytes:
    frame = bytes([unit]) + request
    return frame + FramerRTU.compute_CRC(frame).to_bytes(2, "big")


READ_ONE = framed(bytes.fromhex("03 0000 0001"))
ONE = framed(bytes.fromhex("03 02 42 53"))
SWITCH_ON = bytes.fromhex("06 0060 000f")


class Line:
    """The client's end of a served line."""

    def __init__(self, path: Path, state: dict[str, bool]) -> None:
        self.end = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.end)
        self.state = state

    def say(self, data: bytes) -> None:
        os.write(self.end, data)

    def hear(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            assert select.select([self.end], [], [], 10.0)[0], f"only {data!r}"
            data += os.read(self.end, size - len(data))
        return data

    def silent(self) -> bool:
        return not select.select([self.end], [], [], 2 * SILENCE_S)[0]


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    state = {"cut": False, "on": False}
    stand = device(tmp_path)
    bank = RegisterBank(stand, RING)
    server = RtuStandServer(Responder(bank, lambda _: None, lambda: state["cut"]), 1)

    async def start() -> None:
        server.start(tmp_path / "wires" / "controller")

    async def stop() -> None:
        state["on"] = stand.controller.valve_on
        server.stop()

    with loop_thread() as loop:
        asyncio.run_coroutine_threadsafe(start(), loop).result(60)
        made = Line(tmp_path / "wires" / "controller", state)
        yield made
        asyncio.run_coroutine_threadsafe(stop(), loop).result(60)
        os.close(made.end)
    assert not (tmp_path / "wires" / "controller").is_symlink()


def test_a_request_is_answered_with_its_crc(line: Line) -> None:
    line.say(READ_ONE)
    assert line.hear(len(ONE)) == ONE


def test_a_torn_request_is_answered_once(line: Line) -> None:
    line.say(READ_ONE[:3])
    line.say(READ_ONE[3:])
    assert line.hear(len(ONE)) == ONE
    assert line.silent()


@pytest.mark.parametrize(
    "nothing",
    [
        READ_ONE[:-1] + bytes([READ_ONE[-1] ^ 1]),  # wrong CRC
        bytes([2]) + READ_ONE[1:],  # altered unit: the CRC is wrong, too
        framed(bytes.fromhex("03 0000 0001"), unit=2),  # somebody else's
        READ_ONE[:5],
        b"\x01\x10\x00",
        b"noise",
    ],
)
def test_what_is_not_for_it_is_not_answered_and_leaves_nothing(line: Line, nothing: bytes) -> None:
    line.say(nothing)
    assert line.silent()
    line.say(READ_ONE)
    assert line.hear(len(ONE)) == ONE


def test_a_refusal_is_answered(line: Line) -> None:
    line.say(framed(bytes.fromhex("03 000b 0001")))
    refusal = framed(bytes.fromhex("83 02"))
    assert line.hear(len(refusal)) == refusal
    line.say(framed(bytes.fromhex("2b 0e 01 00")))
    refusal = framed(bytes.fromhex("ab 01"))
    assert line.hear(len(refusal)) == refusal


def test_a_broadcast_is_done_and_not_answered(line: Line) -> None:
    line.say(framed(SWITCH_ON, unit=0))
    assert line.silent()
    line.say(framed(bytes.fromhex("03 0060 0001")))
    answer = framed(bytes.fromhex("03 02 00 0f"))
    assert line.hear(len(answer)) == answer


def test_a_cut_line_is_deaf_and_dumb(line: Line) -> None:
    line.state["cut"] = True
    line.say(framed(SWITCH_ON))
    assert line.silent()
    line.state["cut"] = False
    line.say(READ_ONE)
    assert line.hear(len(ONE)) == ONE
    line.say(framed(bytes.fromhex("03 0060 0001")))
    answer = framed(bytes.fromhex("03 02 00 00"))
    assert line.hear(len(answer)) == answer


def test_a_window_of_the_ring(line: Line) -> None:
    line.say(framed(struct.pack(">BHHHHBI", 23, 260, 121, 256, 2, 4, 0)))
    reply = line.hear(3 + 242 + 2)
    assert reply == framed(reply[1:-2])
    assert reply[2] == 242


def test_what_lies_there_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "controller").write_text("a real device")
    server = RtuStandServer(Responder(RegisterBank(device(tmp_path), RING), bool, lambda: False), 1)
    with pytest.raises(BadInput, match="a device or file lies where the simulated controller shall appear"):
        server.start(tmp_path / "controller")
    assert (tmp_path / "controller").read_text() == "a real device"


class TestWriter:
    def test_one_at_a_time(self) -> None:
        writer = SingleWriterLock(HandClock())
        assert writer.write(7)
        assert writer.write(7)
        assert not writer.write(8)
        assert writer.number == 7
        assert writer.write(0)
        assert writer.write(8)

    def test_it_falls_free_after_its_holder_died(self) -> None:
        wall = HandClock()
        writer = SingleWriterLock(wall)
        assert writer.write(7)
        wall.now_s = HELD_S - 0.1
        writer.keep()  # the watchdog was fed
        wall.now_s = 2 * HELD_S - 0.2
        assert not writer.write(8)
        wall.now_s = 2 * HELD_S
        writer.keep()  # another program feeds the watchdog: that is no sign of life of the dead one
        assert writer.number == 0
        assert writer.write(8)
