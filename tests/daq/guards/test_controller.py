"""The controller's own guard: gaps, faults old and new, other programs, its valve, silence."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.daq.guards.kinds import controller as module
from bufferstand.daq.guards.kinds.controller import ControllerGuard, ControllerMemory, new_limit
from bufferstand.daq.guards.sights import (
    BegunAnew,
    CameBack,
    MotionOver,
    NewZero,
    PassOver,
    Samples,
    Snapshot,
    SwitchedOn,
    ValveExpected,
)
from bufferstand.daq.guards.trips import Action
from bufferstand.drivers import ControllerStatus, EndReason, MotionState

from .beside import Around, block

GUARD = ControllerGuard(2.0, 0.5, 1000.0)
SEEN = ControllerMemory(100.0, 100.0, heartbeat=1, watchdog_trips=3, done_sequence=1)


def status(**changes: Any) -> ControllerStatus:
    plain: dict[str, Any] = {
        "state": MotionState.HOLDING, "fault_code": 0, "done_sequence": 1, "end_reason": EndReason.NONE,
        "cycles_done": 0, "heartbeat": 2, "watchdog_trips": 3, "force_kN": 1.25, "stroke_mm": 3.0,
        "position_mm": 3.0, "command_mm": 3.0,
    }  # fmt: skip
    return ControllerStatus(**plain | changes)


def looked(memory: ControllerMemory = SEEN, **changes: Any) -> Any:
    return GUARD.look(memory, Snapshot(status(**changes)), Around(wall_s=101.0))


def test_what_its_numbers_mean_does_not_change() -> None:
    assert module.FAULT_CODES == {
        1: "watchdog", 2: "force limit of the device", 3: "stroke limit of the device", 4: "actuator",
    }  # fmt: skip
    assert (module.WATCHDOG_FAULT, module.FORCE_LIMIT_FAULT, module.STROKE_LIMIT_FAULT) == (1, 2, 3)
    assert module.LIMITED == {2: "force", 3: "stroke"}
    assert module.DEVICE_LIMIT_FAULTS == (2, 3)
    assert module.fault_text(9) == "fault 9 (unknown cause)"
    plain = ControllerMemory(1.0, 2.0)
    assert (plain.heartbeat, plain.forgiven, plain.valve_on, plain.valve_differs) == (None, None, None, False)


def test_a_calm_snapshot_is_remembered() -> None:
    memory, trip = looked()
    assert trip is None
    assert memory == replace(SEEN, heartbeat=2, heartbeat_s=101.0)
    still, _ = looked(heartbeat=1)
    assert still.heartbeat_s == 100.0, "its heart has not beaten"
    first, _ = looked(ControllerMemory(50.0, 50.0))
    assert first.heartbeat_s == 101.0


@pytest.mark.parametrize(
    ("lost", "missed", "said", "action"),
    [
        (1, 0, "1 sample (1 ms) was lost before sample 70: counted in the run", Action.NOTE),
        (500, 0, "500 samples (500 ms) were lost before sample 70: counted in the run", Action.NOTE),
        (
            1,
            1,
            "1 sample (1 ms) was lost before sample 70, a cycle that the controller missed: counted",
            Action.NOTE,
        ),
        (
            9,
            9,
            "9 samples (9 ms) were lost before sample 70, cycles that the controller missed: c",
            Action.NOTE,
        ),
        (9, 1, "9 samples (9 ms) were lost before sample 70, 1 of them a cycle that the contr", Action.NOTE),
        (
            501,
            0,
            "501 samples (501 ms) were lost before sample 70: longer than 0.5 s, the guards",
            Action.STOP,
        ),
    ],
)
def test_lost_samples_are_counted_or_stop(lost: int, missed: int, said: str, action: Action) -> None:
    gap = block({"force": (1.0, 2.0)}, first=70, at_us=5000, lost=lost, missed=missed)
    memory, trip = GUARD.look(SEEN, Samples(gap), Around(wall_s=103.0))
    assert memory.sample_s == 103.0
    assert trip is not None
    assert trip.reason.startswith(said)
    assert (trip.guard, trip.action, trip.device_fault) == ("ring", action, action is Action.STOP)
    assert (trip.value, trip.limit, trip.unit, trip.sequence, trip.time_us) == (
        lost,
        500.0,
        "samples",
        70,
        5000,
    )


def test_samples_of_other_streams_and_empty_blocks_are_no_life_of_the_controller() -> None:
    for other in (block({"force": 1.0}, stream="t", lost=9), block({}, stream="controller")):
        assert GUARD.look(SEEN, Samples(other), Around(wall_s=103.0)) == (SEEN, None)
    memory, trip = GUARD.look(SEEN, Samples(block({}, lost=3)), Around(wall_s=103.0))
    assert memory is SEEN
    assert trip is not None
    assert trip.time_us is None
    assert GUARD.look(SEEN, Samples(block({"force": 1.0}, lost=-1)), Around())[1] is None
    assert GUARD.look(SEEN, MotionOver(), Around(wall_s=1e6)) == (SEEN, None)


def test_a_limit_of_its_own_is_new_only_once_and_only_a_limit() -> None:
    assert new_limit(SEEN, status(fault_code=2)) == "force"
    assert new_limit(SEEN, status(fault_code=3)) == "stroke"
    assert new_limit(SEEN, status(fault_code=4)) is None
    assert new_limit(SEEN, status()) is None
    assert new_limit(ControllerMemory(0.0, 0.0), status(fault_code=2)) is None
    assert new_limit(replace(SEEN, forgiven=2), status(fault_code=2)) is None
    assert new_limit(replace(SEEN, forgiven=3), status(fault_code=2)) == "force"
    _, trip = looked(fault_code=2, state=MotionState.FAULT)
    assert (trip.limited, trip.believed, trip.value) == ("force", True, 2.0)
    _, trip = looked(fault_code=4, state=MotionState.FAULT)
    assert (trip.limited, trip.believed) == (None, False)


def test_what_the_controller_did_by_itself_is_said_with_its_own_reading() -> None:
    _, trip = looked(watchdog_trips=4)
    assert trip.reason == (
        "the controller stopped the motion: its watchdog ran out (it was not fed in time) and it ramped to "
        "zero force by itself; by its own reading, no zero taken off: force 1.2 kN, stroke 3.0 mm"
    )
    assert (trip.guard, trip.action, trip.device_fault) == ("controller", Action.EMERGENCY, True)
    assert looked(replace(SEEN, watchdog_trips=None), watchdog_trips=4)[1] is None
    assert looked(end_reason=EndReason.WATCHDOG)[1] is None, "of a motion that had ended before"
    assert (
        looked(replace(SEEN, done_sequence=None), done_sequence=2, end_reason=EndReason.WATCHDOG)[1] is None
    )
    assert looked(done_sequence=2, end_reason=EndReason.REACHED)[1] is None
    assert "ended by device limit" in looked(done_sequence=2, end_reason=EndReason.DEVICE_LIMIT)[1].reason


NEW = ControllerMemory(100.0, 100.0)


def test_a_fault_from_before_that_is_over_is_a_note() -> None:
    memory, trip = looked(NEW, fault_code=2, state=MotionState.FAULT, force_kN=5.0)
    assert (memory.forgiven, trip.action, trip.value) == (2, Action.NOTE, 2.0)
    assert "its valve is off and the force is 5.0 kN: switching on resets it" in trip.reason
    assert not trip.device_fault
    memory, trip = looked(NEW, fault_code=1, state=MotionState.RELEASING, force_kN=90.0)
    assert (memory.forgiven, trip.action) == (1, Action.NOTE)
    assert trip.reason.startswith("the controller's watchdog had run out before this start")
    assert looked(memory, fault_code=1, state=MotionState.FAULT)[1] is None, "said once"
    memory, trip = looked(NEW, fault_code=0, state=MotionState.FAULT, force_kN=-1.0)
    assert (memory.forgiven, trip.action) == (0, Action.NOTE)
    for state in (MotionState.OFF, MotionState.READY):
        assert looked(NEW, fault_code=3, state=state, force_kN=-5.0)[1].action is Action.NOTE


def test_a_fault_from_before_with_force_or_under_way_refuses() -> None:
    memory, trip = looked(NEW, fault_code=2, state=MotionState.FAULT, force_kN=-5.01)
    assert (memory.forgiven, trip.action, trip.device_fault, trip.value) == (
        None,
        Action.EMERGENCY,
        True,
        2.0,
    )
    assert "from before this start, its valve is off, and the force is -5.0 kN" in trip.reason
    assert "5 kN at most" in trip.reason
    _, trip = looked(NEW, fault_code=2, state=MotionState.RELEASING, force_kN=1.0)
    assert "it is still taking the force away" in trip.reason


def test_a_fault_that_goes_or_becomes_another_is_no_longer_forgiven() -> None:
    old = replace(SEEN, forgiven=2)
    assert looked(old)[0].forgiven is None
    memory, trip = looked(old, fault_code=4, state=MotionState.FAULT)
    assert (memory.forgiven, trip.action) == (None, Action.EMERGENCY)
    assert looked(old, fault_code=2, state=MotionState.FAULT)[0].forgiven == 2
    assert looked(SEEN, fault_code=2, state=MotionState.FAULT)[0].forgiven is None


def test_a_command_of_another_program_counts_when_it_was_seen_twice() -> None:
    memory, trip = looked(foreign_sequence=77)
    assert (memory.foreign, trip) == (77, None)
    assert looked(memory, foreign_sequence=78)[1] is None
    assert looked(memory)[1] is None
    _, trip = looked(memory, foreign_sequence=77)
    assert (trip.action, trip.value, trip.device_fault) == (Action.EMERGENCY, 77.0, True)
    assert "(number 77) that this program has not given" in trip.reason


@pytest.mark.parametrize(("had", "shown"), [(True, MotionState.OFF), (False, MotionState.HOLDING)])
def test_a_valve_that_somebody_else_has_switched_counts_when_it_was_seen_twice(
    had: bool, shown: MotionState
) -> None:
    known = replace(SEEN, valve_on=had)
    memory, trip = looked(known, state=shown)
    assert (memory.valve_differs, trip) == (True, None)
    _, trip = looked(memory, state=shown)
    assert (trip.action, trip.device_fault) == (Action.EMERGENCY, True)
    now, was = ("off", "on") if had else ("on", "off")
    assert trip.reason.startswith(
        f"the controller's valve is {now} (force 1.2 kN) where this program had it {was}"
    )
    right = MotionState.HOLDING if had else MotionState.OFF
    assert looked(known, state=right)[0].valve_differs is False
    assert looked(replace(known, valve_differs=True), state=right)[1] is None
    assert looked(replace(SEEN, valve_on=None), state=shown)[0].valve_differs is False


def test_silence_is_longer_than_the_limit_and_none_while_an_outage_is_ridden_out() -> None:
    def over(wall_s: float, memory: ControllerMemory = SEEN, **around: Any) -> Any:
        return GUARD.look(memory, PassOver(), Around(wall_s=wall_s, **around))

    assert over(102.0) == (SEEN, None)
    _, trip = over(102.5)
    assert trip.reason == (
        "the controller delivers no new samples for 2.5 s (limit 2 s): check its power and the network"
    )
    assert (trip.action, trip.value, trip.limit, trip.unit, trip.at_s) == (
        Action.EMERGENCY,
        2.5,
        2.0,
        "s",
        5.0,
    )
    assert trip.device_fault
    assert over(102.5, cut_off=True) == (SEEN, None)
    assert "does not count its heartbeat" in over(102.5, replace(SEEN, sample_s=102.0))[1].reason


def test_what_happens_changes_what_it_remembers() -> None:
    full = replace(SEEN, forgiven=2, valve_on=True, valve_differs=True)
    assert GUARD.after(full, BegunAnew(7.0)) == ControllerMemory(7.0, 7.0, valve_on=True)
    assert GUARD.after(full, SwitchedOn()) == replace(full, forgiven=None)
    assert GUARD.after(full, ValveExpected(on=False)) == replace(full, valve_on=False, valve_differs=False)
    for nothing in (NewZero(counted=True), CameBack(1.0)):
        assert GUARD.after(full, nothing) is full


def test_its_margin_is_the_longer_silence() -> None:
    around = Around(wall_s=101.0)
    assert GUARD.margin(replace(SEEN, sample_s=100.5), around).share == 0.5
    assert GUARD.margin(replace(SEEN, heartbeat_s=100.5), around).share == 0.5
    margin = GUARD.margin(replace(SEEN, heartbeat=None, sample_s=100.5), around)
    assert (margin.share, margin.text) == (0.25, "0.5 s ago, trips after 2 s")
    assert margin.action is Action.EMERGENCY


def test_every_controller_has_one() -> None:
    def made(clock: str) -> Any:
        facts = SimpleNamespace(rate_Hz=500.0, clock=clock)
        stand = SimpleNamespace(controller=SimpleNamespace(facts=facts))
        table = SimpleNamespace(controller_silence_s=3.0, gap_stop_s=0.25)
        return list(ControllerGuard.made_for(SimpleNamespace(stand=stand, table=table)))  # type: ignore[arg-type]

    assert made("device") == [ControllerGuard(3.0, 0.25, 500.0, own_clock=True)]
    assert made("host") == [ControllerGuard(3.0, 0.25, 500.0, own_clock=False)]
    assert GUARD.own_clock
    assert GUARD.begin(9.0) == ControllerMemory(9.0, 9.0)
    assert ControllerGuard.turn == 50
