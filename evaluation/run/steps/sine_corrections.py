"""A sine that was corrected while it ran: one step, whose cycles settle until the correction is over.

The run file has the commands to the piston and their times (events of kind ``stroke``, docs/run-file.md).
Without such events nothing was corrected, and a change of the stroke separates steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bufferstand.evaluation.facts import EVENT, Cycle, CycleResult
from bufferstand.foundation.numbers import median

if TYPE_CHECKING:
    from bufferstand.evaluation.gaps import CyclesOfRecord
    from bufferstand.recording.runfile import RunEvent

OVER = 0.85
"""A change goes over within a cycle by half a cosine; after so much of it 5 % are left."""
SAME_SHARE = 0.005
"""Commands that differ by no more than this share of the amplitude are one: what "reached" allows."""
LARGEST_MM, LARGEST_SHARE = 1.0, 0.05
"""A correction changes mean and amplitude by no more than this [mm], the amplitude by no more than this
share. A larger change is no correction, and stays a step."""


@dataclass(frozen=True)
class _Command:
    """What the piston was told, and when [s]; no numbers where that is not known."""

    at_s: float
    mean_mm: float = np.nan
    amplitude_mm: float = np.nan

    def like(self, other: _Command, amplitude_mm: float) -> bool:
        """Say whether it is as good as another one; an unknown one is like none but itself."""
        if self is other:
            return True
        apart_mm = max(abs(self.mean_mm - other.mean_mm), abs(self.amplitude_mm - other.amplitude_mm))
        return apart_mm <= SAME_SHARE * amplitude_mm


@dataclass(frozen=True)
class _Sine:
    """A corrected motion: between which moments [s], and its commands; the first is that of its beginning."""

    from_s: float
    until_s: float
    commands: tuple[_Command, ...]


def settling(results: Sequence[CycleResult], events: Sequence[RunEvent]) -> frozenset[int]:
    """Return the numbers of the cycles in which a sine was not yet what it was corrected to.

    Parameters
    ----------
    results : sequence of CycleResult
        All cycles of a harmonic run, in order of time.
    events : sequence of RunEvent
        Of the run.

    Returns
    -------
    frozenset of int
        Cycles before and during the last correction that a steady cycle follows, unless they have its mean
        and amplitude already. A correction by less than :data:`SAME_SHARE` is as good as none. A cycle that
        is further off than corrections lead is not among them.
    """
    cycles = [result.cycle for result in results if result.cycle.steady]
    return frozenset(number for sine in _corrected(events) for number in _settling(cycles, sine))


def with_settling(found: CyclesOfRecord, events: Sequence[RunEvent]) -> CyclesOfRecord:
    """Return what was found in a run; cycles in which its sine was still being corrected are not steady."""
    numbers = settling(found.results, events) if events else frozenset()
    if not numbers:
        return found
    why = ("the sine was still being corrected to the stroke that was asked for",)
    results = [
        result._replace(cycle=result.cycle._replace(steady=False, why=why))
        if result.cycle.index in numbers
        else result
        for result in found.results
    ]
    return replace(found, results=results)


def _corrected(events: Sequence[RunEvent]) -> list[_Sine]:
    """Return the motions that were corrected: corrections, and what became of the motion behind them."""
    found: list[_Sine] = []
    since_s, changes = -np.inf, []
    for event in events:
        if event.kind != EVENT or event.time_s is None:
            continue
        if (change := _command(event.data, "", event.time_s)) is not None:
            changes.append(change)
        elif "motion" in event.data:
            if changes:
                first = _command(event.data, "commanded_", since_s) or _Command(since_s)
                found.append(_Sine(since_s, event.time_s, (first, *changes)))
            since_s, changes = event.time_s, []
    if changes:  # it was stopped before it could say what it had been told
        found.append(_Sine(since_s, np.inf, (_Command(since_s), *changes)))
    return found


def _command(data: Mapping[str, Any], prefix: str, at_s: float) -> _Command | None:
    mean_mm, amplitude_mm = data.get(f"{prefix}mean_mm"), data.get(f"{prefix}amplitude_mm")
    if not isinstance(mean_mm, int | float) or not isinstance(amplitude_mm, int | float):
        return None
    return _Command(at_s, float(mean_mm), float(amplitude_mm))


def _settling(cycles: Sequence[Cycle], sine: _Sine) -> list[int]:
    """Return the numbers of the cycles of one sine that settle."""
    own = [cycle for cycle in cycles if sine.from_s <= cycle.start_s < sine.until_s]
    if not own:
        return []
    over_s = OVER * median([cycle.duration_s for cycle in own])
    amplitude_mm = median([0.5 * cycle.range_mm for cycle in own])
    begins = [command.at_s for command in sine.commands]
    ends = [*(begin + over_s for begin in begins[1:]), np.inf]  # until then its predecessor is felt
    felt = [
        [n for n, (begin, end) in enumerate(zip(begins, ends, strict=True)) if _meets(cycle, begin, end)]
        for cycle in own
    ]
    even = [all(_alike(sine, n, numbers[-1], amplitude_mm) for n in numbers) for numbers in felt]
    shown = [numbers[-1] for numbers, is_even in zip(felt, even, strict=True) if is_even]
    if not shown:
        return []  # it was changed all the time: nothing shows what it came to
    good = [all(_alike(sine, n, max(shown), amplitude_mm) for n in numbers) for numbers in felt]
    kept = [cycle for cycle, is_good in zip(own, good, strict=True) if is_good]
    within_mm = SAME_SHARE * amplitude_mm
    return [
        cycle.index
        for cycle, is_good, is_even in zip(own, good, even, strict=True)
        if not is_good
        and not (is_even and _is_as_good(cycle, kept, within_mm))
        and _may_come_to(cycle, kept, len(sine.commands) - 1)
    ]


def _alike(sine: _Sine, one: int, other: int, amplitude_mm: float) -> bool:
    return sine.commands[one].like(sine.commands[other], amplitude_mm)


def _meets(cycle: Cycle, begin_s: float, end_s: float) -> bool:
    return cycle.start_s < end_s and cycle.end_s > begin_s


def _is_as_good(cycle: Cycle, kept: Sequence[Cycle], within_mm: float) -> bool:
    """Say whether a cycle has the mean and the amplitude of those that are kept.

    The piston follows a spring that softens as it warms, or a frame, by many small corrections: what the
    specimen does stays the same.
    """
    ends = np.array([(one.stroke_min_mm, one.stroke_max_mm) for one in (*kept, cycle)])
    means, amplitudes = ends.mean(axis=1), 0.5 * np.diff(ends, axis=1)[:, 0]
    apart_mm = abs(means[-1] - np.mean(means[:-1])), abs(amplitudes[-1] - np.mean(amplitudes[:-1]))
    return bool(max(apart_mm) <= within_mm)


def _may_come_to(cycle: Cycle, kept: Sequence[Cycle], corrections: int) -> bool:
    """Say whether so many corrections can have made the kept cycles of this one."""
    ends = np.array([(one.stroke_min_mm, one.stroke_max_mm) for one in (*kept, cycle)])
    means, amplitudes = ends.mean(axis=1), 0.5 * np.diff(ends, axis=1)[:, 0]
    amplitude_mm = float(np.mean(amplitudes[:-1]))
    by_mm = corrections * min(LARGEST_MM, LARGEST_SHARE * amplitude_mm)
    return bool(
        abs(means[-1] - np.mean(means[:-1])) <= corrections * LARGEST_MM
        and abs(amplitudes[-1] - amplitude_mm) <= by_mm
    )
