"""Which step next: the one that brings the goal nearer by most for a minute of stand time, and again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification import NAMES
from bufferstand.model.next_step.knowledge import Effect, Knowledge
from bufferstand.model.next_step.pieces import Candidate, Piece, Rest

Floats = NDArray[np.float64]

LEAST_GAIN = 0.005
"""A step that brings the goal nearer by less than half a per cent brings nothing."""


class Goal(Protocol):
    """What is to be known."""

    def lack(self, knowledge: Knowledge) -> float:
        """Return how much is lacking, as a logarithm of widths; 0 or less when it is reached."""
        ...

    @property
    def has_end(self) -> bool:
        """Whether it can be reached."""
        ...


@dataclass(frozen=True)
class EveryParameter:
    """All of the spring's entries as well as may be: half the logarithm of the determinant (D-optimal)."""

    has_end: bool = False

    def lack(self, knowledge: Knowledge) -> float:
        """Return the logarithm of the volume of what is possible, in plausible ranges."""
        return 0.5 * float(np.linalg.slogdet(knowledge.of_spring)[1])


@dataclass(frozen=True)
class Intervals:
    """Every parameter named to a standard deviation: the sum of what each lacks.

    Attributes
    ----------
    deviations : dict
        By name of a law, of its logarithm where the fit takes that.
    curve : float
        Of the curves' entries, root mean square, in their plausible ranges; 0 where none is asked for.
    """

    deviations: dict[str, float]
    curve: float = 0.0
    has_end: bool = True

    def lack(self, knowledge: Knowledge) -> float:
        """Return the sum of the logarithms of too wide a deviation over what is asked for."""
        lacking = [
            math.log(max(knowledge.deviation(name) / asked, 1.0)) for name, asked in self.deviations.items()
        ]
        if self.curve > 0.0:
            lacking.append(math.log(max(curve_deviation(knowledge) / self.curve, 1.0)))
        return sum(lacking)


def curve_deviation(knowledge: Knowledge) -> float:
    """Return the root mean square deviation of the curves' entries, in their plausible ranges."""
    points = 2 * knowledge.spring.frame.points
    return math.sqrt(float(np.mean(np.diag(knowledge.covariance)[:points])))


@dataclass(frozen=True, eq=False)
class Figure:
    """One figure of the spring to a standard deviation (c-optimal)."""

    gradient: Floats
    deviation: float
    has_end: bool = True

    def lack(self, knowledge: Knowledge) -> float:
        """Return the logarithm of the deviation over what is asked for."""
        return math.log(max(knowledge.deviation_of(self.gradient), 1e-300) / self.deviation)


@dataclass(frozen=True, eq=False)
class ChosenStep:
    """A step, and what is known before and after it."""

    candidate: Candidate
    minutes: float
    before: Knowledge
    after: Knowledge

    def told(self, most: int = 2) -> tuple[tuple[str, float, float], ...]:
        """Return the parameters it narrows most: name, standard deviation before and after."""
        rows = [(name, self.before.deviation(name), self.after.deviation(name)) for name in NAMES]
        rows.sort(key=lambda row: row[2] / row[1])
        return tuple(row for row in rows[:most] if row[2] < 0.95 * row[1])


@dataclass(frozen=True, eq=False)
class Choice:
    """The steps that were chosen, and why there are no more.

    Attributes
    ----------
    steps : tuple of ChosenStep
    end : str
        ``reached``; ``nothing-more``: no admissible step brings the goal nearer; ``time``; ``steps``.
    last : Knowledge
    """

    steps: tuple[ChosenStep, ...]
    end: str
    last: Knowledge

    @property
    def minutes(self) -> float:
        """Stand time of all [min]."""
        return sum(step.minutes for step in self.steps)


def choose(
    knowledge: Knowledge,
    candidates: Sequence[Candidate],
    effects: Mapping[Piece, Effect],
    goal: Goal,
    *,
    warmest_C: float,
    most_minutes: float,
    most_steps: int,
) -> Choice:
    """Choose steps one after another.

    Parameters
    ----------
    knowledge : Knowledge
        Before the first.
    candidates : sequence of tuple of Piece
        Those that the stand may do.
    effects : mapping
        Of every piece in them.
    goal : Goal
    warmest_C : float
        No step may warm the specimen beyond this [°C].
    most_minutes : float
        Of stand time, rests included [min].
    most_steps : int
    """
    found: list[ChosenStep] = []
    left = most_minutes
    while True:
        lack = goal.lack(knowledge)
        if goal.has_end and lack <= 0.0:
            return Choice(tuple(found), "reached", knowledge)
        if len(found) == most_steps:
            return Choice(tuple(found), "steps", knowledge)
        best, short = _best(knowledge, candidates, effects, goal, lack, warmest_C, left)
        if best is None:
            return Choice(tuple(found), "time" if short else "nothing-more", knowledge)
        found.append(best)
        knowledge, left = best.after, left - best.minutes


def _best(
    knowledge: Knowledge,
    candidates: Sequence[Candidate],
    effects: Mapping[Piece, Effect],
    goal: Goal,
    lack: float,
    warmest_C: float,
    left: float,
) -> tuple[ChosenStep | None, bool]:
    """Return the step with the largest gain a minute, and whether time alone kept one out."""
    best, most, short = None, 0.0, False
    for candidate in candidates:
        if (after := _after(knowledge, candidate, effects, warmest_C)) is None:
            continue
        minutes = sum(effects[piece].duration_s for piece in candidate) / 60.0
        gain = lack - goal.lack(after)
        if goal.has_end:
            gain = min(gain, lack)  # beyond what is asked for nothing counts
        if gain < LEAST_GAIN:
            continue
        if minutes > left:
            short = True
        elif gain / minutes > most:
            best, most = ChosenStep(candidate, minutes, knowledge, after), gain / minutes
    return best, short


def _after(
    knowledge: Knowledge, candidate: Candidate, effects: Mapping[Piece, Effect], warmest_C: float
) -> Knowledge | None:
    """Return what is known after all pieces of a candidate; None if the specimen becomes too warm."""
    for piece in candidate:
        effect = effects[piece]
        resting = isinstance(piece, Rest)  # whatever it is too warm from
        warmth = effect.warmth(knowledge.temperature_C, knowledge.sensor_C)
        if not resting and effect.highest_C(warmth) > warmest_C:
            return None
        knowledge = knowledge.after(effect)
    return knowledge
