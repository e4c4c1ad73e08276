"""The machine between piston and specimen: the stroke of one for the stroke of the other.

Frame, load cell and fixture are springs in series with the specimen. Under a force F they give way by F / k,
so that the piston is further than the specimen is compressed::

    position = stroke + F / k

Positions and strokes in mm from first contact, forces in kN, compression positive; ``give_mm_per_kN`` is
1 / k, 0 for a rigid machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]

STROKE_TOLERANCE_MM = 1e-6
"""So exactly a stroke behind a machine is solved for: a thousandth of what any draw wire resolves [mm]."""


@dataclass(frozen=True)
class Sine:
    """Mean and amplitude (half the range) of a sine [mm]."""

    mean_mm: float
    amplitude_mm: float

    @property
    def lower_mm(self) -> float:
        """Lower turning point [mm]."""
        return self.mean_mm - self.amplitude_mm

    @property
    def upper_mm(self) -> float:
        """Upper turning point [mm]."""
        return self.mean_mm + self.amplitude_mm

    @classmethod
    def between(cls, lower_mm: float, upper_mm: float) -> Sine:
        """Return the sine between two turning points."""
        return cls(0.5 * (lower_mm + upper_mm), 0.5 * (upper_mm - lower_mm))


def piston_mm(stroke_mm: float, force_kN: float, give_mm_per_kN: float) -> float:
    """Return the piston's position [mm] at which the specimen has a stroke under a force."""
    return stroke_mm + force_kN * give_mm_per_kN


def piston_sine(asked: Sine, lower_kN: float, upper_kN: float, give_mm_per_kN: float) -> Sine:
    """Return the piston's sine with which the specimen turns where it is asked to.

    Parameters
    ----------
    asked : Sine
        Of the specimen.
    lower_kN, upper_kN : float
        Force at the lower and at the upper turning point of the settled loop.
    give_mm_per_kN : float
        1 / k of the machine.

    Notes
    -----
    Mean and amplitude grow by the mean and by half the difference of what is given way there. Between the
    turning points the specimen leaves the sine by what its characteristic is curved: that is no matter of
    the command.
    """
    return Sine.between(
        piston_mm(asked.lower_mm, lower_kN, give_mm_per_kN),
        piston_mm(asked.upper_mm, upper_kN, give_mm_per_kN),
    )


def stroke_behind(position_mm: float, force_at: Callable[[float], float], give_mm_per_kN: float) -> float:
    """Return the specimen's stroke [mm] where the piston stands at a position.

    Solves ``stroke + F(stroke) / k = position``; F must not fall with the stroke, and so there is one root. A
    preloaded specimen is not compressed before the machine's force exceeds its preload: its stroke is 0.

    Parameters
    ----------
    position_mm : float
        Of the piston, from first contact.
    force_at : callable
        Force [kN] at a stroke [mm].
    give_mm_per_kN : float
        1 / k of the machine; 0 gives the position itself.
    """
    if position_mm <= 0.0 or give_mm_per_kN == 0.0:
        return max(0.0, position_mm)

    def beyond_mm(stroke_mm: float) -> float:
        return piston_mm(stroke_mm, force_at(stroke_mm), give_mm_per_kN) - position_mm

    nothing_mm = math.ulp(position_mm)
    if beyond_mm(nothing_mm) >= 0.0:
        return 0.0
    return float(brentq(beyond_mm, nothing_mm, position_mm, xtol=STROKE_TOLERANCE_MM))


def stroke_sine(
    piston: Sine, turning_forces: Callable[[Sine], tuple[float, float]], give_mm_per_kN: float
) -> Sine:
    """Return the sine that the specimen makes when the piston makes one: what an uncompensated command gives.

    Parameters
    ----------
    piston : Sine
        Of the piston, from first contact.
    turning_forces : callable
        Force at the lower and at the upper turning point [kN] of a sine of the specimen that has settled.
    give_mm_per_kN : float
        1 / k of the machine.

    Notes
    -----
    Two equations, ``turn + F(turn) / k = position`` at either end, with a force that depends on both ends
    (the loop's hysteresis), solved by turns with the secant's slope of each. The specimen's motion is taken
    for a sine between the two, which bears on its viscous part only: a rate-independent loop knows its turns
    alone.
    """
    if give_mm_per_kN == 0.0:
        return piston
    lower, upper = _End(piston.lower_mm, give_mm_per_kN), _End(piston.upper_mm, give_mm_per_kN)
    asked = Sine.between(lower.stroke_mm, upper.stroke_mm)
    for _ in range(_MOST_ROUNDS):
        below_kN, above_kN = turning_forces(asked)
        moved_mm = max(lower.take(below_kN), upper.take(above_kN))
        if upper.stroke_mm - lower.stroke_mm < _LEAST_RANGE_MM:
            lower.stroke_mm = max(0.0, upper.stroke_mm - _LEAST_RANGE_MM)
            upper.stroke_mm = lower.stroke_mm + _LEAST_RANGE_MM
        asked = Sine.between(lower.stroke_mm, upper.stroke_mm)
        if moved_mm < STROKE_TOLERANCE_MM:
            break
    return asked


def strokes_behind(
    position_mm: Floats, forces: Callable[[Floats], Floats], give_mm_per_kN: float
) -> tuple[Floats, Floats]:
    """Return strokes [mm] and forces [kN] of a specimen whose machine's piston follows a path, shape (n,).

    Parameters
    ----------
    position_mm : NDArray, shape (n,)
        The piston's path from rest.
    forces : callable
        Forces along a path of strokes from rest, shape (n,); one may depend on all strokes before it.
    give_mm_per_kN : float
        1 / k of the machine.

    Notes
    -----
    Relaxation of the whole path at once, by ``1 / (1 + K / k)`` of what is missing, K being the steepest
    tangent met. The force at a point depends on the strokes up to it only, so that the iteration's matrix is
    triangular and its eigenvalues are ``1 − (1 + K_i / k) / (1 + K / k)``, between 0 and 1.
    """
    stroke = np.maximum(position_mm, 0.0)
    force = forces(stroke)
    if give_mm_per_kN == 0.0:
        return stroke, force
    steepest = _steepest(stroke, force)
    share = 1.0 / (1.0 + steepest * give_mm_per_kN)
    least_mm = math.inf
    for _ in range(_MOST_SWEEPS):
        missing = position_mm - stroke - force * give_mm_per_kN
        missing[(stroke == 0.0) & (missing < 0.0)] = 0.0  # the preload holds against the machine
        worst_mm = float(np.abs(missing).max())
        if worst_mm < _PATH_TOLERANCE_MM:
            break
        if worst_mm >= least_mm:
            share *= 0.7
        least_mm = min(least_mm, worst_mm)
        stroke = np.maximum(stroke + share * missing, 0.0)
        force = forces(stroke)
    return stroke, force


_MOST_SWEEPS = 1000
_PATH_TOLERANCE_MM = 1e-3


def _steepest(stroke_mm: Floats, force_kN: Floats) -> float:
    """Return the steepest tangent of a path [kN/mm]; 0 where nothing moves."""
    moved = np.abs(np.diff(stroke_mm))
    far = moved > 1e-6
    if not far.any():
        return 0.0
    return float((np.abs(np.diff(force_kN))[far] / moved[far]).max())


_MOST_ROUNDS = 60
_LEAST_RANGE_MM = 1e-3
"""A sine has at least this range [mm]: a machine so soft that it takes all of it leaves no test."""


class _End:
    """One turning point on its way to where piston, machine and specimen agree."""

    def __init__(self, position_mm: float, give_mm_per_kN: float) -> None:
        self._position_mm = position_mm
        self._give = give_mm_per_kN
        self._before: tuple[float, float] | None = None
        self._stiffness = 0.0
        self.stroke_mm = position_mm

    def take(self, force_kN: float) -> float:
        """Move to where the force says; return by how much [mm]."""
        at_mm = self.stroke_mm
        if self._before is not None and abs(at_mm - self._before[0]) > STROKE_TOLERANCE_MM:
            slope = (force_kN - self._before[1]) / (at_mm - self._before[0])
            self._stiffness = max(0.0, slope)
        self._before = at_mm, force_kN
        missing_mm = self._position_mm - piston_mm(at_mm, force_kN, self._give)
        to_mm = at_mm + missing_mm / (1.0 + self._stiffness * self._give)
        self.stroke_mm = min(max(0.0, to_mm), max(0.0, self._position_mm))
        return abs(self.stroke_mm - at_mm)
