"""At which strokes a specimen is expected to have the forces between which it is cycled."""

from __future__ import annotations

import numpy as np

from protocols.commanded import piston_mm
from protocols.prediction import Predictor
from protocols.steps import ForceCycles, Turns

POINTS = 400
"""Of the way back; between two of them the stroke is interpolated."""


def force_turns(
    predictor: Predictor,
    motion: ForceCycles,
    temperature_C: float,
    give_mm_per_kN: float,
    taken_mm_per_kN: float,
) -> Turns:
    """Return where a motion between two forces is expected to turn.

    Parameters
    ----------
    predictor : Predictor
        The specimen.
    motion : ForceCycles
        The forces, the speed, and the stroke at which it turns at the latest.
    temperature_C : float
        Of the specimen.
    give_mm_per_kN : float
        1 / k of the machine.
    taken_mm_per_kN : float
        The same where the stroke limit is the piston's; 0 where it is the specimen's.

    Notes
    -----
    The upper turn is where the loading path meets the force. From there the path back at the same speed is
    followed: by its friction the specimen has the lower force at a greater stroke than while it was loaded.
    """
    top = predictor.static(
        motion.force_max_kN, motion.stroke_limit_mm, motion.speed_mm_per_s, temperature_C, taken_mm_per_kN
    )
    upper_mm = top.end_stroke_mm
    way = np.concatenate([np.linspace(0.0, upper_mm, POINTS), np.linspace(upper_mm, 0.0, POINTS)[1:]])
    time_s = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(way)))]) / motion.speed_mm_per_s
    force_kN = predictor.forces(time_s, way, temperature_C)[POINTS - 1 :]
    back_mm = way[POINTS - 1 :]
    lower_mm = 0.0
    if (below := np.flatnonzero(force_kN <= motion.force_min_kN)).size and below[0] > 0:
        at = int(below[0])
        lower_mm = float(
            np.interp(motion.force_min_kN, [force_kN[at], force_kN[at - 1]], [back_mm[at], back_mm[at - 1]])
        )
    lower_kN = min(motion.force_min_kN, top.peak_force_kN)
    return Turns(
        lower_mm, upper_mm, lower_kN, top.peak_force_kN,
        piston_mm(lower_mm, lower_kN, give_mm_per_kN), piston_mm(upper_mm, top.peak_force_kN, give_mm_per_kN),
    )  # fmt: skip
