"""Time stamps that do not rise: the clock is coarse, or it was set back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record.defects import UNKNOWN
from bufferstand.foundation.numbers import median
from bufferstand.recording.foreign.times import shared_stamps, spread_stamps

SET_BACK = 64
"""So many samples in a row whose stamps rise again behind one of the past show a clock that was set."""
_SAME_JUMP = 0.5
"""Stamps that jump forward again by as much as they went back (to this share) went wrong for a while."""


@dataclass(frozen=True, eq=False)
class ClockCorrection:
    """Moments ``time_s`` (N,) for stamps that do not rise, in words what was made of them, the step of a
    coarse clock, and the samples before which it was set back, as interruptions of unknown length.
    """

    time_s: FloatArray
    note: str
    clock_s: float = 0.0
    interrupted: tuple[tuple[int, int], ...] = ()


def understand(time_s: FloatArray) -> ClockCorrection | None:
    """Return moments for samples whose stamps do not rise, where it shows why; else None.

    Samples that share the stamps of a coarse clock are spread over its steps. Behind a clock that was set
    back the stamps go on by the usual step: how long nothing was recorded there is not known.

    Parameters
    ----------
    time_s : array, shape (N,)
        Stamps as recorded [s].
    """
    coarse = shared_stamps(time_s)
    if coarse is not None:
        step_s, shared = coarse
        note = (
            f"time stamps rounded to {step_s:.4g} s, about {shared:.3g} samples share each: their moments "
            f"are spread over it, and known to {0.5 * step_s:.3g} s"
        )
        return ClockCorrection(spread_stamps(time_s), note, step_s)
    return _set_back(time_s)


def _set_back(time_s: FloatArray) -> ClockCorrection | None:
    """Return stamps that go on where the clock was set back; None where it was not."""
    steps = np.diff(time_s)
    if not np.isfinite(steps).all():
        return None
    places = np.flatnonzero(steps < 0.0)
    usual_s = median(steps)
    if not places.size or usual_s <= 0.0:
        return None
    ends = np.append(places[1:], steps.size)
    moved, found = time_s.copy(), []
    for at, end in zip(places.tolist(), ends.tolist(), strict=True):
        back_s = float(usual_s - steps[at])
        again = steps[at + 1 : end]
        if again.size < SET_BACK or np.any(np.abs(again - back_s) <= _SAME_JUMP * back_s):
            return None
        moved[at + 1 :] += back_s
        found.append((at + 1, UNKNOWN))
    first = found[0][0]
    note = (
        f"the clock was set back {len(found)} time(s), the first by {usual_s - steps[first - 1]:.4g} s after "
        f"{time_s[first - 1]:.6g} s; what follows goes on from there: how long it was away is not known"
    )
    return ClockCorrection(moved, note, interrupted=tuple(found))
