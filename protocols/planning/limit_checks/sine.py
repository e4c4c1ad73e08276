"""Does a sine, with the way into it, keep every limit?"""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.protocols.campaign_file.step_kinds import HarmonicStep
from bufferstand.protocols.limits import TOLERANCE
from bufferstand.protocols.planning.limit_checks.basis import CheckBasis
from bufferstand.protocols.planning.limit_checks.broken_limit import (
    BELOW_ZERO,
    HYDRAULICS,
    BrokenLimit,
    said,
    too_fast,
)
from bufferstand.protocols.planning.limit_checks.nearest_allowed import nearest_sine
from bufferstand.protocols.prediction import ForcePath, Sine, first_cycle


@dataclass(frozen=True)
class SineJudge:
    """Judges sines by what it is given."""

    grounds: CheckBasis

    def breach(self, step: HarmonicStep) -> BrokenLimit | None:
        """Return the first limit that a sine breaks, with the nearest admissible values, or None."""
        found = self.problem(step)
        if found is None:
            return None
        name, problem = found
        return BrokenLimit(name, problem, nearest_sine(step, self.grounds, self.problem))

    def problem(self, step: HarmonicStep) -> tuple[str, str] | None:
        """Return the name of the first limit that a sine breaks, and what is asked and allowed."""
        return self._motion_problem(step) or self._way_problem(step)

    def _motion_problem(self, step: HarmonicStep) -> tuple[str, str] | None:
        """Return what a sine breaks by itself, whatever the specimen."""
        limits, (frequency, speed) = self.grounds.limits, step.rate()
        prestress, amplitude = step.prestress_mm, step.amplitude_mm
        lowest, highest = prestress - amplitude, prestress + amplitude
        if lowest < -TOLERANCE * amplitude:
            problem = (
                f"the stroke would go to {prestress:g} − {amplitude:g} = {lowest:g} mm, below first contact "
                f"({BELOW_ZERO})"
            )
            return BELOW_ZERO, problem
        if not limits.stroke.allows(highest):
            return said(f"the stroke {prestress:g} + {amplitude:g}", highest, limits.stroke)
        if not limits.frequency.allows(frequency):
            by = "" if step.frequency_Hz else f" of {speed:g} mm/s at {amplitude:g} mm"
            return said(f"the frequency{by}", frequency, limits.frequency)
        if not limits.speed.allows(speed):
            return said(f"the peak speed 2π · {frequency:g} Hz · {amplitude:g} mm", speed, limits.speed)
        return None

    def _way_problem(self, step: HarmonicStep) -> tuple[str, str] | None:
        """Return what a sine breaks with this specimen in this machine."""
        limits, highest = self.grounds.limits, step.prestress_mm + step.amplitude_mm
        if unknown := self.grounds.unknown(highest):
            return unknown.limit, unknown.problem
        course, force = self._way(step)
        if not limits.force.allows(force):
            return said(f"the expected peak force at {self.grounds.place(highest)}", force, limits.force)
        furthest_mm = float(course.position_mm.max())
        if not limits.travel.allows(furthest_mm):
            what = f"the piston's position at {highest:g} mm of stroke and {force:.4g} kN"
            return said(what, furthest_mm, limits.travel)
        return self._hydraulics(course)

    def _way(self, step: HarmonicStep) -> tuple[ForcePath, float]:
        """Return the way into a sine at the coldest, and the greatest force of it and of the settled loop."""
        frequency, _ = step.rate()
        course = first_cycle(
            self.grounds.predictor,
            Sine(step.prestress_mm, step.amplitude_mm),
            frequency,
            self.grounds.ramp_speed_mm_per_s,
            self.grounds.coldest_C,
            give_mm_per_kN=self.grounds.limits.machine.give_mm_per_kN,
            compensated=self.grounds.compensate,
        )
        settled = self.grounds.predictor.harmonic(
            step.prestress_mm,
            step.amplitude_mm,
            frequency,
            self.grounds.coldest_C,
            self.grounds.taken_mm_per_kN,
        )
        return course, max(course.peak_force_kN, settled.peak_force_kN)

    def _hydraulics(self, course: ForcePath) -> tuple[str, str] | None:
        """Return what the hydraulics do not deliver anywhere on the way into a sine."""
        curve = self.grounds.limits.machine.force_speed
        if curve is None:
            return None
        speed, force, allowed = course.fastest(curve)
        if speed <= allowed * (1.0 + TOLERANCE):
            return None
        return HYDRAULICS, too_fast(f"the piston's speed of {speed:.4g} mm/s", force, allowed)
