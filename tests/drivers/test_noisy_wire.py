"""Over a wire that loses, delays, doubles and alters frames at 5 % each, no sample is lost or altered."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.modbus.link import ModbusLink, Table
from bufferstand.drivers.modbus.wires import RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps.coding import pack
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import RtuStandServer
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers import noisy
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.noisy import KINDS, Noise
from tests.drivers.ring_device import PERIOD_US, RingDevice
from tests.drivers.servers import loop_thread

CHANNELS = load_stand(SAMPLE_STAND).controller.channel
SHARE = 0.05
TIMEOUT_S = 0.04
FORCE_KN = 123.25


class Bank:
    """A :class:`RingDevice` as the simulated servers take it; each read of the ring finds new samples."""

    def __init__(self, device: RingDevice, *portions: int) -> None:
        self.device = device
        everywhere = frozenset(range(len(device.words)))
        self.readable: dict[Table, frozenset[int]] = {"holding": everywhere, "input": frozenset()}
        self.writable = everywhere
        self._portions = cycle(portions or (0,))

    def read_packed(self, address: int, count: int, table: Table) -> bytes:  # noqa: ARG002
        if address == self.device.profile.ring.address:
            self.device.sample(next(self._portions))
        return pack(self.device.read(address, count))

    def write(self, address: int, values: Sequence[int]) -> int:
        self.device.write(address, list(values))
        return 0

    def is_harmless(self, address: int, count: int) -> bool:  # noqa: ARG002
        return True

    def is_momentary(self, addresses: range, table: Table) -> bool:  # noqa: ARG002
        return False


@contextmanager
def noisy_wire(kind: str, bank: Bank, noise: Noise, folder: Path) -> Iterator[Wire]:
    with loop_thread() as loop:
        if kind == "TCP":
            tcp = ModbusStandServer(Responder(bank, bool, lambda: False), 1)
            port = asyncio.run_coroutine_threadsafe(tcp.start("127.0.0.1", 0), loop).result(60)
            with noisy.noisy_tcp(port, noise) as between:
                yield TcpWire("127.0.0.1", between)
            asyncio.run_coroutine_threadsafe(tcp.stop(), loop).result(60)
            return
        rtu = RtuStandServer(Responder(bank, bool, lambda: False), 1)

        async def start() -> None:
            rtu.start(folder / "server")

        async def stop() -> None:
            rtu.stop()

        asyncio.run_coroutine_threadsafe(start(), loop).result(60)
        with noisy.line(folder, noise, folder / "server") as line:
            yield RtuWire(line.near, baud=115200)
        asyncio.run_coroutine_threadsafe(stop(), loop).result(60)


def connected(controller: RingController) -> None:
    """Connect, however often it takes on such a wire."""
    for _ in range(100):
        try:
            controller.connect()
        except DeviceFault:
            continue
        return
    raise AssertionError("never connected")


def demand_true(blocks: list[SampleBlock], device: RingDevice) -> int:
    """See that blocks are whole, in order and unaltered; return how many samples they hold."""
    after = blocks[0].first_sequence
    held = 0
    for block in blocks:
        assert block.first_sequence == after + block.lost
        rows = len(block.time_us)
        true = device.rows(block.first_sequence, rows)
        np.testing.assert_array_equal(block.time_us, (block.first_sequence + np.arange(rows)) * PERIOD_US)
        for name, column in block.counts.items():
            np.testing.assert_array_equal(column, true[name])
        after = block.first_sequence + rows
        held += rows
    return held


def study(profile: Profile, kind: str, folder: Path, duration_s: float, capacity: int) -> Counter[str]:
    device = RingDevice(profile, capacity=capacity)
    device.set("force", FORCE_KN)
    noise = Noise(4, SHARE, TIMEOUT_S)
    found: Counter[str] = Counter()
    blocks: list[SampleBlock] = []
    with noisy_wire(kind, Bank(device, 0, 9, 26), noise, folder) as wire:
        link = ModbusLink(wire, timeout_s=TIMEOUT_S)
        controller = RingController(link, profile, CHANNELS, WallClock(), timeout_s=TIMEOUT_S)
        connected(controller)
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            for _ in range(20):
                try:
                    block = controller.read_block()
                except DeviceFault:
                    found["faults"] += 1
                    continue
                if block is not None:
                    blocks.append(block)
            try:
                assert controller.status().force_kN == FORCE_KN
                found["statuses"] += 1
            except DeviceFault:
                found["faults"] += 1
            found["events"] += len(controller.events())
        controller.close()
    found["samples"] = demand_true(blocks, device)
    found["lost"] = sum(block.lost for block in blocks)
    assert found["samples"] + found["lost"] == blocks[-1].first_sequence + len(blocks[-1].time_us)
    found.update(noise.done)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["TCP", "RTU"])
def test_no_sample_is_lost_doubled_or_altered(profile: Profile, tmp_path: Path, kind: str) -> None:
    found = study(profile, kind, tmp_path, 4.0, 1 << 30)
    assert found["lost"] == 0
    assert found["samples"] > 100
    assert all(found[what] for what in KINDS)
    assert found["events"] > 0


@pytest.mark.parametrize("kind", ["TCP", "RTU"])
def test_what_a_small_ring_loses_is_counted(profile: Profile, tmp_path: Path, kind: str) -> None:
    """Of the 30 samples that it holds some are overwritten while the wire is mended: 12 with each request."""
    for attempt in range(8):  # a busy machine sees fewer faults in the time
        folder = tmp_path / str(attempt)
        folder.mkdir()
        found = study(profile, kind, folder, 2.0, 30)
        assert found["samples"] > 20
        if found["lost"] > 0:
            return
    pytest.fail("not one sample was overwritten")


@pytest.mark.long
@pytest.mark.parametrize("kind", ["TCP", "RTU"])
def test_ten_minutes_of_it(profile: Profile, tmp_path: Path, kind: str) -> None:
    found = study(profile, kind, tmp_path, 600.0, 1 << 30)
    print(f"\n{kind}: {dict(found)}")
    assert found["lost"] == 0
    assert min(found[what] for what in KINDS) > 100
