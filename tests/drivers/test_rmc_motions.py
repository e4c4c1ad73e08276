"""Commands of an RMC as they go over the wire, and the judgement before they do."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.controllers.rmc.addresses import RmcAddress
from bufferstand.drivers.controllers.rmc.axis import AxisBit, AxisStatus, RmcAxis
from bufferstand.drivers.controllers.rmc.motions import (
    ACCEPTED,
    ADJUST,
    HARMONIC,
    HOLD,
    NOT_ARMED,
    OUT_OF_RANGE,
    RAMP,
    RELEASE,
    STATIC,
    UNKNOWN,
    WRONG_STATE,
    MotionBounds,
    MotionPort,
)
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters, bytes_of, words_of
from bufferstand.drivers.controllers.rmc.settings import ChangeCodes, RmcSettings
from bufferstand.drivers.interfaces import EndReason
from bufferstand.drivers.register_maps import COMMAND

SETTINGS = RmcSettings(
    model="rmc150",
    axis=0,
    plot=0,
    word_order="little",
    variables=0,
    force="%MD9.8",
    clear_mm=-5.0,
    acceleration_mm_per_s2=5000.0,
    change=ChangeCodes(amplitude=1, offset=2, ramp_cycles=3),
)
STANDING = AxisStatus(AxisBit.ENABLED | AxisBit.DONE, 0.0, 12.0, 12.0, 12.0, 5.0, 12.0)


class Rmc:
    """An axis that obeys at once, what was sent to it, and its variables."""

    number = 56 * 4096 + 118

    def __init__(self, change: ChangeCodes | None = SETTINGS.change) -> None:
        self.sent: list[tuple[float, ...]] = []
        self.requested_mm, self.obeys, self.now = 12.0, True, 0.0
        self.cycle = -1.0
        self.turn: tuple[float, float] | None = None
        self.said: list[str] = []
        registers = RmcRegisters(self.read, self.write, "little")
        self.port = MotionPort(
            RmcAxis(registers, SETTINGS),
            self,
            MotionBounds(800.0, 2.5, -5.0),
            change,
            now_s=lambda: self.now,
            sleep=self.sleep,
            note=self.said.append,
            patience_s=0.1,
        )
        self.port.force_limit_kN, self.port.stroke_limit_mm = 600.0, 100.0

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def read(self, address: int, count: int, what: str) -> list[int]:
        del what
        values = [0.0] * (count // 2)
        if address == RmcAddress(8, 0).wire:
            values[8] = values[53] = 12.0
            values[56] = self.requested_mm
        return words_of(struct.pack(f">{count // 2}f", *values), "little")

    def write(self, address: int, values: object, what: str, once: bool) -> None:
        del what
        assert address == RmcAddress(40, 0).wire
        assert once, "a command is never sent twice"
        words: tuple[float, ...] = struct.unpack(">10f", bytes_of(values, "little"))  # type: ignore[arg-type]
        self.sent.append(words)
        if words[0] == 20 and self.obeys:
            self.requested_mm = words[1]
        if words[0] == 72 and self.obeys:
            self.cycle = 0.0

    def reset(self) -> None:
        self.cycle = -1.0

    def cycles(self) -> float:
        return self.cycle

    def set_turn(self, force_kN: float, speed_mm_per_s: float) -> None:
        self.turn = (force_kN, speed_mm_per_s)

    def has_turned(self) -> bool:
        return self.turn is not None and self.turn[0] == 0.0

    def give(self, code: int, status: AxisStatus = STANDING, **values: float) -> int:
        given = {**dict.fromkeys(COMMAND, 0.0), "command_sequence": 7.0, "command_code": code, **values}
        self.port.arm(given, status, ready=True)
        if self.port.reject == ACCEPTED:
            self.port.execute(7, status, ready=True)
        return self.port.reject


def test_each_motion_is_the_command_of_the_manual() -> None:
    rmc = Rmc()
    assert rmc.give(RAMP, target=20.0, speed=10.0) == ACCEPTED
    assert rmc.sent == [(20.0, 20.0, 10.0, 5000.0, 5000.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
    assert rmc.give(HOLD) == ACCEPTED
    assert rmc.sent[-1][:2] == (6.0, 5000.0)
    assert rmc.give(RELEASE, speed=20.0) == ACCEPTED
    assert rmc.sent[-1][:3] == (20.0, -5.0, 20.0)

    rmc = Rmc()
    assert rmc.give(HARMONIC, mean=12.0, amplitude=3.0, frequency=2.0, cycles=5) == ACCEPTED
    assert rmc.sent == [(72.0, 12.0, 3.0, 2.0, 7.0, 1.0, 56 * 4096 + 118, 0.0, 0.0, 0.0)]
    assert rmc.give(ADJUST, mean=12.5, amplitude=3.5) == ACCEPTED
    assert [one[:5] for one in rmc.sent[1:]] == [(80.0, 1.0, 3.5, 3.0, 1.0), (80.0, 2.0, 12.5, 3.0, 1.0)]


def test_a_command_that_is_executed_twice_is_sent_once() -> None:
    rmc = Rmc()
    rmc.give(RAMP, target=20.0, speed=10.0)
    rmc.port.execute(7, STANDING, ready=True)
    assert (rmc.port.reject, len(rmc.sent)) == (ACCEPTED, 1)
    rmc.port.execute(8, STANDING, ready=True)
    assert (rmc.port.reject, len(rmc.sent)) == (NOT_ARMED, 1)


def test_a_command_that_is_not_taken_is_stopped_and_told() -> None:
    rmc = Rmc()
    rmc.obeys = False
    assert rmc.give(RAMP, target=20.0, speed=10.0) == WRONG_STATE
    assert [one[0] for one in rmc.sent] == [20.0, 6.0]
    assert "was not taken" in rmc.said[0]
    assert rmc.port.motion is None


@pytest.mark.parametrize(
    ("code", "values", "reject"),
    [
        (RAMP, {"target": 101.0, "speed": 10.0}, OUT_OF_RANGE),
        (RAMP, {"target": -6.0, "speed": 10.0}, OUT_OF_RANGE),
        (RAMP, {"target": 20.0, "speed": 0.0}, OUT_OF_RANGE),
        (RAMP, {"target": 20.0, "speed": 801.0}, OUT_OF_RANGE),
        (RAMP, {"target": float("nan"), "speed": 10.0}, OUT_OF_RANGE),
        (HARMONIC, {"mean": 12.0, "amplitude": 13.0, "frequency": 1.0, "cycles": 1}, OUT_OF_RANGE),
        (HARMONIC, {"mean": 12.0, "amplitude": 3.0, "frequency": 2.6, "cycles": 1}, OUT_OF_RANGE),
        (HARMONIC, {"mean": 12.0, "amplitude": 3.0, "frequency": 1.0, "cycles": 0}, OUT_OF_RANGE),
        (HARMONIC, {"mean": 13.0, "amplitude": 3.0, "frequency": 1.0, "cycles": 1}, WRONG_STATE),
        (
            STATIC,
            {"turning_force": 601.0, "turning_stroke": 50.0, "cycles": 1, "speed": 1.0},
            OUT_OF_RANGE,
        ),
        (ADJUST, {"mean": 12.0, "amplitude": 3.0}, WRONG_STATE),
        (9, {}, UNKNOWN),
    ],
)
def test_what_would_do_harm_is_not_sent(code: int, values: dict[str, float], reject: int) -> None:
    rmc = Rmc()
    assert rmc.give(code, **values) == reject
    assert rmc.sent == []


@given(
    st.floats(-200.0, 200.0, width=32), st.floats(-10.0, 2000.0, width=32), st.floats(-20.0, 120.0, width=32)
)
def test_no_move_ever_leaves_the_bounds(target: float, speed: float, at: float) -> None:
    rmc = Rmc()
    status = replace(STANDING, target_mm=at)
    rmc.give(RAMP, status, target=target, speed=speed)
    for words in rmc.sent:
        assert words[0] == 20.0
        assert -5.0 <= words[1] <= 100.0 * (1.0 + 1e-6)
        assert 0.0 < words[2] <= 800.0 * (1.0 + 1e-6)


def test_a_static_stroke_turns_by_the_program_and_counts() -> None:
    rmc = Rmc()
    zero = replace(STANDING, target_mm=0.0)
    values = {"turning_force": 50.0, "turning_stroke": 40.0, "cycles": 2, "speed": 5.0, "static_pause": 1.0}
    assert rmc.give(STATIC, zero, **values) == ACCEPTED
    moving = replace(STANDING, bits=AxisBit.ENABLED)
    look: Callable[[AxisStatus], None] = lambda status: rmc.port.look(status, EndReason.NONE)  # noqa: E731
    for cycle in (1, 2):
        look(STANDING)  # at zero, or the pause is over: out
        assert rmc.turn == (50.0, 5.0)
        assert rmc.sent[-1][1] == 40.0
        look(moving)
        rmc.turn = (0.0, 5.0)  # the program has turned
        look(moving)
        look(STANDING)  # back
        assert rmc.port.cycles_done == cycle
        rmc.now += 1.0
    assert (rmc.port.done, rmc.port.end) == (7, EndReason.FORCE_LIMIT)


def test_a_trip_of_the_program_ends_the_motion() -> None:
    rmc = Rmc()
    rmc.give(RAMP, target=20.0, speed=10.0)
    rmc.port.look(STANDING, EndReason.WATCHDOG)
    assert (rmc.port.done, rmc.port.end, rmc.port.motion) == (7, EndReason.WATCHDOG, None)
