"""A run as evaluation sees it: one time base, stroke and force sampled together, and each defect of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foundation.errors import BadInput

FloatArray = NDArray[np.float64]

DefectKind = Literal["gap", "lost", "repeated-time", "backward-time", "nan"]

_GAP_STEPS = 1.5
"""A step longer than this many usual steps is a gap (a missing sample makes 2)."""
_CHUNK = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""


@dataclass(frozen=True)
class Defect:
    """One place where the record must not be integrated across: from ``start_s`` to ``end_s``."""

    kind: DefectKind
    start_s: float
    end_s: float
    text: str


@dataclass(frozen=True, eq=False)
class Temperature:
    """A temperature channel on its own time base: ``time_s`` (N,), ``temperature_C`` (N,)."""

    name: str
    time_s: FloatArray
    temperature_C: FloatArray
    role: Literal["specimen", "ambient"] = "specimen"
    place: str = ""
    accuracy_C: float | None = None
    """Limit of the sensor's error, where it is known."""


@dataclass(frozen=True, eq=False)
class Record:
    """Stroke and force of a run at common instants, strictly rising in time.

    Attributes
    ----------
    time_s, stroke_mm, force_kN : arrays, shape (N,)
        Seconds since the run's start; compression positive, stroke 0 is first contact.
    speed_mm_per_s : array, shape (N,), or None
        A measured speed channel, when the record has one.
    temperatures : tuple of Temperature
    breaks : tuple of int
        Index i: nothing may be integrated between sample i-1 and sample i.
    defects : tuple of Defect
        What caused the breaks, in order of time.
    wire_difference_mm : array, shape (N,), or None
        stroke_1 - stroke_2, where the stroke is the mean of two draw wires.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    speed_mm_per_s: FloatArray | None = None
    temperatures: tuple[Temperature, ...] = ()
    breaks: tuple[int, ...] = ()
    defects: tuple[Defect, ...] = ()
    wire_difference_mm: FloatArray | None = None

    def has_break(self, first: int, last: int) -> bool:
        """Say whether a break lies between sample ``first`` and sample ``last`` (both included)."""
        after = bisect_right(self.breaks, first)
        return after < len(self.breaks) and self.breaks[after] <= last


def describe(defects: Sequence[Defect], most: int = 3) -> str:
    """Return the first few defects in words, and how many more there are."""
    named = ", ".join(defect.text for defect in defects[:most])
    more = len(defects) - most
    return f"{named} and {more} more" if more > 0 else named


def usual_step_s(time_s: FloatArray) -> float:
    """Return the largest step between samples that is still usual in this record [s].

    The step itself for an even sampling; for an uneven one, five times the step that 98 % stay below.
    """
    return _usual_step_s(time_s, *_step_limits(time_s))


def _usual_step_s(time_s: FloatArray, shortest_s: float, longest_s: float) -> float:
    if 0.0 < longest_s <= 1.2 * shortest_s:  # even: no need to sort millions of steps
        return _GAP_STEPS * float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    step = np.diff(time_s)
    step = step[step > 0.0]
    if step.size == 0:
        return float("inf")
    median, high = np.quantile(step, [0.5, 0.98])
    return float(_GAP_STEPS * median if high <= 1.2 * median else 5.0 * high)


def _step_limits(time_s: FloatArray) -> tuple[float, float]:
    """Return the shortest and the longest step between samples [s]; NaN where a time is none."""
    shortest, longest = [np.inf], [-np.inf]
    for first in range(0, time_s.size - 1, _CHUNK):
        step = np.diff(time_s[first : first + _CHUNK + 1])
        shortest.append(float(np.min(step)))
        longest.append(float(np.max(step)))
    return float(np.min(shortest)), float(np.max(longest))


def _as_column(name: str, values: ArrayLike, size: int | None) -> FloatArray:
    column = np.asarray(values, dtype=np.float64)
    if column.ndim != 1:
        raise BadInput(f"{name} must be one column of numbers, got shape {column.shape}", place=name)
    if size is not None and column.size != size:
        raise BadInput(f"{name} has {column.size} samples, time has {size}", place=name)
    return column


def make_record(
    time_s: ArrayLike,
    stroke_mm: ArrayLike,
    force_kN: ArrayLike,
    *,
    speed_mm_per_s: ArrayLike | None = None,
    wire_difference_mm: ArrayLike | None = None,
    temperatures: Iterable[Temperature] = (),
    lost_before: Sequence[tuple[int, int]] = (),
) -> Record:
    """Clean raw columns into a record: defective samples leave, and each leaves a break and a defect behind.

    Parameters
    ----------
    time_s, stroke_mm, force_kN : array_like, shape (N,)
        Time [s] as recorded (may repeat, step back, hold NaN). Arrays of floats are not copied: they
        belong to the record from now on.
    speed_mm_per_s : array_like, shape (N,), optional
    wire_difference_mm : array_like, shape (N,), optional
        stroke_1 - stroke_2, where the stroke is the mean of two draw wires.
    temperatures : iterable of Temperature
    lost_before : sequence of (index, samples)
        Interruptions that the recording knows of itself: ``samples`` are missing before sample ``index``
        (0: it does not know how many).

    Returns
    -------
    Record

    Raises
    ------
    BadInput
        If a column has another length or fewer than two samples are usable.
    """
    time = _as_column("time_s", time_s, None)
    stroke = _as_column("stroke_mm", stroke_mm, time.size)
    force = _as_column("force_kN", force_kN, time.size)
    speed = None if speed_mm_per_s is None else _as_column("speed_mm_per_s", speed_mm_per_s, time.size)
    difference = None
    if wire_difference_mm is not None:
        difference = _as_column("wire_difference_mm", wire_difference_mm, time.size)

    kept: NDArray[np.intp] | slice = slice(None)
    defects: list[Defect] = []
    break_at: list[int] = []
    shortest_s, longest_s = _step_limits(time)
    if not (shortest_s > 0.0 and _is_finite(time, stroke, force)):
        kept, defects, break_at = _kept(time, stroke, force)
        shortest_s, longest_s = _step_limits(time[kept])
    time_kept = time[kept]
    limit_s = _usual_step_s(time_kept, shortest_s, longest_s)
    known = set(break_at)
    steps = _longer_steps(time_kept, limit_s) if longest_s > limit_s else set()
    for raw_index, samples in lost_before:
        at = raw_index if isinstance(kept, slice) else int(np.searchsorted(kept, raw_index))
        if 0 < at < time_kept.size and (samples > 0 or at not in known | steps):
            a, b = float(time_kept[at - 1]), float(time_kept[at])
            what = f"{samples} samples lost" if samples > 0 else "interruption"
            defects.append(Defect("lost", a, b, f"{what} after {a:.6g} s"))
            known.add(at)
    for at in sorted(steps - known):
        a, b = float(time_kept[at - 1]), float(time_kept[at])
        defects.append(Defect("gap", a, b, f"gap of {b - a:.4g} s after {a:.6g} s"))
    known |= steps
    inner = sorted(at for at in known if 0 < at < time_kept.size)
    return Record(
        time_s=time_kept,
        stroke_mm=stroke[kept],
        force_kN=force[kept],
        speed_mm_per_s=None if speed is None else speed[kept],
        temperatures=tuple(temperatures),
        breaks=tuple(inner),
        defects=tuple(sorted(defects, key=lambda d: d.start_s)),
        wire_difference_mm=None if difference is None else difference[kept],
    )


def _is_finite(time: FloatArray, stroke: FloatArray, force: FloatArray) -> bool:
    """Say whether every sample is usable where time rises strictly: the usual case, told in a few passes."""
    if time.size < 2:
        return False
    # Strictly rising says that no time inside is NaN; a sum is finite only if all its terms are.
    ends = bool(np.isfinite(time[0]) and np.isfinite(time[-1]))
    return ends and bool(np.isfinite(np.sum(stroke)) and np.isfinite(np.sum(force)))


def _longer_steps(time: FloatArray, limit_s: float) -> set[int]:
    """Return the samples that follow a step longer than a limit."""
    found: set[int] = set()
    for first in range(0, time.size - 1, _CHUNK):
        step = np.diff(time[first : first + _CHUNK + 1])
        if np.max(step) > limit_s:
            found.update(int(i) + first + 1 for i in np.flatnonzero(step > limit_s))
    return found


def _kept(
    time: FloatArray, stroke: FloatArray, force: FloatArray
) -> tuple[NDArray[np.intp], list[Defect], list[int]]:
    """Return the usable samples, the defects that the others are, and the breaks they leave."""
    finite = np.isfinite(time) & np.isfinite(stroke) & np.isfinite(force)
    latest = np.maximum.accumulate(np.where(np.isfinite(time), time, -np.inf))
    before = np.concatenate(([-np.inf], latest[:-1]))
    rising = np.where(np.isfinite(time), time, np.inf) > before
    keep = finite & rising
    if np.count_nonzero(keep) < 2:
        raise BadInput(
            "fewer than two usable samples in the record", remedy="check the time and stroke columns"
        )
    kept_index = np.flatnonzero(keep)
    defects = _dropped(time, before, finite, keep, kept_index)
    return kept_index, defects, [int(np.searchsorted(kept_index, i)) for i in np.flatnonzero(~keep)]


def _dropped(
    time: FloatArray,
    latest_before: FloatArray,
    finite: NDArray[np.bool_],
    keep: NDArray[np.bool_],
    kept_index: NDArray[np.intp],
) -> list[Defect]:
    """Return one defect for each run of neighbouring samples that were dropped for the same reason."""
    dropped = np.flatnonzero(~keep)
    if dropped.size == 0:
        return []
    reason = np.where(~finite[dropped], 0, np.where(time[dropped] == latest_before[dropped], 1, 2))
    names: tuple[DefectKind, ...] = ("nan", "repeated-time", "backward-time")
    texts = ("no number (NaN)", "repeated time stamp", "backward time stamp")
    cuts = np.flatnonzero((np.diff(dropped) > 1) | (np.diff(reason) != 0)) + 1
    defects = []
    for group in np.split(np.arange(dropped.size), cuts):
        first, last, why = int(dropped[group[0]]), int(dropped[group[-1]]), int(reason[group[0]])
        after = int(np.searchsorted(kept_index, last))
        prior = int(np.searchsorted(kept_index, first)) - 1
        start = float(time[kept_index[max(prior, 0)]])
        end = float(time[kept_index[min(after, kept_index.size - 1)]])
        samples = last - first + 1
        what = texts[why] + (f" in {samples} samples" if samples > 1 else "")
        defects.append(Defect(names[why], start, end, f"{what} at {start:.6g} s"))
    return defects
