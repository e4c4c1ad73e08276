"""What a guard is: data that looks at what comes in, says its trips and its margin, and is in the run file.

A kind of guard is a subclass of :class:`Guard` in a module of ``kinds/``, or in a package
that names it under the entry points ``bufferstand.guards`` (:mod:`bufferstand.daq.guards.catalogue`).
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from inspect import getattr_static
from typing import Any, ClassVar, Generic, Literal, Protocol, Self, TypeVar

from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import BegunAnew, Happening, NewZero, Phase, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.foundation.settings import Settings

MemoryT = TypeVar("MemoryT")
GuardT = TypeVar("GuardT", bound="Guard[Any]")
Found = Trip | Sequence[Trip] | None
"""What a look has found."""


class Beside(Protocol):
    """What a guard may ask beside what it looks at."""

    @property
    def at_s(self) -> float:
        """Host stand time of what is looked at [s]."""
        ...

    @property
    def wall_s(self) -> float:
        """Time of the wall [s]."""
        ...

    @property
    def cut_off(self) -> bool:
        """Whether an outage is being ridden out, which has its own end."""
        ...

    @property
    def ambient_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Temperature of the air [°C]."""
        ...

    def latest_temperatures(self) -> Mapping[str, float]:
        """Return the last true reading of every thermometer that gave one [°C]."""
        ...

    def guard(self, kind: type[GuardT]) -> GuardT | None:
        """Return the guard of a kind that is in force, None without one."""
        ...


class Guard(ABC, Generic[MemoryT]):
    """A guard as data; what it must remember from look to look is handed to it and returned by it.

    A kind states the class variables, and defines every abstract method and, unless it stands in every set,
    ``made_for``; one that leaves out any of them fails when its module is imported, by name.

    Attributes
    ----------
    kind : str
        Its name in the run file (``limits.guards``), and of its table ``[guards.KIND]``.
    title : str
        What it watches, in a few words.
    settings : type or tuple of str
        The schema of its own table, or the keys of the campaign file that set it; empty: nothing does.
    facts_as : str
        How the run file holds it: a ``list``, ``one`` (null without one), or ``none`` where nothing of it can
        be set.
    looks_at : tuple of type
        The sights that it is asked for (:mod:`bufferstand.daq.guards.sights`).
    docs : tuple of str
        First cells of its rows in docs/guards-and-safe-stop.md, for those of ``kinds/``.
    turn : int
        Guards look in this order; what must not depend on others keeps the default.
    standing : bool
        Whether it is in every set of guards, with its defaults where nobody states others.
    in_journal : bool
        Whether samples and readings are all that it looks at: it can look at a journal, too.
    remembers : callable
        What it remembers when it begins to look, where no time belongs to that.
    of_zero, lasting : bool
        Whether that is forgotten with the zero in force, and whether it stays when all else begins anew.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    settings: ClassVar[type[Settings] | tuple[str, ...]]
    facts_as: ClassVar[Literal["list", "one", "none"]]
    looks_at: ClassVar[tuple[type[Sight], ...]]
    docs: ClassVar[tuple[str, ...]] = ()
    turn: ClassVar[int] = 1000
    standing: ClassVar[bool] = False
    in_journal: ClassVar[bool] = True
    remembers: ClassVar[Callable[[], Any]] = type(None)
    of_zero: ClassVar[bool] = False
    lasting: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        """Refuse a kind that leaves something out."""
        super().__init_subclass__()
        made = () if cls.standing else ("made_for",)
        for name in (*_STATED, *_DEFINED, *made):
            if getattr_static(cls, name, None) is getattr_static(Guard, name, None):
                raise TypeError(f"guard {cls.__module__}.{cls.__qualname__} does not state its {name}")

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return the guards of this kind that a stand and a campaign need; none where they need none."""
        return ()

    @property
    def key(self) -> str:
        """Return what tells it from the others of its kind, empty where there is one only."""
        return ""

    def begin(self, wall_s: float) -> MemoryT:
        """Return what it remembers when it begins to look [s of the wall]."""
        memory: MemoryT = type(self).remembers()
        return memory

    @abstractmethod
    def look(self, memory: MemoryT, sight: Sight, beside: Beside) -> tuple[MemoryT, Found]:
        """Look at what came in; return what to remember, and the trips.

        Parameters
        ----------
        memory
            Of the look before.
        sight : Samples, Judged, Complaint, Snapshot, Recorded, PassOver or MotionOver
            What came; of a stream that is not its own, a guard returns its memory as it is.
        beside : Beside
            Time, and what others know.
        """

    @abstractmethod
    def margin(self, memory: MemoryT, beside: Beside) -> Margin:
        """Return how far it is from its trip."""

    def facts(self) -> Any:
        """Return it as data for the run file, actions by name."""
        content = json.loads(json.dumps(asdict(self)))  # type: ignore[call-overload]
        return content | {name: Action(content[name]).name.lower() for name in _ACTIONS & content.keys()}

    @classmethod
    def from_facts(cls, facts: Any) -> Self:
        """Return it from its data in a run file; what is not known of it is left out."""
        names = {one.name for one in fields(cls)}  # type: ignore[arg-type]
        content = {name: value for name, value in facts.items() if name in names}
        return cls(**content | {name: Action[content[name].upper()] for name in _ACTIONS & content.keys()})

    def during(self, phase: Phase) -> Self | None:
        """Return it as it is in a phase, None where it does not look then."""
        return self

    def after(self, memory: MemoryT, happening: Happening) -> MemoryT | None:
        """Return what it remembers after something has happened, None to begin with its first one."""
        forgotten = isinstance(happening, BegunAnew) and not self.lasting
        return None if forgotten or (self.of_zero and isinstance(happening, NewZero)) else memory

    def explained(self, memory: MemoryT, trip: Trip, beside: Beside) -> Trip:
        """Return the trip of a guard that believed its signal, with what this one knows against that."""
        return trip

    def is_unsure(self, memory: MemoryT) -> bool:
        """Return whether it has begun to doubt, and will know from what comes next."""
        return False


_STATED = ("kind", "title", "settings", "facts_as", "looks_at")
_DEFINED = ("look", "margin")
_ACTIONS = {"action", "silence_action"}
