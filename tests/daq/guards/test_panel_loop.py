"""The panel as a loop and a latch: what comes in reaches the guards, and what they say is said."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from bufferstand.daq.guards import panel as panel_module
from bufferstand.daq.guards.catalogue import kinds
from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.kinds import (
    ChannelGuard,
    ControllerGuard,
    SignalsGuard,
    TemperatureGuard,
)
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.panel import AIR_C, GuardPanel, GuardSet
from bufferstand.daq.guards.sights import (
    BegunAnew,
    CameBack,
    ClocksRead,
    Complaint,
    Computer,
    Judged,
    MotionOver,
    NewZero,
    PassOver,
    Phase,
    Recorded,
    RunBegun,
    Samples,
    Sight,
    Snapshot,
    SwitchedOn,
    ValveExpected,
)
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import ControllerStatus, EndReason, MotionState, SensorFault

SEEN: list[Any] = []


@dataclass(frozen=True)
class Witness(Guard[int]):
    """Writes down all that it is asked, and says what it is told to."""

    kind: ClassVar = "witness"
    title: ClassVar = "a witness"
    settings: ClassVar = ()
    facts_as: ClassVar = "list"
    looks_at: ClassVar = (Samples, Judged, Complaint, Snapshot, Recorded, PassOver, MotionOver)
    standing: ClassVar = True
    remembers: ClassVar = int

    name: str = "witness"
    says: Found = None
    doubts: bool = False
    instead: Trip | None = None

    @property
    def key(self) -> str:
        return self.name

    def look(self, memory: int, sight: Sight, beside: Beside) -> tuple[int, Found]:
        SEEN.append((sight, beside.at_s, beside.wall_s))
        return memory + 1, self.says

    def margin(self, memory: int, beside: Beside) -> Margin:  # noqa: ARG002
        return Margin(self.name, self.name, f"{memory}", None, Action.NOTE)

    def after(self, memory: int, happening: Any) -> int | None:
        SEEN.append(happening)
        return memory

    def explained(self, memory: int, trip: Trip, beside: Beside) -> Trip:  # noqa: ARG002
        return trip if self.instead is None else self.instead

    def is_unsure(self, memory: int) -> bool:  # noqa: ARG002
        return self.doubts


def trip(guard: str = "force", action: Action = Action.STOP, **more: Any) -> Trip:
    return Trip(guard, action, "why", 0.0, **more)


def watched(*guards: Guard[Any]) -> GuardPanel:
    SEEN.clear()
    return GuardPanel(GuardSet(guards or (Witness(),), complete=False), wall_s=1.0)


def block(stream: str = "controller") -> ScaledBlock:
    return ScaledBlock(stream, 0, np.array([0]), {"force": np.array([1.0])}, 0, 7.5)


STATUS = ControllerStatus(MotionState.HOLDING, 0, 0, EndReason.NONE, 0, 0, 0, 0.0, 0.0, 0.0, 0.0)


def test_time_begins_where_nothing_was_seen() -> None:
    panel = watched()
    assert (panel.at_s, panel.wall_s, panel.cut_off, panel.explained_by) == (0.0, 1.0, False, "")


def test_every_sight_reaches_a_guard_that_looks_at_it_with_its_times() -> None:
    panel = watched()
    own, other = block(), block("temperature_1")
    panel.observe(own, 2.0)
    panel.observe(other, 3.0)
    assert [
        (Samples(own), 7.5, 2.0),
        (Samples(other), 7.5, 3.0),
        (Judged(other), 7.5, 3.0),
    ] == SEEN
    SEEN.clear()
    fault = SensorFault("temperature_1", 8.0, "CRC wrong")
    computer = Computer(1.0, 2.0, guarded=True)
    panel.complain(fault)
    panel.judge(STATUS, 9.0, 4.0)
    panel.judge(STATUS, 9.5, 4.5, sampled_kN=1.0, age_s=0.1, up_to_date=False)
    panel.look_at_recorder("recorder", 10.0)  # type: ignore[arg-type]
    panel.listen(11.0, 5.0, computer)
    panel.look_once_more(12.0)
    assert [
        (Complaint(fault), 7.5, 3.0),
        (Snapshot(STATUS, None, None, up_to_date=True), 9.0, 4.0),
        (Snapshot(STATUS, 1.0, 0.1, up_to_date=False), 9.5, 4.5),
        (Recorded("recorder"), 10.0, 4.5),  # type: ignore[arg-type]
        (PassOver(computer), 11.0, 5.0),
        (MotionOver(), 12.0, 5.0),
    ] == SEEN
    assert panel.margins(6.0)[0].text == "9", "what it remembers is handed on"
    assert panel.wall_s == 6.0


def test_every_happening_is_told_also_to_a_guard_that_is_not_in_force_now() -> None:
    panel = watched()
    panel.change(GuardSet(complete=False))
    panel.rebase()
    panel.rebase(counted=True)
    panel.switched_on()
    panel.expect_valve(on=True)
    panel.cut_off = True
    panel.came_back(2.0)
    assert not panel.cut_off
    panel.cut_off = True
    panel.begin_anew(3.0)
    assert not panel.cut_off
    panel.begin_run()
    panel.read_clocks(1.0, 2.0, 3.0)
    assert [
        NewZero(counted=False),
        NewZero(counted=True),
        SwitchedOn(),
        ValveExpected(on=True),
        CameBack(2.0),
        BegunAnew(3.0),
        RunBegun(),
        ClocksRead(1.0, 2.0, 3.0),
    ] == SEEN


def test_a_guard_that_has_begun_to_doubt_asks_for_more() -> None:
    assert not watched().look_once_more(1.0)
    assert watched(Witness(), Witness("other", doubts=True)).look_once_more(1.0)


def test_several_trips_of_one_look_are_all_said() -> None:
    panel = watched(Witness(says=(trip("a", Action.NOTE), trip("b"))))
    panel.look_once_more(1.0)
    assert [one.guard for one in panel.said()] == ["a", "b"]


def test_a_fault_that_this_programs_own_absence_explains_says_so_first() -> None:
    panel = watched()
    panel.explained_by = "it slept"
    panel.latch(trip("stroke"))
    assert panel.trip is not None
    assert panel.trip.reason == "why", "no device's fault"
    panel.latch(trip("watchdog", Action.EMERGENCY, device_fault=True))
    assert [one.reason for one in panel.said()] == ["why", "why"], "something else has stopped the stand"
    panel.reset()
    panel.latch(trip("watchdog", device_fault=True))
    assert panel.trip.reason == "it slept: why"
    panel.reset()
    panel.explained_by = ""
    panel.latch(trip("watchdog", device_fault=True))
    assert panel.trip.reason == "why"


def test_after_a_reset_the_same_guard_is_said_again() -> None:
    panel = watched()
    panel.latch(trip(action=Action.EMERGENCY))
    panel.latch(trip())
    assert len(panel.said()) == 1
    panel.reset()
    panel.latch(trip("operator", Action.EMERGENCY))
    panel.latch(trip())
    assert [one.guard for one in panel.said()] == ["operator", "force"]


OTHER = trip("wiring", Action.EMERGENCY)


def test_a_trip_that_believes_its_signal_is_put_before_those_that_doubt() -> None:
    panel = watched(Witness(says=trip(believed=True)), Witness("z", instead=OTHER))
    panel.look_once_more(1.0)
    assert panel.trip is OTHER
    assert [one.guard for one in panel.said()] == ["wiring"]
    panel.latch(trip(action=Action.EMERGENCY))
    assert panel.said() == [], "under either name it is said once"


def test_one_that_believes_nothing_and_one_behind_the_first_are_latched_as_they_are() -> None:
    panel = watched(Witness(says=trip()), Witness("z", instead=OTHER))
    panel.look_once_more(1.0)
    assert panel.trip == trip()
    panel = watched(Witness(says=trip(believed=True)), Witness("z", instead=OTHER))
    panel.latch(trip("operator", Action.EMERGENCY))
    panel.look_once_more(1.0)
    assert [one.guard for one in panel.said()] == ["operator", "force"]


def test_a_note_that_is_explained_may_be_said_by_its_guard_again() -> None:
    note = trip(action=Action.NOTE, believed=True)
    panel = watched(Witness(says=note), Witness("z", instead=trip("wiring", Action.NOTE)))
    panel.look_once_more(1.0)
    panel.latch(trip("lag", Action.EMERGENCY))
    panel.latch(trip())
    assert [one.guard for one in panel.said()] == ["wiring", "lag", "force"]


def test_what_is_latched_under_its_own_name_needs_no_second_mark() -> None:
    panel = watched(Witness(says=trip("a", Action.NOTE)))
    panel.look_once_more(1.0)
    panel.latch(trip("b", Action.EMERGENCY))
    panel.latch(trip("a"))
    assert [one.guard for one in panel.said()] == ["a", "b", "a"], "a note was no trip"


def test_the_gravest_margins_stand_first() -> None:
    panel = watched(
        TemperatureGuard("temperature_1", "", 40.0, 30.0, 5.0, action=Action.STOP),
        ChannelGuard("force", "force", 600.0, -10.0, "kN", "force", Action.EMERGENCY),
        Witness(),
    )
    assert [one.action for one in panel.margins(1.0)] == [Action.EMERGENCY, Action.STOP, Action.NOTE]


def test_two_guards_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match=r"more than one guard of the same name: {\('witness', 'witness'\)}"):
        GuardSet(Witness(), Witness(), complete=False)
    assert len(list(GuardSet(Witness("a"), Witness("b"), complete=False))) == 2


def test_a_set_during_a_phase_gets_back_none_that_it_lacks() -> None:
    some = GuardSet(Witness(), complete=False)
    assert list(some.during(Phase.COOLING)) == [Witness()]
    assert len(list(GuardSet(Witness()))) > 1, "those that always stand are added elsewhere"


def test_a_journal_is_looked_at_by_the_guards_that_can(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = GuardSet(
        ChannelGuard("force", "force", 600.0, -10.0, "kN", "force", Action.EMERGENCY),
        TemperatureGuard("temperature_1", "plate", 40.0, 30.0, 5.0),
        ControllerGuard(2.0, 0.5, 1000.0),
    )
    again = GuardSet.from_dict(whole.as_dict())
    assert again.of(ChannelGuard) == whole.of(ChannelGuard)
    assert again.of(TemperatureGuard) == whole.of(TemperatureGuard)
    assert {type(one) for one in again} == {type(one) for one in whole if one.in_journal}
    assert len(list(again)) < len(list(whole))
    standing = {kind for kind in kinds() if kind.standing and kind.in_journal}
    assert {type(one) for one in GuardSet.from_dict({})} == standing
    assert any(kind.standing and not kind.in_journal for kind in kinds())

    class One(Witness):
        kind: ClassVar = "one"
        facts_as: ClassVar = "one"
        standing: ClassVar = False

        @classmethod
        def made_for(cls, site: Any) -> Any:  # noqa: ARG003
            return ()

    monkeypatch.setattr(panel_module, "kinds", lambda: (One,))
    content = {"one": {"name": "x"}}
    assert [one.key for one in GuardSet.from_dict(content)] == ["x"]
    assert list(GuardSet.from_dict({"one": None})) == []
    assert GuardSet(One("x"), complete=False).as_dict()["one"]["name"] == "x"


def reading(name: str, value_C: float) -> ScaledBlock:
    return ScaledBlock(name, 0, np.array([1]), {name: np.array([value_C])}, 0, 1.0)


def test_the_air_is_as_a_thermometer_in_it_shows_else_as_planned() -> None:
    assert AIR_C == 20.0
    specimen = TemperatureGuard("temperature_1", "plate", 40.0, 30.0, 5.0)
    air = TemperatureGuard("temperature_2", "air", None, None, 5.0)
    panel = watched(specimen, air)
    assert panel.ambient_C == AIR_C
    panel.observe(reading("temperature_1", 28.0), 1.0)
    assert panel.ambient_C == AIR_C, "that is the specimen's"
    panel.observe(reading("temperature_2", 23.0), 1.0)
    assert panel.ambient_C == 23.0
    assert panel.latest_temperatures() == {"temperature_1": 28.0, "temperature_2": 23.0}
    assert panel.specimen_temperatures() == {"temperature_1 (plate)": 28.0}
    planned = watched(specimen, air, SignalsGuard(ambient_C=17.0))
    assert planned.ambient_C == 17.0


def test_a_specimen_behind_the_sensor_of_the_air_is_looked_at_too() -> None:
    air = TemperatureGuard("temperature_1", "air", None, None, 5.0)
    specimen = TemperatureGuard("temperature_2", "plate", 40.0, 30.0, 5.0)
    panel = watched(air, specimen)
    assert panel.warmer_than() == "temperature_2 (plate) has given no reading yet"


def test_a_limit_of_the_devices_own_is_told_only_where_nothing_else_has_tripped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Any] = []

    def limited(memory: Any, status: ControllerStatus) -> str:
        asked.append((memory, status))
        return "limited"

    monkeypatch.setattr(panel_module, "new_limit", limited)
    panel = watched(ControllerGuard(2.0, 0.5, 1000.0))
    assert panel.has_limited(STATUS) == "limited"
    assert len(asked) == 1
    panel.latch(trip())
    assert panel.has_limited(STATUS) is None
    assert len(asked) == 1
    assert panel.old_fault is None, "nothing from before"
