"""When a run of cycles counts as having left the model, and what has moved then."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from bufferstand.model.twin.fault_kinds import FAULT_KINDS, FaultKind
from bufferstand.model.twin.judging import CycleJudgement

Floats = NDArray[np.float64]

TAIL = 1e-6
"""One-sided probability that what lasts from cycle to cycle passes the dead zone, for one kind of fault."""
LEAST_NOISE = 0.25
"""The noise of a cycle counts as this share of what lasts at least: cycles of one step differ by more than
the noise of their nodes."""
REFERENCE, MOST, LIMIT = 1.0, 4.0, 9.0
"""Of the CUSUM, in standard deviations of the noise: what is taken off each cycle, the most that a cycle
counts, and where the alarm is given. So three cycles in a row at least."""
ONSET_KEPT = 8
LEAVES = 2.0
"""A kind of fault may be the cause if what it leaves is within so many times what the model misses …"""
NEARLY = 1.25
"""… or within so many times what the best one leaves."""


@dataclass(frozen=True)
class Moved:
    """A kind of fault that would explain the cycles, and how large it is.

    Attributes
    ----------
    kind : FaultKind
    change : float
        In the kind's own unit, or as a share.
    standard_uncertainty : float
    left_kN : float
        Root mean square of the residuals that it leaves.
    """

    kind: FaultKind
    change: float
    standard_uncertainty: float
    left_kN: float


@dataclass(frozen=True)
class TwinAlarm:
    """A run of cycles that left the model.

    Attributes
    ----------
    run : str
    since_cycle, cycle : int
        Where it began, and the cycle that made it an alarm: numbers from 1 of all cycles judged.
    since_s, at_s : float
        Begin of the first of these, and end of the last.
    moved : tuple of Moved
        What would explain it, the best first. More than one: force and stroke do not tell which.
    explained : bool
        Whether the first explains it within what the model misses; else more than one thing has moved.
    """

    run: str
    since_cycle: int
    cycle: int
    since_s: float
    at_s: float
    moved: tuple[Moved, ...]
    explained: bool

    @property
    def sentence(self) -> str:
        """The alarm in words."""
        count = self.cycle - self.since_cycle + 1
        said = ", or ".join(_said(one) for one in self.moved)
        text = (
            f"{count} cycles in a row (since cycle {self.since_cycle}) lie outside the model's band: {said}"
        )
        if not self.explained:
            text += "; none of these alone explains it"
        return text


def _said(one: Moved) -> str:
    kind, half = one.kind, one.kind.shown(2.0 * one.standard_uncertainty).removeprefix("+")
    text = f"{kind.title} {kind.shown(one.change)} ± {half}"
    return f"{text} ({kind.note})" if kind.note else text


class Chart:
    """Two-sided cumulative sums of every kind of fault over the cycles.

    Parameters
    ----------
    held_out_cycles : int
        From so many cycles it is known what the model misses.
    """

    def __init__(self, held_out_cycles: int) -> None:
        self._dead = dead_zone(held_out_cycles)
        self._sums = np.zeros((2, len(FAULT_KINDS)))
        self._count = 0
        self._began = np.ones((2, len(FAULT_KINDS)), dtype=np.intp)
        self._kept: deque[tuple[int, CycleJudgement]] = deque(maxlen=ONSET_KEPT)
        self._told: frozenset[str] = frozenset()

    @property
    def cycles(self) -> int:
        """Number of cycles that were judged."""
        return self._count

    def take(self, judged: CycleJudgement) -> TwinAlarm | None:
        """Take the next cycle; return an alarm if it says something that was not said before.

        Of several things that may have moved, later cycles can leave fewer; then that is said.
        """
        self._count += 1
        rest = self._sums <= 0.0
        self._began[rest] = self._count
        self._sums = stepped(
            self._sums, increments(judged.alone, judged.alone_noise, judged.alone_u, self._dead)
        )
        if not np.any(self._sums > 0.0):
            self._kept.clear()
            return None
        self._kept.append((self._count, judged))
        if not np.any(self._sums >= LIMIT):
            return None
        began = int(np.min(self._began[self._sums >= LIMIT]))
        self._sums[:] = 0.0
        cycles = [one for number, one in self._kept if number >= began]
        first = next(one for number, one in self._kept if number >= began)
        moved, explained = explain(cycles)
        names = frozenset(one.kind.name for one in moved)
        if self._told and self._told <= names:
            return None  # no more is known than was said
        self._told = names & self._told or names
        moved = tuple(one for one in moved if one.kind.name in self._told)
        return TwinAlarm(
            judged.cycle.run, began, self._count, first.cycle.start_s, judged.cycle.end_s, moved, explained
        )


def dead_zone(held_out_cycles: int) -> float:
    """Return how many standard uncertainties of what lasts say nothing: Student's t at :data:`TAIL`."""
    return float(student.ppf(1.0 - TAIL, max(held_out_cycles, 1)))


def increments(alone: Floats, noise: Floats, u: Floats, dead: float) -> Floats:
    """Return by how much cycles move the sums, upwards and downwards, shape (2, …)."""
    unit = np.hypot(noise, LEAST_NOISE * u)
    beyond = np.stack([alone, -alone]) - dead * u
    return np.asarray(np.minimum(beyond / unit, MOST) - REFERENCE)


def stepped(sums: Floats, by: Floats) -> Floats:
    """Return the next sums: never below 0."""
    return np.asarray(np.maximum(sums + by, 0.0))


def explain(cycles: Sequence[CycleJudgement]) -> tuple[tuple[Moved, ...], bool]:
    """Return which single faults explain some cycles, the best first, and whether the best does so fully.

    Parameters
    ----------
    cycles : sequence of CycleJudgement
        Not empty; those of the run that left the model.
    """
    residual = np.concatenate([one.cycle.residual_kN for one in cycles])
    traces = np.concatenate([one.cycle.sensitivity for one in cycles])
    square = np.maximum(np.sum(traces**2, axis=0), 1e-12)
    change = traces.T @ residual / square
    left = np.sqrt(np.mean((residual[:, None] - traces * change) ** 2, axis=0))
    missed = float(np.mean([one.missed_kN for one in cycles]))
    noise = float(np.sqrt(np.mean([np.mean(one.cycle.sigma_kN**2) for one in cycles])))
    usual = LEAVES * float(np.hypot(missed, noise))
    best = float(left.min())
    u = np.mean([np.hypot(one.alone_u, one.alone_noise / np.sqrt(len(cycles))) for one in cycles], axis=0)
    order = [int(k) for k in np.argsort(left) if left[k] <= max(usual, NEARLY * best)]
    moved = tuple(Moved(FAULT_KINDS[k], float(change[k]), float(u[k]), float(left[k])) for k in order)
    return moved, best <= usual
