"""What every guard has in common: what a kind must state, its data in the run file, what it forgets when."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import BegunAnew, CameBack, NewZero, PassOver, Phase, RunBegun, Sight
from bufferstand.daq.guards.trips import Action, Trip


@dataclass(frozen=True)
class Bell(Guard[int]):
    kind: ClassVar = "bell"
    title: ClassVar = "a bell"
    settings: ClassVar = ()
    facts_as: ClassVar = "list"
    looks_at: ClassVar = (PassOver,)
    remembers: ClassVar = int
    standing: ClassVar = True

    name: str = "bell"
    limit: float = 1.0
    action: Action = Action.STOP
    silence_action: Action = Action.NOTE

    def look(self, memory: int, sight: Sight, beside: Beside) -> tuple[int, Found]:  # noqa: ARG002
        return memory + 1, None

    def margin(self, memory: int, beside: Beside) -> Margin:  # noqa: ARG002
        return Margin(self.name, self.name, "", None, self.action)


def test_what_no_kind_need_say_is_the_same_for_all() -> None:
    plain = {
        name: getattr(Guard, name)
        for name in ("docs", "turn", "standing", "in_journal", "of_zero", "lasting")
    }
    assert plain == {
        "docs": (),
        "turn": 1000,
        "standing": False,
        "in_journal": True,
        "of_zero": False,
        "lasting": False,
    }
    assert Guard.__abstractmethods__ == {"look", "margin"}
    assert Bell.__parameters__ == ()  # type: ignore[attr-defined]
    assert Guard.remembers() is None  # type: ignore[misc]
    assert (Bell().key, Bell().begin(3.0)) == ("", 0)
    assert Bell().during(Phase.COOLING) == Bell()
    assert Bell().is_unsure(7) is False
    trip = Trip("force", Action.STOP, "", 0.0)
    assert Bell().explained(0, trip, None) is trip  # type: ignore[arg-type]
    assert list(Bell.made_for(None)) == []  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "left_out", ["kind", "title", "settings", "facts_as", "looks_at", "look", "margin", "made_for"]
)
def test_a_kind_that_leaves_something_out_is_refused_by_name(left_out: str) -> None:
    stated: dict[str, Any] = {
        "kind": "gong", "title": "a gong", "settings": (), "facts_as": "one", "looks_at": (PassOver,),
        "look": Bell.look, "margin": Bell.margin, "made_for": classmethod(lambda cls, site: ()),  # noqa: ARG005
    }  # fmt: skip
    assert type("Gong", (Guard,), dict(stated)).kind == "gong"  # type: ignore[attr-defined]
    del stated[left_out]
    with pytest.raises(TypeError, match=f"Gong does not state its {left_out}$"):
        type("Gong", (Guard,), stated)


def test_one_that_stands_in_every_set_is_made_for_no_stand() -> None:
    stated: dict[str, Any] = {
        "kind": "gong", "title": "a gong", "settings": (), "facts_as": "one", "looks_at": (PassOver,),
        "look": Bell.look, "margin": Bell.margin, "standing": True,
    }  # fmt: skip
    assert type("Gong", (Guard,), stated).standing  # type: ignore[attr-defined]


def test_its_data_name_actions_and_come_back_as_they_were() -> None:
    bell = Bell("small", 2.5, Action.EMERGENCY, Action.STOP_AFTER_CYCLE)
    facts = bell.facts()
    assert facts == {
        "name": "small",
        "limit": 2.5,
        "action": "emergency",
        "silence_action": "stop_after_cycle",
    }
    assert Bell.from_facts(facts) == bell
    assert Bell.from_facts(facts | {"of a later version": 1}) == bell
    assert Bell.from_facts({"limit": 4.0}) == Bell(limit=4.0)


class Zeroed(Bell):
    of_zero: ClassVar = True


class Lasting(Bell):
    lasting: ClassVar = True


def test_what_is_remembered_goes_with_what_it_hangs_on() -> None:
    anew, zero = BegunAnew(1.0), NewZero(counted=True)
    others = (CameBack(1.0), RunBegun())
    assert [Bell().after(5, one) for one in (anew, zero, *others)] == [None, 5, 5, 5]
    assert [Zeroed().after(5, one) for one in (anew, zero, *others)] == [None, None, 5, 5]
    assert [Lasting().after(5, one) for one in (anew, zero, *others)] == [5, 5, 5, 5]
