"""All signals of a run at common instants: several measurements of one motion.

Some thousands of samples show a wrong scale or sign, a delay or a slip: a long run is thinned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation import BadInput, to_inside
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.foundation.numbers import HOLE_S, hole_from_s, median
from bufferstand.recording.runfile import Run

MOST = 8_000
"""Samples that are held of each signal: of two minutes at 1 kHz one in 15 ms."""

FORCES = ("force", "force_2")
PISTON = ("position", "command")


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals at common instants: ``time_s`` (N,), and by name each one's values (N,), all numbers.

    Names are those of the stand's channels: ``force``, ``force_2``, ``stroke_1``, ``stroke_2`` (``stroke`` of
    a stand with one), ``position``, ``command``.
    """

    time_s: FloatArray
    by_name: Mapping[str, FloatArray]
    known: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    """Whether a signal has samples around an instant, (N,) each; one that is not named here has them all."""
    loose_s: float = 0.0
    """By how much the stamps of ``force_2`` wander about an even rate [s]: a computer that was starved."""

    def both(self, one: str, two: str) -> NDArray[np.bool_]:
        """Return at which instants two signals both have samples, shape (N,)."""
        all_of_them = np.ones(self.time_s.size, dtype=np.bool_)
        return self.known.get(one, all_of_them) & self.known.get(two, all_of_them)

    @property
    def strokes(self) -> tuple[str, ...]:
        """Names of those that measure the specimen's stroke."""
        return tuple(name for name in ("stroke", *STROKE_CHANNELS) if name in self.by_name)

    def get(self, name: str) -> FloatArray | None:
        """Return a signal, None where the run has none of that name."""
        return self.by_name.get(name)


def signals_of(run: Run, wires: Sequence[str], whole_rows: int, piece_rows: int) -> Signals | None:
    """Return the signals of a run that a stand recorded; None where there is nothing to compare.

    A signal that no figure comes from and that cannot be read is none.

    Parameters
    ----------
    run : Run
    wires : sequence of str
        Stroke channels that hold numbers.
    whole_rows : int
        A stream with more rows is read in pieces of ``piece_rows``.
    piece_rows : int

    Raises
    ------
    BadInput
        If counts or stamps of force or stroke are damaged.
    """
    others = [name for name in (*FORCES[1:], *PISTON) if run.has(name)]
    if not wires or not run.has("force") or not (others or len(wires) > 1):
        return None
    read = {name: _thinned(run, name, whole_rows, piece_rows) for name in ("force", *wires)}
    for name in others:
        with suppress(BadInput):
            read[name] = _thinned(run, name, whole_rows, piece_rows)
    time_s = read[wires[0]][0]
    usable = {name: pair for name, pair in read.items() if pair[0].size > 1}
    if time_s.size < 2 or "force" not in usable or np.any(np.diff(time_s) <= 0.0):
        return None
    by_name = {
        name: value if np.array_equal(own_s, time_s) else np.interp(time_s, own_s, value)
        for name, (own_s, value) in usable.items()
    }
    loose_s = _wander_s(usable["force_2"][0]) if "force_2" in usable else 0.0
    return Signals(time_s, by_name, {name: _known(time_s, pair[0]) for name, pair in usable.items()}, loose_s)


def _wander_s(own_s: FloatArray) -> float:
    """Return by how much stamps wander about an even rate, lost samples left out: from least to most [s]."""
    steps = np.diff(own_s)
    period_s = median(steps) if steps.size else 0.0
    if period_s <= 0.0 or steps.size < 3:
        return 0.0
    index = np.concatenate(([0.0], np.cumsum(np.maximum(1.0, np.rint(steps / period_s)))))
    index -= index.mean()
    late_s = own_s - own_s.mean()
    late_s = late_s - index * (float(np.dot(index, late_s)) / float(np.dot(index, index)))
    return float(np.ptp(late_s))


def _known(time_s: FloatArray, own_s: FloatArray) -> NDArray[np.bool_]:
    """Return at which instants a signal has samples of its own on either side, close by."""
    steps_s = np.diff(own_s)
    if own_s is time_s or float(np.min(steps_s, initial=0.0)) < 0.0:
        return np.ones(time_s.size, dtype=np.bool_)
    longest_s = float(np.max(steps_s, initial=0.0))
    most_s = HOLE_S if longest_s <= HOLE_S else hole_from_s(own_s)
    if longest_s <= most_s:
        return np.asarray((time_s > own_s[0]) & (time_s <= own_s[-1]))
    after = np.searchsorted(own_s, time_s)
    inside = (after > 0) & (after < own_s.size)
    at = np.clip(after, 1, own_s.size - 1)
    return inside & (own_s[at] - own_s[at - 1] <= most_s)


def _thinned(run: Run, name: str, whole_rows: int, piece_rows: int) -> tuple[FloatArray, FloatArray]:
    """Return time and value of about ``MOST`` samples of a channel, evenly picked, all numbers."""
    stream = run.stream_of(name)
    every = -(-stream.rows // MOST)
    quantity, unit = stream.channels[name].quantity, stream.channels[name].unit
    if stream.rows <= whole_rows:
        series = run.picked(name, every)
        time_s, value = series.time_s, series.value
    else:
        parts = [
            (block[name].time_s[::every], block[name].value[::every])
            for block in run.blocks([name], max(piece_rows, every))
        ]
        time_s, value = (np.concatenate(column) for column in zip(*parts, strict=True))
    there = np.isfinite(time_s) & np.isfinite(value)
    shown = to_inside(value[there], "stroke" if quantity in PISTON else quantity, unit)
    return time_s[there], np.asarray(shown, dtype=np.float64)
