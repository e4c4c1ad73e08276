"""Modbus RTU: no reply is taken for the answer to another request, and what fails is said and mended."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import Client, RtuWire, TcpWire
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import RtuStandServer
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import CommandRejected, DeviceFault, NotInCharge, WireLost
from bufferstand.foundation.motions import RampTo, StandStill
from tests.drivers import noisy
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import loop_thread
from tests.drivers.simulated.standing import device as simulated_device
from tests.drivers.test_noisy_wire import Bank

CHANNELS = load_stand(SAMPLE_STAND).controller.channel
TIMEOUT_S = 0.15
Deed = Callable[[bytes], list[tuple[float, bytes]]]


class Script(noisy.Noise):
    """Does a given thing to a given frame, counted from 0: requests are even, replies odd."""

    def __init__(self) -> None:
        super().__init__(0, 0.0, 0.0)
        self.deeds: dict[int, Deed] = {}
        self.frames = 0

    def plan(self, deeds: dict[int, Deed]) -> None:
        self.deeds, self.frames = deeds, 0

    def disturb(self, frame: bytes) -> list[tuple[float, bytes]]:
        deed = self.deeds.get(self.frames)
        self.frames += 1
        return [(0.0, frame)] if deed is None else deed(frame)


def lost(frame: bytes) -> list[tuple[float, bytes]]:
    return []


def late(frame: bytes) -> list[tuple[float, bytes]]:
    return [(1.5 * TIMEOUT_S, frame)]


def twice(frame: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, frame), (0.02, frame)]


def altered(frame: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, frame[:-3] + bytes([frame[-3] ^ 0x10]) + frame[-2:])]


def cut_short(frame: bytes) -> list[tuple[float, bytes]]:
    return [(0.0, frame[:-4])]


@pytest.fixture
def line(profile: Profile, tmp_path: Path) -> Iterator[tuple[RtuWire, Script, RingDevice]]:
    device, script = RingDevice(profile), Script()
    server = RtuStandServer(Responder(Bank(device), bool, lambda: False), 1)

    async def start() -> None:
        server.start(tmp_path / "server")

    async def stop() -> None:
        server.stop()

    with loop_thread() as loop:
        asyncio.run_coroutine_threadsafe(start(), loop).result(60)
        with noisy.line(tmp_path, script, tmp_path / "server") as between:
            yield RtuWire(between.near, baud=115200), script, device
        asyncio.run_coroutine_threadsafe(stop(), loop).result(60)


@pytest.mark.parametrize("deed", [lost, late, altered, cut_short])
def test_a_doubtful_reply_is_mended_and_the_next_is_its_own(
    line: tuple[RtuWire, Script, RingDevice], deed: Deed
) -> None:
    wire, script, _ = line
    link = ModbusLink(wire, timeout_s=TIMEOUT_S)
    link.open()
    script.plan({1: deed})
    assert link.read(0, 2, "identity") == [0x4253, 3]
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert link.read(0, 2, "identity") == [0x4253, 3]
    first, second, *others = link.events()
    assert first.startswith("reading identity (FC3, 2 registers from 0): ")
    assert first.endswith("connection closed, sent once more on a new connection")
    assert second.endswith("opened again")
    assert others == []
    link.close()


def test_a_doubled_reply_is_not_the_next_one(line: tuple[RtuWire, Script, RingDevice]) -> None:
    wire, script, _ = line
    link = ModbusLink(wire, timeout_s=TIMEOUT_S)
    script.plan({1: twice, 3: twice})
    assert link.read(0, 2, "identity") == [0x4253, 3]
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert link.read(6, 2, "serial") == [9, 630001 - 9 * 65536]
    link.close()


def test_a_status_that_is_later_than_every_wait_is_not_taken(
    line: tuple[RtuWire, Script, RingDevice], profile: Profile
) -> None:
    """The reply of an old request in the place of the new one: only the echoed number tells."""
    wire, script, device = line
    controller = RingController(
        ModbusLink(wire, timeout_s=TIMEOUT_S), profile, CHANNELS, WallClock(), timeout_s=TIMEOUT_S
    )
    kept: list[bytes] = []

    def keep(frame: bytes) -> list[tuple[float, bytes]]:
        kept.append(frame)
        return [(0.0, frame)]

    script.plan({1: keep})
    device.set("force", 1.0)
    assert controller.status().force_kN == 1.0
    device.set("force", 2.0)
    script.plan({1: lambda _: [(0.0, kept[0])]})
    assert controller.status().force_kN == 2.0
    event = controller.events()[0]
    assert "it answers request 1 instead of 2: it is late" in event
    controller.close()


def test_an_altered_command_is_seen_before_it_moves_anything(profile: Profile, tmp_path: Path) -> None:
    """Over TCP, whose frames have no checksum: the third register of the amplitude's block is changed."""
    device, script = RingDevice(profile), Script()
    server = ModbusStandServer(Responder(Bank(device), bool, lambda: False), 1)

    def other_target(frame: bytes) -> list[tuple[float, bytes]]:
        if frame[7] != 16:
            return [(0.0, frame)]
        return [(0.0, frame[:17] + bytes([frame[17] ^ 0x40]) + frame[18:])]

    with loop_thread() as loop:
        port = asyncio.run_coroutine_threadsafe(server.start("127.0.0.1", 0), loop).result(60)
        with noisy.noisy_tcp(port, script) as between:
            controller = RingController(
                ModbusLink(TcpWire("127.0.0.1", between), timeout_s=1.0), profile, CHANNELS, WallClock()
            )
            script.plan({8: other_target})  # status, lock (3), arming
            assert controller.start(RampTo(target_mm=10.0, speed_mm_per_s=5.0)) == 1
            (event,) = controller.events()
            assert "armed once more" in event
            assert [command["target"] for command in device.executed] == [10.0]
            script.plan(dict.fromkeys(range(0, 40, 2), other_target))
            with pytest.raises(
                DeviceFault, match=r"it reads back as .*, twice; look whether the device bounds"
            ):
                controller.start(RampTo(target_mm=20.0, speed_mm_per_s=5.0))
            assert len(device.executed) == 1
            controller.close()
        asyncio.run_coroutine_threadsafe(server.stop(), loop).result(60)


def test_no_such_line(tmp_path: Path) -> None:
    link = ModbusLink(RtuWire(tmp_path / "none"), timeout_s=TIMEOUT_S)
    with pytest.raises(DeviceFault, match=r"cannot open the serial line: .*No such file.*is the adapter"):
        link.open()


def test_a_line_that_another_program_has(line: tuple[RtuWire, Script, RingDevice]) -> None:
    wire, _, _ = line
    first, second = ModbusLink(wire, timeout_s=TIMEOUT_S), ModbusLink(wire, timeout_s=TIMEOUT_S)
    first.open()
    with pytest.raises(DeviceFault, match="no other program on it"):
        second.open()
    first.close()
    second.open()
    second.close()


def test_two_programs_one_controller(tmp_path: Path, profile: Profile) -> None:
    stand = simulated_device(tmp_path)
    server = ModbusStandServer(Responder(RegisterBank(stand, profile), bool, lambda: False), 1)
    with loop_thread() as loop:
        port = asyncio.run_coroutine_threadsafe(server.start("127.0.0.1", 0), loop).result(60)
        first, second = (
            RingController(ModbusLink(TcpWire("127.0.0.1", port)), profile, CHANNELS, WallClock())
            for _ in range(2)
        )
        limits = {"force_limit_kN": 500.0, "stroke_limit_mm": 100.0, "watchdog_ms": 5000}
        first.enable(**limits)  # type: ignore[arg-type]
        for what in (lambda: second.enable(**limits), lambda: second.start(StandStill())):  # type: ignore[arg-type]
            with pytest.raises(
                DeviceFault, match=r"another program \(number \d+, this one is \d+\)"
            ) as caught:
                what()
            assert not isinstance(caught.value, CommandRejected)
        for what in (second.feed_watchdog, second.disable):
            with pytest.raises(NotInCharge, match="nothing was sent"):
                what()
        assert second.status().force_kN == first.status().force_kN  # reading is free
        first.start(StandStill())
        first.disable()
        with pytest.raises(DeviceFault, match="another program"):
            second.enable(**limits)  # type: ignore[arg-type] - the valve is off, the lock is kept
        first.give_back()
        second.enable(**limits)  # type: ignore[arg-type]
        with pytest.raises(NotInCharge):
            first.disable()
        assert stand.controller.valve_on
        first.close()
        second.close()
        asyncio.run_coroutine_threadsafe(server.stop(), loop).result(60)


def test_a_line_too_slow_for_the_ring_is_said(
    line: tuple[RtuWire, Script, RingDevice], profile: Profile, tmp_path: Path
) -> None:
    """14 samples of 264 characters of 11 bits: 115200 baud carry 555 samples/s."""
    wire, _, _ = line
    controller = RingController(ModbusLink(wire, timeout_s=TIMEOUT_S), profile, CHANNELS, WallClock())
    controller.connect()
    (event,) = controller.events()
    assert "SAMPLES WILL BE LOST: the line carries 555 samples/s at most (14 in 264 bytes" in event
    assert "the controller takes 1000" in event
    controller.close()


class Settling(RtuWire):
    """Counts how often it is left alone."""

    settled = 0

    def settle(self, client: Client, timeout_s: float) -> None:
        self.settled += 1
        super().settle(client, timeout_s)


@pytest.fixture
def lost_line(line: tuple[RtuWire, Script, RingDevice]) -> tuple[ModbusLink, Settling, Script]:
    """A line on which a request was given up: it was left alone once, between the two tries."""
    near, script, _ = line
    wire = Settling(near._port, baud=115200)
    link = ModbusLink(wire, timeout_s=TIMEOUT_S)
    link.read(0, 2, "identity")
    script.plan({1: lost, 3: lost})
    with pytest.raises(WireLost):
        link.read(0, 2, "identity")
    assert wire.settled == 1
    return link, wire, script


def test_a_lost_line_is_fed_at_once_and_asked_anything_else_after_a_silence(
    lost_line: tuple[ModbusLink, Settling, Script],
) -> None:
    link, wire, script = lost_line
    script.plan({})
    link.write(97, [5], "heartbeat")
    assert (wire.settled, link.is_lost) == (1, False)
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert wire.settled == 1
    link.close()


def test_before_a_read_a_lost_line_is_left_alone(lost_line: tuple[ModbusLink, Settling, Script]) -> None:
    link, wire, script = lost_line
    script.plan({})
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert wire.settled == 2
    link.close()


@pytest.mark.slow
def test_the_late_echo_of_a_feed_is_not_that_of_the_next(
    lost_line: tuple[ModbusLink, Settling, Script],
) -> None:
    link, _, script = lost_line
    script.plan({1: late, 3: lost})
    for beat in (6, 7):
        with pytest.raises(WireLost):
            link.write(97, [beat], "heartbeat")
    for _ in range(20):  # on a loaded machine a feed may be later than its time and is given up
        with suppress(WireLost):
            link.write(97, [8], "heartbeat")
            break
    assert link.read(97, 1, "heartbeat") == [8]
    link.close()
