"""A run as evaluation sees it: one time base, stroke and force sampled together, and each defect of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evaluation.channels.sensors import SensorFault
from evaluation.defects import Cleaner, Defect
from foundation.errors import BadInput

FloatArray = NDArray[np.float64]


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
    faults: tuple[SensorFault, ...] = ()
    """What it showed besides that is no reading; it is not among ``temperature_C``."""


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
    averaged : int
        Samples as recorded that each sample is the mean of (:mod:`evaluation.condense`).
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    speed_mm_per_s: FloatArray | None = None
    temperatures: tuple[Temperature, ...] = ()
    breaks: tuple[int, ...] = ()
    defects: tuple[Defect, ...] = ()
    wire_difference_mm: FloatArray | None = None
    averaged: int = 1

    def has_break(self, first: int, last: int) -> bool:
        """Say whether a break lies between sample ``first`` and sample ``last`` (both included)."""
        after = bisect_right(self.breaks, first)
        return after < len(self.breaks) and self.breaks[after] <= last


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

    cleaner = Cleaner()
    kept, breaks = cleaner.take(time, stroke, force, lost_before)
    check_usable(cleaner)
    return Record(
        time_s=time[kept],
        stroke_mm=stroke[kept],
        force_kN=force[kept],
        speed_mm_per_s=None if speed is None else speed[kept],
        temperatures=tuple(temperatures),
        breaks=tuple(breaks.tolist()),
        defects=cleaner.defects(),
        wire_difference_mm=None if difference is None else difference[kept],
    )


def check_usable(cleaner: Cleaner) -> None:
    """Refuse a record of which no stretch is left.

    Raises
    ------
    BadInput
        If fewer than two samples are usable.
    """
    if cleaner.kept < 2:
        raise BadInput(
            "fewer than two usable samples in the record", remedy="check the time and stroke columns"
        )
