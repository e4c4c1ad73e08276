"""Where a motion is expected to turn, with which forces, and how these change while it goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, astuple, dataclass
from typing import Any

USUAL_CYCLE = 4
"""By then most of what settles in a sine has settled."""

LEAST_KN = 1.0
"""Of less force than this no ratio is taken [kN]."""


@dataclass(frozen=True)
class ExpectedTurns:
    """Where a motion is expected to turn, or to end.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Lowest and highest stroke of the specimen.
    lower_kN, upper_kN : float
        The forces there, of the settled loop where it is a sine.
    piston_lower_mm, piston_upper_mm : float
        The piston's positions there: further by what the machine gives way.
    """

    lower_mm: float
    upper_mm: float
    lower_kN: float
    upper_kN: float
    piston_lower_mm: float
    piston_upper_mm: float


@dataclass(frozen=True)
class TurnChanges:
    """How turns change with temperature and from cycle to cycle.

    Parameters
    ----------
    begin_C : float
        Temperature of the specimen's mass for which the turns are stated [°C].
    warmer_C : float
        Another temperature …
    warmer : Turns
        … and the turns there: forces are linear in between and beyond (paper, eq. (5)).
    first : tuple of Turns
        Of each of the first cycles of a sine, at ``begin_C``: it still settles, so that the piston's turns
        are met at other strokes and forces.
    top_kN_per_mm : float or None
        By how much the force at a sine's upper turn changes with the stroke there; None for other motions.
    """

    begin_C: float
    warmer_C: float
    warmer: ExpectedTurns
    first: tuple[ExpectedTurns, ...] = ()
    top_kN_per_mm: float | None = None


@dataclass(frozen=True)
class MotionEstimate:
    """What is expected of one motion: duration, heat, the specimen's temperature at its end, and its turns.

    ``turns`` are at the temperature with which it begins; None for a motion that compresses nothing.
    ``cycle_C`` are temperatures of the mass at even steps of a sine's full cycles [°C]. These and ``changes``
    serve the running campaign alone; they are no part of :meth:`as_dict`.
    """

    duration_s: float
    heat_J: float
    end_temperature_C: float
    turns: ExpectedTurns | None = None
    cycle_C: tuple[float, ...] = ()
    changes: TurnChanges | None = None

    def turns_at(self, share: float, warmer_K: float = 0.0) -> ExpectedTurns | None:
        """Return the turns of the settled loop while the motion goes on.

        Parameters
        ----------
        share : float
            Of its cycles that is done, 0 to 1.
        warmer_K : float
            By how much the specimen was warmer at the beginning than was planned [K].
        """
        changes = self.changes
        if self.turns is None or changes is None:
            return self.turns
        now_C = _at_share(self.cycle_C or (changes.begin_C,), share) + warmer_K
        part = (now_C - changes.begin_C) / (changes.warmer_C - changes.begin_C)
        pairs = zip(astuple(self.turns), astuple(changes.warmer), strict=True)
        return ExpectedTurns(*(max(0.0, cold + part * (warm - cold)) for cold, warm in pairs))

    def turns_of_cycle(self, cycle: int, cycles: int, warmer_K: float = 0.0) -> ExpectedTurns | None:
        """Return the turns of one cycle of a sine, which has not settled yet in the first ones.

        Parameters
        ----------
        cycle, cycles : int
            Its number, from 1, and how many there are.
        warmer_K : float
            As of :meth:`turns_at`.
        """
        turns = self.turns_at((cycle - 0.5) / max(cycles, 1), warmer_K)
        if turns is None or self.turns is None or self.changes is None or not self.changes.first:
            return turns
        first = self.changes.first[min(max(cycle, 1), len(self.changes.first)) - 1]
        return ExpectedTurns(
            turns.lower_mm + first.lower_mm - self.turns.lower_mm,
            turns.upper_mm + first.upper_mm - self.turns.upper_mm,
            turns.lower_kN * _ratio(first.lower_kN, self.turns.lower_kN),
            turns.upper_kN * _ratio(first.upper_kN, self.turns.upper_kN),
            turns.piston_lower_mm,
            turns.piston_upper_mm,
        )

    def usual_turns(self, cycles: int, warmer_K: float = 0.0) -> ExpectedTurns | None:
        """Return the turns by which a sine is commanded: those of its middle cycle, or of an early one.

        A sine of a few cycles never settles, and one of many is corrected, where it can be, as it warms.
        """
        return self.turns_of_cycle(min((cycles + 1) // 2, USUAL_CYCLE), cycles, warmer_K)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data, without what serves the running campaign alone."""
        content = asdict(self)
        del content["cycle_C"], content["changes"]
        return content


def _ratio(one_kN: float, other_kN: float) -> float:
    """Return a ratio of forces; 1 where there is next to none."""
    return one_kN / other_kN if min(one_kN, other_kN) >= LEAST_KN else 1.0


def _at_share(values: Sequence[float], share: float) -> float:
    """Return where a series of even steps is at a share of its length."""
    place = min(max(share, 0.0), 1.0) * (len(values) - 1)
    low = min(int(place), max(0, len(values) - 2))
    high = min(low + 1, len(values) - 1)
    return values[low] + (place - low) * (values[high] - values[low])
