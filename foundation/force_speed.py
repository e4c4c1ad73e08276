"""The force–speed curve of a hydraulic actuator: at how much force it can still be how fast.

A servo valve lets through a flow that goes with the root of the pressure left over it (``Q = k √Δp``), and
the pressure that the load takes is not left: ``v = v_0 √(1 − F / F_stall)``. At no load the piston has its
greatest speed, at the stall force it stands. The curve is given as pairs, as it is measured or computed, and
is a straight line between them: below the root, which is concave, so that a table never promises what the
valve does not hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class ForceSpeed:
    """Greatest speed at a force, the same for loading and unloading.

    Parameters
    ----------
    points : tuple of (float, float)
        Pairs of force [kN] and greatest speed there [mm/s]: forces rising, speeds not rising, none below 0.

    Raises
    ------
    ValueError
        If the pairs are no such curve; the message says which and why.
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if problem := curve_problem(self.points):
            raise ValueError(problem)

    def speed_at(self, force_kN: ArrayLike) -> NDArray[np.float64]:
        """Return the greatest speed [mm/s] at a force [kN].

        Below the first force its speed holds, and so does that of the last one above it. Tension counts as no
        force: the piston's own friction and the smaller ring area are not known here.
        """
        forces, speeds = zip(*self.points, strict=True)
        at_kN: NDArray[np.float64] = np.asarray(force_kN, dtype=np.float64)
        speed: NDArray[np.float64] = np.asarray(np.interp(at_kN, forces, speeds))
        return speed


def curve_problem(points: Sequence[tuple[float, float]]) -> str:
    """Return why pairs of force [kN] and speed [mm/s] are no force–speed curve; empty if they are one."""
    if len(points) < 2:
        return "a curve needs two pairs [force_kN, speed_mm_per_s] or more"
    for number, (force, speed) in enumerate(points, start=1):
        if force < 0.0 or speed < 0.0:
            return f"pair {number} is [{force:g}, {speed:g}]: neither force nor speed may be below 0"
    for number, (before, after) in enumerate(pairwise(points), start=2):
        if not after[0] > before[0]:
            return (
                f"pair {number} has {after[0]:g} kN after {before[0]:g} kN: the forces must rise "
                "from pair to pair"
            )
        if after[1] > before[1]:
            return (
                f"pair {number} has {after[1]:g} mm/s at {after[0]:g} kN after {before[1]:g} mm/s at "
                f"{before[0]:g} kN: a valve gives no more speed at more force"
            )
    if points[0][1] == 0.0:
        return "the first pair has no speed: the stand could not move"
    return ""
