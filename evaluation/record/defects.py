"""Finds the defective samples of a record, removes them, and marks the gap that each leaves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation.numbers import quantile

DefectKind = Literal["gap", "lost", "repeated-time", "backward-time", "nan", "doubled", "spike"]

UNKNOWN = -1
"""As number of samples lost: of an interruption of which not even the length is known."""
_GAP_STEPS = 1.5
"""A step longer than this many usual steps is a gap (a missing sample makes 2)."""
_EVEN = 1.2
"""Steps that differ by no more than this are those of an even sampling."""
_UNEVEN_STEPS = 5.0
USUAL_SHARES = (0.5, 0.98)
"""Shares of the steps by which sampling is judged: the median, and what 98 % stay below."""
_CHUNK = 65_536
"""Samples that are looked at together: what is made of them stays in the processor's cache."""
_KINDS: tuple[DefectKind, ...] = ("nan", "repeated-time", "backward-time")
_TEXTS = ("no number (NaN)", "repeated time stamp", "backward time stamp")


@dataclass(frozen=True)
class Defect:
    """One place, from ``start_s`` to ``end_s``, where something is not on record.

    ``samples`` left there (0: it is a step of time). ``doubled`` rows, which repeat others, hide nothing.
    ``unknown``: how long it lasted is not known.
    """

    kind: DefectKind
    start_s: float
    end_s: float
    text: str
    samples: int = 0
    unknown: bool = False


def gap(start_s: float, end_s: float) -> Defect:
    """Return a step of time that is longer than those around it."""
    return Defect("gap", start_s, end_s, f"gap of {end_s - start_s:.4g} s after {start_s:.6g} s")


def _lost(start_s: float, end_s: float, samples: int) -> Defect:
    """Return an interruption that the recording knows of: how many samples, 0: it does not know how many."""
    if samples == UNKNOWN:
        return Defect("lost", start_s, end_s, f"clock set back after {start_s:.6g} s", unknown=True)
    lost = "1 sample lost" if samples == 1 else f"{samples} samples lost"
    what = lost if samples > 0 else "interruption"
    return Defect("lost", start_s, end_s, f"{what} after {start_s:.6g} s")


def describe(defects: Sequence[Defect], most: int = 3) -> str:
    """Return the first few defects in words, and how many more there are."""
    named = ", ".join(defect.text for defect in defects[:most])
    more = len(defects) - most
    return f"{named} and {more} more" if more > 0 else named


@dataclass(eq=False)
class _Dropped:
    """Neighbouring samples that leave for one reason; None: the one kept before or after is yet to come."""

    reason: int
    samples: int
    start_s: float | None
    end_s: float | None = None

    def defect(self, first_kept_s: float, last_kept_s: float) -> Defect:
        start = first_kept_s if self.start_s is None else self.start_s
        end = last_kept_s if self.end_s is None else self.end_s
        what = _TEXTS[self.reason] + (f" in {self.samples} samples" if self.samples > 1 else "")
        return Defect(_KINDS[self.reason], start, end, f"{what} at {start:.6g} s", self.samples)


class Cleaner:
    """Takes a record piece by piece and says which samples stay; pieces of any length give the same.

    Parameters
    ----------
    longest_usual_step_s : float, optional
        A longer step is a gap. None: by the piece itself, which is the whole record then.
    """

    def __init__(self, longest_usual_step_s: float | None = None) -> None:
        self._limit_s = longest_usual_step_s
        self.kept = 0
        """Samples that stayed so far."""
        self.even = True
        """Whether all steps between them are alike."""
        self._latest_s = -np.inf
        self._first_kept_s = self._last_kept_s = np.nan
        self._broken = False  # whether a sample was dropped since the last one that stayed
        self._lost: list[int] = []  # samples lost since then, by each interruption
        self._dropped: list[_Dropped] = []
        self._endless: list[_Dropped] = []
        self._touching: _Dropped | None = None
        self._between: list[Defect] = []
        self._last_kept = (np.nan, np.nan, np.nan)
        self.doubled = 0
        """Rows that repeated others so far."""
        self._doubled_s = (np.nan, np.nan)  # when the first and the last of them were

    def take(
        self,
        time_s: FloatArray,
        stroke_mm: FloatArray,
        force_kN: FloatArray,
        lost_before: Iterable[tuple[int, int]] = (),
    ) -> tuple[NDArray[np.intp] | slice, NDArray[np.intp]]:
        """Take the next samples.

        Parameters
        ----------
        time_s, stroke_mm, force_kN : arrays, shape (N,)
        lost_before : iterable of (index, samples)
            Interruptions that the recording knows of itself, by index in the piece (0: it does not know how
            many samples it lost).

        Returns
        -------
        (array of int or slice, array of int)
            The samples that stay; and those of them, counted among themselves, before which is a break.
        """
        kept: NDArray[np.intp] | slice = slice(None)
        broken: list[int] = []
        size = time_s.size
        shortest_s, longest_s = step_limits(time_s)
        if (
            size > 1
            and time_s[0] > self._latest_s
            and shortest_s > 0.0
            and finite_where_rising(time_s, stroke_mm, force_kN)
        ):
            self._latest_s = float(time_s[-1])
            self._touching = None
            self._end(float(time_s[0]))
        else:
            kept, broken = self._drop(time_s, stroke_mm, force_kN)
            size = kept.size
            shortest_s, longest_s = step_limits(time_s[kept])
        if size:
            self._last_kept = _last_of(kept, time_s, stroke_mm, force_kN)
        lost = [(0, samples) for samples in self._lost]
        for at, samples in lost_before:
            lost.append((at if isinstance(kept, slice) else int(np.searchsorted(kept, at)), samples))
        self._lost = [samples for at, samples in lost if at == size]
        known = {at for at in broken if at < size} | ({0} if self._broken and size else set())
        self._broken = size in broken or (self._broken and not size)
        if not size:
            return kept, np.zeros(0, dtype=np.intp)
        return kept, self._breaks(time_s[kept], known, lost, shortest_s, longest_s)

    def defects(self) -> tuple[Defect, ...]:
        """Return all defects of the samples taken, in order of time."""
        found = [group.defect(self._first_kept_s, self._last_kept_s) for group in self._dropped]
        if self.doubled:
            first, last = self._doubled_s
            what = f"{self.doubled} doubled rows, the first at {first:.6g} s"
            found.append(Defect("doubled", first, last, what, self.doubled))
        return tuple(sorted((*found, *self._between), key=lambda defect: defect.start_s))

    def _drop(
        self, time: FloatArray, stroke: FloatArray, force: FloatArray
    ) -> tuple[NDArray[np.intp], list[int]]:
        """Return the usable samples, and where among them others were."""
        finite = np.isfinite(time) & np.isfinite(stroke) & np.isfinite(force)
        latest = np.concatenate(([self._latest_s], np.where(np.isfinite(time), time, -np.inf)))
        latest = np.maximum.accumulate(latest)
        before, self._latest_s = latest[:-1], float(latest[-1])
        keep = finite & (np.where(np.isfinite(time), time, np.inf) > before)
        kept, dropped = np.flatnonzero(keep), np.flatnonzero(~keep)
        dropped = dropped[~self._repeats(np.stack((time, stroke, force)), kept, dropped)]
        reason = np.where(~finite[dropped], 0, np.where(time[dropped] == before[dropped], 1, 2))
        self._note(time, kept, dropped, reason)
        return kept, np.searchsorted(kept, dropped).tolist()

    def _repeats(
        self, rows: FloatArray, kept: NDArray[np.intp], dropped: NDArray[np.intp]
    ) -> NDArray[np.bool_]:
        """Say which of the dropped samples, columns of ``rows``, repeat one that stays; and count them."""
        known = np.concatenate((np.array(self._last_kept)[:, None], rows[:, kept]), axis=1)
        if not dropped.size or not known.size:
            return np.zeros(dropped.size, dtype=bool)
        first = int(np.isnan(known[0, 0]))
        place = first + np.searchsorted(known[0, first:], rows[0, dropped])
        same = np.all(known[:, np.minimum(place, known.shape[1] - 1)] == rows[:, dropped], axis=0)
        if same.any():
            moments = rows[0, dropped[same]]
            begin_s = self._doubled_s[0] if self.doubled else float(moments[0])
            self._doubled_s = (begin_s, float(moments[-1]))
            self.doubled += int(np.count_nonzero(same))
        return np.asarray(same)

    def _note(
        self, time: FloatArray, kept: NDArray[np.intp], dropped: NDArray[np.intp], reason: NDArray[np.intp]
    ) -> None:
        """Note one defect for each run of neighbouring samples that were dropped for the same reason."""
        touching, self._touching = self._touching, None
        if dropped.size and dropped[0] == 0 and touching is not None and touching.reason == reason[0]:
            self._endless.pop()  # it goes on: noted anew, with the samples that it has already
            self._dropped.pop()
        else:
            touching = None
        if kept.size:
            self._end(float(time[kept[0]]))
        if not dropped.size:
            return
        cuts = np.flatnonzero((np.diff(dropped) > 1) | (np.diff(reason) != 0)) + 1
        for group in np.split(np.arange(dropped.size), cuts):
            first, last, why = int(dropped[group[0]]), int(dropped[group[-1]]), int(reason[group[0]])
            prior, after = (int(at) for at in np.searchsorted(kept, (first, last)))
            before_s = None if self.kept == 0 else self._last_kept_s
            noted = _Dropped(why, last - first + 1, float(time[kept[prior - 1]]) if prior else before_s)
            if touching is not None:
                noted.samples += touching.samples
                touching = None
            if after < kept.size:
                noted.end_s = float(time[kept[after]])
            else:
                self._endless.append(noted)
            self._dropped.append(noted)
            if last == time.size - 1:
                self._touching = noted

    def _end(self, kept_s: float) -> None:
        """Note the sample that stays again."""
        for group in self._endless:
            group.end_s = kept_s
        self._endless.clear()

    def _breaks(
        self,
        time: FloatArray,
        known: set[int],
        lost: Iterable[tuple[int, int]],
        shortest_s: float,
        longest_s: float,
    ) -> NDArray[np.intp]:
        """Return the breaks between kept samples, and note what the steps between them are."""
        limit_s = self._limit_s
        self.even &= longest_s <= _EVEN * shortest_s
        if limit_s is None:
            limit_s = _longest_usual_step_s(time, shortest_s, longest_s)
        steps = _longer_steps(time, limit_s) if longest_s > limit_s else set()
        if self.kept == 0:
            self._first_kept_s = float(time[0])
        elif time[0] - self._last_kept_s > limit_s:
            steps.add(0)
        least = 0 if self.kept else 1

        def around(at: int) -> tuple[float, float]:
            return float(time[at - 1]) if at else self._last_kept_s, float(time[at])

        for at, samples in lost:
            if least <= at < time.size and (samples != 0 or at not in known | steps):
                self._between.append(_lost(*around(at), samples))
                known.add(at)
        for at in sorted(steps - known):
            a, b = around(at)
            self._between.append(gap(a, b))
        self._last_kept_s = float(time[-1])
        self.kept += time.size
        return np.array(sorted(at for at in known | steps if at >= least), dtype=np.intp)


def _last_of(kept: NDArray[np.intp] | slice, *columns: FloatArray) -> tuple[float, float, float]:
    at = -1 if isinstance(kept, slice) else int(kept[-1])
    time, stroke, force = (float(column[at]) for column in columns)
    return time, stroke, force


def usual_limit_s(median_s: float, high_s: float) -> float:
    """Return the largest step that is still usual [s], of the median step and the one that 98 % stay below.

    The step itself for an even sampling; for an uneven one, five times the step that 98 % stay below.
    """
    return _GAP_STEPS * median_s if high_s <= _EVEN * median_s else _UNEVEN_STEPS * high_s


def _longest_usual_step_s(time_s: FloatArray, shortest_s: float, longest_s: float) -> float:
    if 0.0 < longest_s <= _EVEN * shortest_s:  # even: no need to sort millions of steps
        return _GAP_STEPS * float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    step = np.diff(time_s)
    step = step[step > 0.0]
    if step.size == 0:
        return float("inf")
    return usual_limit_s(*(quantile(step, share) for share in USUAL_SHARES))


def step_limits(time_s: FloatArray) -> tuple[float, float]:
    """Return the shortest and the longest step between samples [s]; NaN where a time is none."""
    shortest, longest = [np.inf], [-np.inf]
    room = np.empty(min(_CHUNK, time_s.size))  # made once: fresh memory would cost more than the differences
    for first in range(0, time_s.size - 1, _CHUNK):
        part = time_s[first : first + _CHUNK + 1]
        step = np.subtract(part[1:], part[:-1], out=room[: part.size - 1])
        shortest.append(float(step.min()))
        longest.append(float(step.max()))
    return float(np.min(shortest)), float(np.max(longest))


def finite_where_rising(time_s: FloatArray, *columns: FloatArray) -> bool:
    """Say whether every sample is usable where time rises strictly: the usual case, told in a few passes."""
    # Strictly rising says that no time inside is NaN; a sum is finite only if all its terms are.
    ends = bool(np.isfinite(time_s[0]) and np.isfinite(time_s[-1]))
    return ends and all(bool(np.isfinite(np.sum(column))) for column in columns)


def _longer_steps(time: FloatArray, limit_s: float) -> set[int]:
    """Return the samples that follow a step longer than a limit."""
    found: set[int] = set()
    for first in range(0, time.size - 1, _CHUNK):
        step = np.diff(time[first : first + _CHUNK + 1])
        if np.max(step) > limit_s:
            found.update(int(i) + first + 1 for i in np.flatnonzero(step > limit_s))
    return found
