"""The gateway to an RMC in virtual time: a simulated stand behind an RMC's registers, without sockets."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers import RingController
from bufferstand.drivers.controllers.rmc import MotionBounds, RmcLink, RmcSettings
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.modbus import ModbusRefusal, TcpWire
from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.wires import RmcBank
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import (
    CommandRejected,
    DeviceFault,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
)
from tests.contract.controller.backends import RMC, Bench, write_stand

TRIP_S = 0.001


class _Wire(TcpWire):
    """A wire whose time is a virtual clock's."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__("in process", 0)
        self.now_s, self.sleep = clock.now_s, clock.advance  # type: ignore[method-assign]


class InMemory(RmcLink):
    """The gateway whose requests go no further than a bank in this process, each in its time."""

    bank: RmcBank
    clock: VirtualClock

    def _read_rmc(self, address: int, count: int, what: str) -> list[int]:
        del what
        self.clock.advance(TRIP_S)
        return list(struct.unpack(f">{count}H", self.bank.read_packed(address, count)))

    def _write_rmc(self, address: int, values: Sequence[int], what: str, once: bool) -> None:
        del what, once
        self.clock.advance(TRIP_S)
        if code := self.bank.write(address, values):
            raise ModbusRefusal("refused", code)


def opened(folder: Path) -> tuple[Bench, RmcBank]:
    stand = load_stand(write_stand(folder, RMC))
    clock = VirtualClock()
    device = make_device(stand, clock.wall_s)
    clock.listen(device.advance_to)
    profile, of_kind = stand.profile(), stand.controller.kind_settings
    assert isinstance(of_kind, RmcSettings)
    bounds = MotionBounds(800.0, 2.55, of_kind.clear_mm)
    link = InMemory(_Wire(clock), profile, of_kind, bounds, now_s=clock.now_s)
    link.bank = RmcBank(device, of_kind, [name for name, _ in profile.ring.sample if name != "tick"])
    link.clock = clock
    controller = RingController(link, profile, stand.controller.channel, clock)
    return Bench("in memory", controller, clock), link.bank


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    made, _ = opened(tmp_path)
    made.controller.connect()
    made.enable()
    return made


def test_it_says_who_it_is(tmp_path: Path) -> None:
    made, _ = opened(tmp_path)
    identity = made.controller.connect()
    assert (identity.device, identity.sample_rate_Hz) == ("delta-rmc", 1000.0)
    assert made.controller.says_simulated()
    assert made.controller.status().state is MotionState.OFF
    with pytest.raises(CommandRejected):
        made.controller.start(RampTo(target_mm=1.0, speed_mm_per_s=1.0))


def test_moves_and_samples_are_those_of_the_stand(bench: Bench) -> None:
    done = bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=20.0)))
    assert done.end_reason is EndReason.REACHED
    number = bench.controller.start(Harmonic(mean_mm=10.0, amplitude_mm=4.0, frequency_Hz=2.0, cycles=4))
    bench.until(lambda status: status.cycles_done >= 1)
    bench.controller.adjust_harmonic(mean_mm=10.5, amplitude_mm=4.4)
    done = bench.done(number)
    assert (done.end_reason, done.cycles_done) == (EndReason.REACHED, 4)
    bench.finish()
    position = bench.values("position")
    assert np.max(position) == pytest.approx(14.9, abs=0.2)
    assert sum(block.lost for block in bench.blocks) == 0
    sequence = np.concatenate([one.first_sequence + np.arange(len(one.time_us)) for one in bench.blocks])
    time_us = np.concatenate([one.time_us for one in bench.blocks])
    np.testing.assert_array_equal(np.diff(sequence), 1)
    np.testing.assert_array_equal(np.diff(time_us), 1000)


def test_static_strokes_turn_at_the_force_and_a_hold_ends_a_move(bench: Bench) -> None:
    motion = StaticCycles(
        speed_mm_per_s=20.0, force_limit_kN=35.0, stroke_limit_mm=16.0, cycles=2, pause_s=0.2
    )
    done = bench.done(bench.controller.start(motion))
    assert (done.end_reason, done.cycles_done) == (EndReason.FORCE_LIMIT, 2)
    bench.finish()
    assert 34.0 < np.max(bench.values("force")) < 38.0
    bench.controller.start(RampTo(target_mm=14.0, speed_mm_per_s=2.0))
    bench.until(lambda status: status.position_mm > 1.0)
    held = bench.done(bench.controller.start(StandStill()))
    assert held.state is MotionState.HOLDING
    assert held.position_mm < 3.0
    assert abs(bench.done(bench.controller.start(Release(speed_mm_per_s=20.0))).force_kN) < 1.0


def test_unfed_it_is_unloaded_by_the_program_and_can_be_reset(bench: Bench) -> None:
    bench.enable(watchdog_ms=1000)
    bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=20.0)))
    tripped = bench.until(lambda status: status.state is MotionState.FAULT, feeding=False)
    assert (tripped.fault_code, tripped.watchdog_trips) == (1, 1)
    assert abs(tripped.force_kN) < 2.0
    bench.enable()
    assert bench.controller.status().state is MotionState.HOLDING
    bench.controller.disable()
    assert bench.controller.changed_limits() == ""
    bench.controller.give_back()
    assert bench.controller.seen_writer().number == 0


def test_a_wrong_word_order_and_a_wrong_model_are_told(tmp_path: Path) -> None:
    made, bank = opened(tmp_path)
    bank._settings = bank._settings.model_copy(update={"word_order": "big"})
    with pytest.raises(DeviceFault, match='write word_order = "big"'):
        made.controller.connect()
    (tmp_path / "other").mkdir()
    made, bank = opened(tmp_path / "other")
    bank._model = replace(bank._model, product=1)
    with pytest.raises(DeviceFault, match=r"\[controller.rmc\] model"):
        made.controller.connect()


def test_what_no_number_is_in_a_variable_ends_nothing(bench: Bench) -> None:
    link = bench.controller._link  # type: ignore[attr-defined]
    read = link._variables.all
    link._variables.all = lambda: {
        **read(),
        "trips": float("nan"),
        "left_s": float("inf"),
        "number": float("nan"),
    }
    status = bench.controller.status()
    assert status.watchdog_trips == 0
    assert bench.controller.connect().device == "delta-rmc"
