"""Guard by guard: what causes a trip, in which words it is said, what it leads to, and by which sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.guards.from_limits import guards_for
from bufferstand.daq.guards.kinds.clock import HostMemory, LagGuard, LagMemory, evaluate_host, evaluate_lag
from bufferstand.daq.guards.kinds.missed_cycles import MissedGuard, evaluate_missed
from bufferstand.daq.guards.kinds.rate import SpeedGuard, SpeedMemory, evaluate_speed
from bufferstand.daq.guards.kinds.recorder import RecorderGuard
from bufferstand.daq.guards.panel import GuardPanel
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import (
    ControllerStatus,
    EndReason,
    MotionState,
    SensorFault,
    Stand,
    StreamFacts,
)
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.loading import parse_settings
from bufferstand.foundation.specimen.file import Specimen
from bufferstand.protocols.campaign_file.guard_table import GuardTable
from bufferstand.protocols.limits import StandLimits, TestLimits, envelope
from tests.daq.cases import ListRecorder
from tests.daq.fake_stand import CONTROLLER_FACTS, FakeClock, channel, fake_stand

REST = {"command": 0.0, "force": 0.0, "stroke": 0.0, "tilt": 0.0, "following_error": 0.0}


class _Silent:
    def __init__(self, facts: StreamFacts) -> None:
        self.facts = facts

    def start(self) -> None: ...

    def drain(self) -> list[Any]:
        return []

    def close(self) -> None: ...


def panel(table: GuardTable | None = None) -> GuardPanel:
    """Return the panel of a stand with everything: two sensors and an amplifier."""
    controller = fake_stand(FakeClock())[0].controller
    names = ("amplifier", "temperature_1", "temperature_3")
    quantities = (("force_2", "force", "kN"), *((name, "temperature", "°C") for name in names[1:]))
    sensors = tuple(
        _Silent(StreamFacts(name, "host", (channel(*facts, 1.0),), 1.0, "test"))
        for name, facts in zip(names, quantities, strict=True)
    )
    limits = TestLimits()
    bounds = envelope(StandLimits(600.0, 250.0, 2.55, 800.0), limits, Specimen(id="spring"))
    stand = Stand(controller, sensors)
    guards = guards_for(limits, bounds, stand, ambient=["temperature_3"], table=table)
    return GuardPanel(guards, wall_s=0.0)


def samples(first: int = 1, count: int = 400, *, lost: int = 0, at: int = 300, **value: float) -> ScaledBlock:
    """Return samples at rest of which those from row ``at`` on have other values."""
    columns = {}
    for name, rest in REST.items():
        columns[name] = np.full(count, rest)
        columns[name][at:] = value.get(name, rest)
    time_us = (first + lost + np.arange(count, dtype=np.int64)) * 1000
    return ScaledBlock("controller", first + lost, time_us, columns, lost, 0.5)


def reading(value_C: float, number: int, stream: str = "temperature_1", at_s: float = 1.0) -> ScaledBlock:
    stamps = np.array([round(at_s * 1e6)], dtype=np.int64)
    return ScaledBlock(stream, number, stamps, {stream: np.array([value_C])}, 0, at_s)


STATUS = ControllerStatus(
    MotionState.HOLDING, 0, 0, EndReason.NONE, 0, 1, 0, 0.0, 0.0, 0.0, 0.0
)  # fmt: skip


def sees(*blocks: ScaledBlock) -> Callable[[GuardPanel], None]:
    def act(watched: GuardPanel) -> None:
        for block in blocks:
            watched.observe(block, 0.5)

    return act


def shows(**changes: Any) -> Callable[[GuardPanel], None]:
    def act(watched: GuardPanel) -> None:
        watched.judge(STATUS, 0.0, 0.0)
        watched.judge(replace(STATUS, heartbeat=2, **changes), 0.1, 0.1)

    return act


def hears_nothing(complaint: SensorFault | None = None) -> Callable[[GuardPanel], None]:
    def act(watched: GuardPanel) -> None:
        watched.observe(samples(), 5.4)
        watched.judge(STATUS, 5.4, 5.4)
        for stream in ("temperature_1", "temperature_3"):
            if complaint is None or complaint.stream != stream:
                watched.observe(reading(21.0, 0, stream), 5.4)
        if complaint is not None:
            watched.complain(complaint)
        watched.listen(5.5, 5.5)

    return act


def jumping(block: ScaledBlock, by_us: int) -> ScaledBlock:
    return replace(block, time_us=block.time_us + by_us)


# guard, cause, words of the reason, action, the sample that caused it, whether a device is at fault
TABLE: list[tuple[str, Callable[[GuardPanel], None], str, Action, int | None, bool]] = [
    ("force", sees(samples(force=700.0)), "700.00 kN exceeds the limit of 618", Action.EMERGENCY, 301, False),
    ("force", sees(samples(force=-11.0)), "is below the limit of -10.00 kN", Action.EMERGENCY, 301, False),
    ("force", sees(samples(force=float("nan"))), "is not a number", Action.EMERGENCY, 301, False),
    ("stroke", sees(samples(stroke=253.0)), "exceeds the limit of 252.00 mm", Action.EMERGENCY, 301, False),
    ("tilt", sees(samples(tilt=6.0)), "tilt (stroke_1 − stroke_2) 6.00 mm", Action.EMERGENCY, 351, False),
    (
        "following error",
        sees(samples(count=600, following_error=11.0)),
        "following error (command − position) 11.00 mm",
        Action.STOP,
        551,
        False,
    ),
    ("speed", sees(samples(stroke=30.0)), "changes at +1500 mm/s, faster than 1000", Action.STOP, 301, False),
    (
        "frozen force",
        sees(samples(at=0, command=3.0, force=50.0), samples(401, at=0, command=6.5, force=50.0)),
        "force has shown exactly 50.0000 for 0.80 s while the command moved by 3.5 mm (until sample 800)",
        Action.STOP,
        800,
        True,
    ),
    ("ring", sees(samples(), samples(401, lost=20)), "counted in the run", Action.NOTE, 421, False),
    ("ring", sees(samples(), samples(401, lost=600)), "the guards were blind", Action.STOP, 1001, True),
    ("clock", sees(samples(), jumping(samples(401), 500_000)), "jumped by +0.500 s", Action.STOP, 401, True),
    ("clock", sees(samples(), jumping(samples(401), -500_000)), "jumped by -0.500 s", Action.STOP, 401, True),
    ("controller", shows(fault_code=4), "it reports fault 4 (actuator)", Action.EMERGENCY, None, True),
    ("controller", shows(watchdog_trips=1), "its watchdog ran out", Action.EMERGENCY, None, True),
    ("controller", lambda p: p.listen(2.5, 2.5), "delivers no new samples", Action.EMERGENCY, None, True),
    (
        "temperature_1",
        sees(reading(39.9, 7), reading(40.0, 8, at_s=2.0)),
        "temperature_1 (test) 40.00 °C has reached the stop threshold of 40 °C",
        Action.STOP,
        8,
        False,
    ),
    (
        "heating of temperature_1",
        sees(*(reading(20.0 + 0.5 * n, n, at_s=float(n)) for n in range(12))),
        "rises by 30.0 K/min, faster than 20",
        Action.STOP,
        10,
        False,
    ),
    (
        "temperature_1",
        hears_nothing(SensorFault("temperature_1", 5.0, "CRC wrong: check the cable")),
        "has given no true reading for 5.5 s (limit 5 s; never): CRC wrong: check the cable",
        Action.STOP,
        None,
        True,
    ),
    (
        "temperature_3",
        hears_nothing(SensorFault("temperature_3", 5.0, "no reply")),
        "temperature_3 (test) has given no true reading",
        Action.NOTE,
        None,
        True,
    ),
    (
        "silence of amplifier",
        hears_nothing(SensorFault("amplifier", 5.0, "frames of a wrong form")),
        "amplifier has delivered nothing for 5.5 s (limit 5 s): frames of a wrong form",
        Action.NOTE,
        None,
        False,
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("guard", "cause", "words", "action", "sequence", "device_fault"),
    TABLE,
    ids=[f"{row[0]}-{number}" for number, row in enumerate(TABLE)],
)
def test_every_guard_says_its_cause_and_leads_to_its_action(
    guard: str,
    cause: Callable[[GuardPanel], None],
    words: str,
    action: Action,
    sequence: int | None,
    device_fault: bool,
) -> None:
    watched = panel()
    cause(watched)
    trip = next(trip for trip in watched.said() if trip.guard == guard)
    assert words in trip.reason
    assert (trip.action, trip.sequence, trip.device_fault) == (action, sequence, device_fault)
    if action is Action.NOTE:
        assert watched.trip is None
    else:
        assert watched.trip == trip, "the first trip is latched, with the sample that caused it"
        watched.observe(samples(1001, force=900.0), 0.6)
        assert watched.trip == trip, "a later one does not take its place"


def test_what_is_as_it_should_be_trips_nothing() -> None:
    watched = panel()
    for number in range(30):
        watched.observe(samples(1 + 400 * number, stroke=0.1, force=1.0, at=0), 0.4 * number)
        watched.observe(reading(21.0 + 0.3 * number, number, at_s=float(number)), 0.4 * number)
        status, at_s = replace(STATUS, heartbeat=number), 0.4 * number
        watched.judge(status, at_s, at_s, age_s=0.2, up_to_date=False)
    assert watched.said() == []


def test_how_the_samples_are_cut_changes_no_speed() -> None:
    guard = SpeedGuard("speed", "stroke", 1000.0, "mm/s", "stroke")
    whole = samples(stroke=30.0)
    found: list[Trip | None] = []
    for cut in (1, 7, 19, 20, 21, 400):
        memory, first = SpeedMemory(), None
        for at in range(0, 400, cut):
            part = ScaledBlock(
                "controller",
                1 + at,
                whole.time_us[at : at + cut],
                {"stroke": whole.values["stroke"][at : at + cut]},
                0,
                0.5,
            )
            memory, trip = evaluate_speed(guard, memory, part)
            first = first or trip
        found.append(first)
    assert [trip and (trip.sequence, trip.value) for trip in found] == [(301, pytest.approx(1500.0))] * 6


def test_the_campaign_file_says_what_a_trip_leads_to() -> None:
    table = parse_settings(
        'heating_max_K_per_min = 1.0\n[action]\nheating = "finish-cycle"\n', GuardTable, "g"
    )
    watched = panel(table)
    for number in range(15):
        watched.observe(reading(20.0 + 0.05 * number, number, at_s=float(number)), 1.0)
    assert watched.trip is not None
    assert watched.action is Action.STOP_AFTER_CYCLE
    for wrong in ('[action]\nforce = "note"\n', "tilt = 3.0\n", "gap_stop_s = 0.0\n"):
        with pytest.raises(BadInput):
            parse_settings(wrong, GuardTable, "g")
    said = watched.guards.as_dict()
    assert said["heating"][0]["action"] == "stop_after_cycle"
    assert said["channels"][0]["action"] == "emergency"


def lagging(ages_s: list[float | None], *, up_to_date: bool = False) -> list[Trip]:
    """Return what the guard says of ages of the newest sample, one each tenth of a second."""
    memory, said = LagMemory(0.0), []
    for tenth, age_s in enumerate(ages_s):
        memory, trip = evaluate_lag(
            LagGuard(10.0), memory, age_s=age_s, up_to_date=up_to_date, at_s=0.0, wall_s=tenth / 10
        )
        said += [trip] if trip else []
    return said


def test_a_reader_that_stays_behind_is_noted_and_then_stops() -> None:
    for age_s in (0.5, None):
        said = lagging([age_s] * 110)
        assert [trip.action for trip in said[:2]] == [Action.NOTE, Action.STOP]
        assert said[0].value == pytest.approx(1.1)
        assert "the reader has been behind the stand for 1.1 s (stop at 10 s)" in said[0].reason
    assert "the newest sample is 0.50 s old" in lagging([0.5] * 20)[0].reason


def test_a_reader_is_judged_by_the_age_of_its_samples_not_by_an_empty_ring() -> None:
    assert lagging([0.2] * 200) == [], "full blocks for ever, but none is older than round trips explain"
    assert lagging([None] * 200, up_to_date=True) == []
    assert lagging([3.0] * 200, up_to_date=True) == [], "the device had no more: its clock runs apart"


def test_samples_that_get_older_stop_soon_and_those_that_get_younger_do_not() -> None:
    growing = lagging([0.3 * tenth for tenth in range(100)])
    assert growing[-1].action is Action.STOP
    stop = next(trip for trip in growing if trip.action is Action.STOP)
    assert stop.value is not None
    assert stop.value < 3.0
    assert "not getting younger" in stop.reason
    catching_up = lagging([9.0 - 0.1 * tenth for tenth in range(90)])
    assert [trip.action for trip in catching_up] == [Action.NOTE]


def test_missed_cycles_are_noted_and_too_many_of_a_minute_stop() -> None:
    guard, memory = MissedGuard(3), ()
    said: list[Trip | None] = []
    for at_s in (1, 20, 40, 62, 63, 64):
        time_us = np.array([at_s * 1_000_000])
        block = ScaledBlock("controller", at_s, time_us, {"force": np.zeros(1)}, 1, 0.0, 1)
        memory, trip = evaluate_missed(guard, memory, block)
        said.append(trip)
    assert [bool(trip) for trip in said] == [False, False, False, False, True, True]
    assert said[4] is not None
    assert (said[4].action, said[4].device_fault, said[4].value) == (Action.STOP, True, 4.0)
    assert "missed 4 cycles of its loop within 60 s, more than 3" in said[4].reason
    lost_only = ScaledBlock("controller", 70, np.array([70_000_000]), {"force": np.zeros(1)}, 9, 0.0)
    assert evaluate_missed(guard, memory, lost_only) == (memory, None)


def test_a_set_clock_and_a_pause_of_the_program_are_said() -> None:
    memory = HostMemory(1000.0, 10.0, 0.0)
    memory, said = evaluate_host(memory, 1000.02, 10.02, 0.02, guarded=True)
    assert said == []
    memory, said = evaluate_host(memory, 4600.04, 10.04, 0.04, guarded=True)
    assert [trip.guard for trip in said] == ["clock"]
    assert "civil time was set by +3600.0 s" in said[0].reason
    memory, said = evaluate_host(memory, 4602.2, 12.2, 2.2, guarded=True)
    assert [(trip.guard, trip.action) for trip in said] == [("pause", Action.NOTE)]
    assert "stood still for 2.2 s" in said[0].reason
    memory, said = evaluate_host(memory, 4612.2, 22.2, 12.2, guarded=False)
    assert said == []
    assert evaluate_host(memory, 4612.3, 22.3, 12.3, guarded=True)[1] == []


def test_a_disk_that_ails_or_lags_is_said_and_one_that_stands_stops() -> None:
    now, recorder = [0.0], ListRecorder(written=10, durable=10)
    guard = RecorderGuard(10.0, lambda: now[0])
    guard.begin()
    assert guard.look(recorder, 0.0) == []
    recorder.renewals = ("sync failed: Input/output error",)
    (note,) = guard.look(recorder, 0.0)
    assert (note.action, "Input/output error" in note.reason) == (Action.NOTE, True)
    assert guard.look(recorder, 0.0) == [], "each is said once"
    now[0] = 3.0  # a pass that took long: the disk had all, and what comes now has not waited yet
    recorder.written = 5010
    assert guard.look(recorder, 0.0) == []
    now[0] = 5.1
    (late,) = guard.look(recorder, 0.0)
    assert late.action is Action.NOTE
    assert "5000 samples have waited for it for 2.1 s (stop at 10 s)" in late.reason
    now[0] = 12.9
    assert guard.look(recorder, 0.0) == []
    now[0] = 13.1
    (stop,) = guard.look(recorder, 0.0)
    assert (stop.action, stop.guard, stop.device_fault) == (Action.STOP, "recorder", True)
    recorder.durable = 5010
    assert guard.look(recorder, 0.0) == []


def test_the_facts_of_the_stand_are_those_of_the_fake() -> None:
    assert CONTROLLER_FACTS.rate_Hz == 1000.0  # the row numbers of the table are milliseconds
