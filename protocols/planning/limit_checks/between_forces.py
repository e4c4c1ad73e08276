"""Do cycles between two forces keep every limit, and can both forces be met?"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from bufferstand.protocols.campaign_file.step_kinds import ForceCyclesStep
from bufferstand.protocols.planning.limit_checks.basis import CheckBasis
from bufferstand.protocols.planning.limit_checks.broken_limit import (
    RESOLUTION,
    BrokenLimit,
    down,
    greatest_share,
    over,
)
from bufferstand.protocols.planning.limit_checks.slow_motion import SlowJudge
from bufferstand.protocols.prediction import FINEST_MM, SpecimenLoading
from bufferstand.protocols.steps import ForceCycles

OVERRUN = "overrun"
"""Name of the limit that speed and reaction set: how near to the force limit a turn may be."""


@dataclass(frozen=True)
class BetweenForcesJudge:
    """Judges cycles between two forces by what it is given."""

    grounds: CheckBasis

    def breach(self, step: ForceCyclesStep) -> BrokenLimit | None:
        """Return the first limit that they break, or why a force cannot be met."""
        limits = self.grounds.limits
        asked = (
            ("speed_mm_per_s", step.speed_mm_per_s, limits.speed),
            ("force_max_kN", step.force_max_kN, limits.force),
            ("stroke_limit_mm", step.stroke_limit_mm, limits.stroke),
        )
        for key, value, bound in asked:
            if value is not None and (found := over(key, value, bound)):
                return found
        stroke_mm = limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
        found = SlowJudge(self.grounds).at_speed(
            "speed_mm_per_s", step.speed_mm_per_s, "force_max_kN", step.force_max_kN, stroke_mm
        )
        if found or self.grounds.predictor.known_to_mm == 0.0:
            return found
        motion = step.motion(stroke_mm)
        return self._stroke_limit(step, motion) or self._overrun(step, motion) or self._too_fine(step, motion)

    def _stroke_limit(self, step: ForceCyclesStep, motion: ForceCycles) -> BrokenLimit | None:
        """Return whether the stroke limit comes before even the lower force."""
        limit_mm, most_kN = motion.stroke_limit_mm, self._loading.to(motion).peak_force_kN
        if most_kN >= step.force_min_kN:
            return None
        problem = (
            f"the stroke limit of {limit_mm:g} mm comes at {most_kN:.4g} kN, before force_min_kN = "
            f"{step.force_min_kN:g}"
        )
        widest_mm = min(self.grounds.limits.stroke.value, self.grounds.predictor.known_to_mm)
        whole = self._loading.to(replace(motion, stroke_limit_mm=widest_mm))
        if whole.peak_force_kN < step.force_max_kN * (1.0 - 1e-3):
            return BrokenLimit(
                "stroke_limit_mm", problem, {}, f"ask for less than {whole.peak_force_kN:.4g} kN"
            )
        nearest_mm = min(widest_mm, math.ceil(whole.end_stroke_mm / RESOLUTION) * RESOLUTION)
        return BrokenLimit("stroke_limit_mm", problem, {"stroke_limit_mm": round(nearest_mm, 6)})

    def _overrun(self, step: ForceCyclesStep, motion: ForceCycles) -> BrokenLimit | None:
        """Return whether the force would go beyond its limit before a turn at this speed has been stopped."""
        limit = self.grounds.limits.force

        def peak(force_kN: float, speed_mm_per_s: float) -> float:
            """Return what the force comes to if a turn is stopped late [kN]."""
            asked = replace(motion, force_max_kN=force_kN, speed_mm_per_s=speed_mm_per_s)
            aimed_kN = min(self._loading.to(asked).peak_force_kN, limit.value - 0.5 * asked.tolerance_kN)
            return aimed_kN + self._loading.stiffness_at_turn(asked) * speed_mm_per_s * asked.REACTION_S

        speed, force_kN = step.speed_mm_per_s, step.force_max_kN
        most_kN = peak(force_kN, speed)
        if limit.allows(most_kN):
            return None
        slower = greatest_share(lambda share: limit.allows(peak(force_kN, share * speed)), speed)
        less = greatest_share(lambda share: limit.allows(peak(share * force_kN, speed)), force_kN)
        problem = (
            f"speed_mm_per_s = {speed:g} brings so much force in the {motion.REACTION_S:g} s in which the "
            f"piston is stopped that {force_kN:g} kN can become {most_kN:.4g} kN, above {limit.text()}"
        )
        ways = [f"speed_mm_per_s = {down(slower * speed):.10g}"] if slower > 0.0 else []
        if down(less * force_kN) > step.force_min_kN:
            ways.append(f"force_max_kN = {down(less * force_kN):.10g} at this speed")
        return BrokenLimit(OVERRUN, problem, {}, "nearest admissible: " + ", or ".join(ways) if ways else "")

    def _too_fine(self, step: ForceCyclesStep, motion: ForceCycles) -> BrokenLimit | None:
        """Return whether the tolerance is finer than the piston can be set."""
        finest_kN = self._loading.finest_kN(motion)
        if motion.tolerance_kN >= finest_kN:
            return None
        problem = (
            f"tolerance_percent = {step.tolerance_percent:g} ({motion.tolerance_kN:.2g} kN) is finer than "
            f"the piston can be set: {FINEST_MM:g} mm of it are {finest_kN:.2g} kN there"
        )
        percent = math.ceil(100.0 * finest_kN / step.force_max_kN / RESOLUTION) * RESOLUTION
        fits = 0.02 * percent * step.force_max_kN <= step.force_max_kN - step.force_min_kN
        nearest = {"tolerance_percent": round(percent, 6)} if fits else {}
        return BrokenLimit(
            "tolerance_percent", problem, nearest, "" if fits else "put the forces further apart"
        )

    @property
    def _loading(self) -> SpecimenLoading:
        grounds = self.grounds
        give = grounds.limits.machine.give_mm_per_kN
        return SpecimenLoading(grounds.predictor, grounds.coldest_C, give, grounds.taken_mm_per_kN)
