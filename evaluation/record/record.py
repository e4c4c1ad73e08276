"""A run as evaluation sees it: one time base, stroke and force sampled together, and each defect of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.evaluation.numerics import FloatArray, Sampling, sampling_of, without_fast_hum
from bufferstand.evaluation.record.clock_stamps import understand
from bufferstand.evaluation.record.defects import Cleaner, Defect, gap
from bufferstand.evaluation.record.even_sampling import even_stamps
from bufferstand.evaluation.record.event_logging import event_changes, lost_between, silent_beyond_beat
from bufferstand.evaluation.record.interpolated_force import InterpolationLimits
from bufferstand.evaluation.record.signals import Signals
from bufferstand.evaluation.record.temperature_sensors import InvalidReadings
from bufferstand.evaluation.record.time_steps import unusual_steps
from bufferstand.foundation import BadInput

_BY_EVENT = (
    "written by event: its steps of time differ, and what changes in them does not; a long one lacks nothing"
)


@dataclass(frozen=True, eq=False)
class Peak:
    """The least or the greatest sample of a channel.

    Attributes
    ----------
    value, time_s : float
    near : array, shape (K,)
        The samples about it, itself among them, none beyond a break.
    at : int
        Its place in ``near``.
    """

    value: float
    time_s: float
    near: FloatArray
    at: int


Ends = tuple[Peak, Peak]
"""The least and the greatest sample."""


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
    faults: tuple[InvalidReadings, ...] = ()
    """What it showed besides that is no reading; it is not among ``temperature_C``."""
    ends: Ends | None = None
    """Of all its readings, where those that are here were picked from more."""


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
        Index i: between sample i-1 and sample i more may have happened than the sampling usually sees. What
        that means for a figure is found by :mod:`bufferstand.evaluation.gaps`.
    defects : tuple of Defect
        What caused the breaks, in order of time.
    wire_difference_mm : array, shape (N,), or None
        stroke_1 - stroke_2, where the stroke is the mean of two draw wires; of more the largest difference.
    drums_mm : tuple of float
        Circumferences of the drums of its draw wires, where stated: their deviation repeats with it.
    averaged : int
        Samples as recorded that each sample is the mean of (:mod:`bufferstand.evaluation.loading.condense`).
    moment_error_s : float
        Limit of the error of a sample's moment, where its stamp was rounded.
    between : Between, or None
        What may lie between the readings of a force that was interpolated.
    notes : tuple of str
        What was understood of how the record was written, in words.
    ends : mapping of str to (Peak, Peak)
        Where the samples are means, or are brought to other instants: the least and the greatest sample as
        recorded, by channel (``force``, ``stroke``, ``speed``; of several draw wires also ``stroke_1`` …).
    by_event : bool
        A sample was written whenever something had changed: in a long step nothing did but at its end.
    filled_s : tuple of (float, float)
        Between which samples were put into a rest that was not logged: they show that it is one, and nothing
        of the noise.
    drift_kN : float
        Limit of the change of the force's zero over the record, where stated.
    as_recorded : mapping of str to (array, array)
        Time and value of channels whose samples here are brought to other instants, or are means of draw
        wires: as they were read (``force``, ``stroke_1``, ``stroke_2`` …), all numbers at rising times. Of a
        run too long to be held at once more than two wires only, averaged as all else.
    signals : Signals, or None
        All signals of a run that a stand recorded, side by side and thinned.
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
    drums_mm: tuple[float, ...] = ()
    moment_error_s: float = 0.0
    notes: tuple[str, ...] = ()
    ends: Mapping[str, Ends] = field(default_factory=dict)
    between: InterpolationLimits | None = None
    by_event: bool = False
    filled_s: tuple[tuple[float, float], ...] = ()
    drift_kN: float = 0.0
    as_recorded: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    signals: Signals | None = None

    @property
    def read(self) -> NDArray[np.bool_]:
        """Which samples were read, shape (N,): not those that were put into rests."""
        begin_s, end_s = np.array(self.filled_s or [(np.inf, np.inf)]).T
        span = np.searchsorted(begin_s, self.time_s) - 1  # the last one that begins before the sample
        return np.asarray((span < 0) | (self.time_s >= end_s[span]))

    def as_read(self, values: FloatArray) -> FloatArray:
        """Return those of a channel's samples, shape (N,), that were read."""
        return values[self.read] if self.filled_s else values

    @cached_property
    def stroke_sampling(self) -> Sampling:
        """Noise, converter's step and held samples of its stroke as it was read."""
        return sampling_of(self.as_read(self.stroke_mm))

    @cached_property
    def stroke_noise_mm(self) -> float:
        """Noise of its stroke by which fits are judged
        (:func:`bufferstand.evaluation.numerics.reversals.without_fast_hum`)."""
        return without_fast_hum(self.as_read(self.stroke_mm), self.stroke_sampling.sigma)

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
    clock_s: float = 0.0,
) -> Record:
    """Clean raw columns into a record: defective samples leave, and each leaves a break and a defect behind.

    Time stamps that several samples share because they are rounded are spread again. A step is a break where
    it is longer than those around it; in a record that is written by event, where more changed than that.

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
    clock_s : float
        Step of the clock, where several samples shared its stamps and have been spread again.

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

    cleaner, notes, lost = Cleaner(), [], list(lost_before)
    kept, breaks = cleaner.take(time, stroke, force, lost)
    if cleaner.kept + cleaner.doubled < time.size:
        understood = understand(time)
        if understood is not None:
            time, cleaner, notes = understood.time_s, Cleaner(), [understood.note]
            clock_s = max(clock_s, understood.clock_s)
            kept, breaks = cleaner.take(time, stroke, force, [*lost, *understood.interrupted])
    check_usable(cleaner)
    record = Record(
        time_s=time[kept],
        stroke_mm=stroke[kept],
        force_kN=force[kept],
        speed_mm_per_s=None if speed is None else speed[kept],
        temperatures=tuple(temperatures),
        breaks=tuple(breaks.tolist()),
        defects=cleaner.defects(),
        wire_difference_mm=None if difference is None else difference[kept],
        moment_error_s=0.5 * clock_s,
        notes=tuple(notes),
    )
    return with_even_stamps(record if cleaner.even else with_own_steps(record))


def with_even_stamps(record: Record) -> Record:
    """Return a record whose samples were taken evenly with even moments, though its stamps scatter."""
    found = even_stamps(record.time_s, record.stroke_mm, np.array(record.breaks, dtype=np.intp))
    if found is None or record.by_event:
        return record
    ends = np.array([(d.start_s, d.end_s) for d in record.defects]).reshape(-1, 2)
    moved = np.interp(ends, record.time_s, found.time_s).tolist()
    return replace(
        record,
        time_s=found.time_s,
        defects=tuple(
            replace(defect, start_s=start, end_s=end)
            for defect, (start, end) in zip(record.defects, moved, strict=True)
        ),
        notes=(*record.notes, found.note),
    )


def with_own_steps(record: Record) -> Record:
    """Return a record of uneven steps with the breaks that show only beside the steps around them."""
    changes = event_changes(record.time_s, record.stroke_mm, record.force_kN)
    if changes is None:
        found = set(unusual_steps(record.time_s).tolist())
    else:
        found = {*lost_between(changes).tolist(), *silent_beyond_beat(record.time_s, changes).tolist()}
    new, gone, notes = found - set(record.breaks), set(), record.notes
    if changes is not None:
        gone = _steps_alone(record) - found
        notes = (*notes, _BY_EVENT)
    left_s = {float(record.time_s[at - 1]) for at in gone}
    known = [defect for defect in record.defects if defect.kind != "gap" or defect.start_s not in left_s]
    known += [gap(float(record.time_s[at - 1]), float(record.time_s[at])) for at in new]
    return replace(
        record,
        breaks=tuple(sorted((set(record.breaks) | new) - gone)),
        defects=tuple(sorted(known, key=lambda defect: defect.start_s)),
        notes=notes,
        by_event=changes is not None,
    )


def _steps_alone(record: Record) -> set[int]:
    """Return the breaks that are steps of time and nothing else."""
    other_s = {defect.start_s for defect in record.defects if defect.kind != "gap"}
    return {at for at in record.breaks if float(record.time_s[at - 1]) not in other_s}


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
