"""The strokes at which a specimen is expected to reach the two forces of its cycles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bufferstand.protocols.prediction.machine_stroke import piston_mm
from bufferstand.protocols.prediction.predictor import Predictor, StaticEstimate
from bufferstand.protocols.steps import ExpectedTurns, ForceCycles

POINTS = 400
"""Of the way back; between two of them the stroke is interpolated."""
FINEST_MM = 0.02
"""Finer a piston is not set [mm]: encoders show a hundredth."""
SURE_MM = 0.1
"""So far a turn may wander at one force from one cycle to the next [mm], on the simulated stand of the
samples: a spring creeps, and force and encoder have noise."""
NEAR_SHARE = 0.02
"""The stiffness at the upper turn is that over this share of its force."""


@dataclass(frozen=True)
class SpecimenLoading:
    """A specimen in its machine on the way to a force.

    Parameters
    ----------
    predictor : Predictor
        The specimen.
    temperature_C : float
        Its temperature [°C].
    give_mm_per_kN : float
        1 / k of the machine.
    taken_mm_per_kN : float
        The same where the stroke limit is the piston's; 0 where it is the specimen's.
    """

    predictor: Predictor
    temperature_C: float
    give_mm_per_kN: float
    taken_mm_per_kN: float

    def to(self, motion: ForceCycles) -> StaticEstimate:
        """Return the compression to the upper force, or to the stroke limit where that comes first."""
        return self.predictor.static(
            motion.force_max_kN,
            motion.stroke_limit_mm,
            motion.speed_mm_per_s,
            self.temperature_C,
            self.taken_mm_per_kN,
        )

    def stiffness_at_turn(self, motion: ForceCycles) -> float:
        """Return dF/dposition of the piston just before the upper turn [kN/mm]."""
        top = self.to(motion)
        before = self.to(replace(motion, force_max_kN=(1.0 - NEAR_SHARE) * top.peak_force_kN))
        grown_kN = top.peak_force_kN - before.peak_force_kN
        way_mm = piston_mm(top.end_stroke_mm - before.end_stroke_mm, grown_kN, self.give_mm_per_kN)
        return grown_kN / way_mm if way_mm > 0.0 else 0.0

    def finest_kN(self, motion: ForceCycles) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the force [kN] of the finest way of the piston, at the turn where it is more."""
        turns = self.turns(motion)
        way_mm = turns.piston_upper_mm - turns.piston_lower_mm
        between = (turns.upper_kN - turns.lower_kN) / way_mm if way_mm > 0.0 else 0.0
        return FINEST_MM * max(self.stiffness_at_turn(motion), between)

    def turns(self, motion: ForceCycles) -> ExpectedTurns:
        """Return where the motion turns (:func:`force_turns`)."""
        return force_turns(
            self.predictor, motion, self.temperature_C, self.give_mm_per_kN, self.taken_mm_per_kN
        )

    def notes(self, motion: ForceCycles) -> list[str]:
        """Return what of the motion is expected not to be met, or not surely."""
        notes, turns, tolerance_kN = [], self.turns(motion), motion.tolerance_kN
        if turns.upper_kN < motion.force_max_kN - tolerance_kN:
            notes.append(
                f"the stroke limit of {motion.stroke_limit_mm:g} mm comes at {turns.upper_kN:.0f} kN, before "
                f"force_max_kN = {motion.force_max_kN:g}: it turns there"
            )
        wander_kN = self.finest_kN(motion) * SURE_MM / FINEST_MM
        if tolerance_kN < wander_kN:
            notes.append(
                f"tolerance_percent = {motion.tolerance_percent:g} ({tolerance_kN:.2g} kN) may not be met in "
                f"every cycle: {SURE_MM:g} mm of the piston are {wander_kN:.2g} kN"
            )
        way_mm = turns.piston_upper_mm - turns.piston_lower_mm
        if way_mm < motion.speed_mm_per_s * motion.REACTION_S:
            notes.append(
                f"between its forces the piston goes {way_mm:.2f} mm: too little to come to "
                f"{motion.speed_mm_per_s:g} mm/s within {motion.REACTION_S:g} s"
            )
        return notes


def force_turns(
    predictor: Predictor,
    motion: ForceCycles,
    temperature_C: float,
    give_mm_per_kN: float,
    taken_mm_per_kN: float,
) -> ExpectedTurns:
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
    return ExpectedTurns(
        lower_mm, upper_mm, lower_kN, top.peak_force_kN,
        piston_mm(lower_mm, lower_kN, give_mm_per_kN), piston_mm(upper_mm, top.peak_force_kN, give_mm_per_kN),
    )  # fmt: skip
