"""A controller without a ring: polled in time by one owner, and honest about what that costs."""

from __future__ import annotations

import asyncio
import math
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.bus_thread import BusThread
from bufferstand.drivers.controllers.poll_skew import PolledAt, SkewMeter
from bufferstand.drivers.controllers.polling_controller import PollingController
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.profile import SHIPPED, load_profile
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput, DeviceFault
from bufferstand.foundation.motions import RampTo
from tests.drivers.clocks import HandClock
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.servers import loop_thread
from tests.drivers.simulated.standing import device

CHANNELS = load_stand(SAMPLE_STAND).controller.channel
POLLING = load_profile("polling")
TEXT = (SHIPPED / "polling.toml").read_text(encoding="utf-8")


class TestSkew:
    def test_by_hand(self) -> None:
        """Force read 2 ms before stroke on the mean, once 1 and once 3; round trips of 1 and 2 ms."""
        meter = SkewMeter([["force"], ["stroke_1", "stroke_2", "position", "command"]], "stroke_1")
        meter.add(PolledAt((0.000, 0.001), (0.001, 0.002)))
        meter.add(PolledAt((0.100, 0.103), (0.001, 0.002)))
        skews = meter.skews()
        force, stroke = skews["force"], skews["stroke_2"]
        assert force.mean_s == pytest.approx(-0.002)
        assert force.spread_s == pytest.approx(0.001)
        # rectangular inside each round trip: half of it over the root of 3 (GUM 4.3.7)
        assert force.u_s == pytest.approx(math.sqrt(0.001**2 + 0.0005**2 / 3 + 0.001**2 / 3))
        assert (stroke.mean_s, stroke.spread_s) == (0.0, 0.0)
        assert stroke.u_s == pytest.approx(0.001 / math.sqrt(3))
        text = meter.text(100.0)
        assert "force is read -2.000 ms from stroke" in text
        percent = 3.31 * force.u_s * 1e3  # D = 0.23: tan δ = 0.168, (1 - D/2) 2π / tan δ = 33.1 per s
        assert f"uncertain by {percent:.2g} % at 1 Hz" in text
        assert "(of a W_a/W_s of 0.23;" in text

    def test_all_in_one_read_have_no_skew_but_a_round_trip(self) -> None:
        meter = SkewMeter([["force", "stroke_1"]], "stroke_1")
        meter.add(PolledAt((0.5,), (0.004,)))
        assert meter.skews()["force"].mean_s == 0.0
        assert meter.skews()["force"].u_s == pytest.approx(0.002 / math.sqrt(3))

    def test_without_a_poll_nothing_is_stated(self) -> None:
        with pytest.raises(ValueError, match="no poll"):
            SkewMeter([["force", "stroke_1"]], "stroke_1").skews()


class TestBus:
    def test_jobs_run_in_one_thread_and_bring_back_what_they_make(self) -> None:
        bus = BusThread(lambda _: None, 0.01, WallClock())
        assert {bus.call(threading.get_ident) for _ in range(5)} != {threading.get_ident()}
        assert len({bus.call(threading.get_ident) for _ in range(5)}) == 1
        with pytest.raises(DeviceFault, match="broken"):
            bus.call(lambda: (_ for _ in ()).throw(DeviceFault("broken")))
        assert bus.call(lambda: 3) == 3
        bus.close()
        bus.close()

    def test_a_slot_is_polled_once_and_missed_ones_are_left_out(self) -> None:
        clock, slots = HandClock(), []
        bus = BusThread(slots.append, 0.01, clock)
        bus.call(bus.begin)
        bus.call(lambda: None)
        for step_s in (0.011, 0.001, 0.010, 0.035):
            clock.advance(step_s)
            bus.call(lambda: None)
        bus.call(lambda: None)
        bus.close()
        assert slots == [0, 1, 2, 5]


@dataclass
class Served:
    controller: PollingController
    stand: SimulatedDevice
    state: dict[str, bool]


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    stand = device(tmp_path)
    state = {"cut": False}
    bank = RegisterBank(stand, POLLING)

    def advance(acting: bool) -> None:
        if acting:  # as for every momentary value and every command: a new sample
            stand.advance(1)

    server = ModbusStandServer(Responder(bank, advance, lambda: state["cut"]), 1)
    with loop_thread() as loop:
        port = asyncio.run_coroutine_threadsafe(server.start("127.0.0.1", 0), loop).result(60)
        link = ModbusLink(TcpWire("127.0.0.1", port), timeout_s=0.2)
        controller = PollingController(link, POLLING, CHANNELS, WallClock(), timeout_s=2.0)
        yield Served(controller, stand, state)
        controller.close()
        asyncio.run_coroutine_threadsafe(server.stop(), loop).result(60)


def read_until(controller: PollingController, samples: int) -> list[tuple[int, int]]:
    """Return (sequence, lost before) of so many samples at least."""
    found: list[tuple[int, int]] = []
    end_s = time.monotonic() + 120.0
    while len(found) < samples:
        assert time.monotonic() < end_s
        block = controller.read_block()
        if block is None:
            time.sleep(0.005)
            continue
        found += [
            (block.first_sequence + row, block.lost if row == 0 else 0) for row in range(len(block.time_us))
        ]
    return found


def test_the_cost_is_in_channels_description_and_events(served: Served) -> None:
    controller = served.controller
    identity = controller.connect()
    assert (identity.device, identity.sample_rate_Hz) == ("bufferstand-polling", 100.0)
    facts = controller.facts
    assert facts.clock == "host"
    assert "POLLED, not sampled by the device: 100 polls/s" in facts.device
    declared = {channel.name: channel for channel in CHANNELS}
    for channel in facts.channels:
        before = declared[channel.name].uncertainty.u_delay_s or 0.0
        assert (channel.uncertainty.u_delay_s or 0.0) > before
    by_name = {channel.name: channel for channel in facts.channels}
    found = re.search(r"force is read ([+-][0-9.]+) ms from stroke", facts.device)
    assert found
    skew_s = float(found[1]) * 1e-3
    assert skew_s < 0.0  # it is read first
    assert by_name["force"].delay_s == pytest.approx(declared["force"].delay_s - skew_s, abs=1e-6)
    assert by_name["stroke_1"].delay_s == declared["stroke_1"].delay_s
    assert [event for event in controller.events() if event.startswith("POLLED")]
    assert controller.connect() == identity  # checks again, measures once
    assert controller.facts == facts


def test_samples_are_what_the_converters_show(served: Served) -> None:
    controller, stand = served.controller, served.stand
    controller.connect()
    blocks = []
    while sum(len(block.time_us) for block in blocks) < 20:
        if (block := controller.read_block()) is not None:
            blocks.append(block)
        else:
            time.sleep(0.002)  # the server in this process needs its turn
    controller.close()
    _, columns = stand.ring.window(0, stand.ring.total)
    for name in ("force", "stroke_1", "stroke_2", "position", "command"):
        got = np.concatenate([block.counts[name] for block in blocks])
        assert got.dtype == columns[name].dtype
        assert set(got.tolist()) <= set(columns[name].tolist())
    assert (
        len(set(np.concatenate([block.counts["force"] for block in blocks]).tolist())) > 5
    )  # noise, not zeros


def test_commands_are_done_between_the_polls(served: Served) -> None:
    controller = served.controller
    controller.connect()
    controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    number = controller.start(RampTo(target_mm=1.0, speed_mm_per_s=100.0))
    end_s = time.monotonic() + 120.0
    while (status := controller.status()).done_sequence != number:
        assert time.monotonic() < end_s
    assert status.position_mm == pytest.approx(1.0, abs=0.06)
    controller.disable()
    assert controller.status().state in (MotionState.OFF, MotionState.READY)


def test_what_a_register_cannot_resolve_is_said(served: Served) -> None:
    controller = served.controller
    controller.connect()
    controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    controller.events()
    controller.start(RampTo(target_mm=1.2345, speed_mm_per_s=100.0))
    (event,) = [event for event in controller.events() if "is sent as" in event]
    assert "target 1.2345 mm is sent as 1.23 (one count of the register is 0.01 mm)" in event


def test_a_late_poll_is_no_gap_and_a_pause_is(served: Served) -> None:
    numbered = served.controller._numbered
    assert [numbered(slot) for slot in (3, 4, 7, 12, 13, 19, 20, 1020)] == [0, 1, 2, 3, 4, 10, 11, 1011]


def test_a_cut_wire_is_a_fault_and_then_a_counted_gap(served: Served) -> None:
    controller = served.controller
    controller.connect()
    before = read_until(controller, 5)
    served.state["cut"] = True

    def read_on() -> None:
        while True:
            block = controller.read_block()
            if block is not None:
                before.extend((block.first_sequence + row, 0) for row in range(len(block.time_us)))

    with pytest.raises(DeviceFault, match="no reply within"):
        read_on()
    served.state["cut"] = False
    after: list[tuple[int, int]] = []
    end_s = time.monotonic() + 120.0
    while not after:
        assert time.monotonic() < end_s
        try:
            after = read_until(controller, 1)
        except DeviceFault:
            continue  # one that was under way
    sequence, lost = after[0]
    assert lost == sequence - before[-1][0] - 1 > 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('["force"], ', "", "poll.reads must name each of force, stroke_1"),
        ("address = 11\n", "address = 20\n", "must follow each other without a hole"),
        (
            'name = "raw_force"\naddress = 0\ntype = "i32"\naccess = "r"\ntable = "input"',
            'name = "raw_force"\naddress = 0\ntype = "i32"\naccess = "r"\ntable = "input"\nscale = 2.0',
            "“raw_force” can have no scale",
        ),
        (
            'name = "raw_force"\naddress = 0\ntype = "i32"\naccess = "r"\ntable = "input"',
            'name = "raw_force"\naddress = 0\ntype = "i32"\naccess = "rw"\ntable = "input"',
            "“raw_force” lies in the input table, which cannot be written",
        ),
        ("rate_Hz = 100.0", "rate_Hz = 0.0", "greater than 0"),
        ("[poll]", "[pull]", "pull"),
        ("expect = 0x12345678", "expect = 0x12345678\nscale = 2.0", "so it can have no scale"),
    ],
)
def test_a_broken_profile_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in TEXT
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape(message)):
        load_profile(str(path))


@pytest.mark.slow
def test_a_profile_has_a_ring_or_polls(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT[: TEXT.index("[poll]")], encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape("either a table [ring] or a table [poll]")):
        load_profile(str(path))
