"""The sine nearest to one that breaks a limit, which keeps every limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from bufferstand.protocols.campaign_file.step_kinds import HarmonicStep
from bufferstand.protocols.limits import TOLERANCE
from bufferstand.protocols.planning.limit_checks.basis import CheckBasis
from bufferstand.protocols.planning.limit_checks.broken_limit import (
    HYDRAULICS,
    RESOLUTION,
    down,
    greatest_share,
)

Problem = tuple[str, str]
"""Name of the limit that is broken, and what is asked and allowed."""


def nearest_sine(
    step: HarmonicStep, grounds: CheckBasis, problem: Callable[[HarmonicStep], Problem | None]
) -> dict[str, float]:
    """Return the keys of a sine to change, with their nearest admissible values; empty if there are none.

    Parameters
    ----------
    step : HarmonicStep
        That breaks a limit.
    grounds : Grounds
        Limits and forces.
    problem : callable
        Says which limit a sine breaks.
    """
    return _Mending(grounds, problem).of(step)


@dataclass(frozen=True)
class _Mending:
    """How a sine is changed until it keeps every limit."""

    grounds: CheckBasis
    problem: Callable[[HarmonicStep], Problem | None]

    def of(self, step: HarmonicStep) -> dict[str, float]:
        """Mend stroke, then rate, then force; only what must change changes, and no more than it must."""
        mended = self._mend_rate(self._mend_stroke(step))
        problem = self.problem(mended)
        if problem is not None and problem[0] in (
            self.grounds.limits.force.name,
            self.grounds.limits.travel.name,
        ):
            mended = self._mend_force(mended)
            problem = self.problem(mended)
        if problem is not None and problem[0] == HYDRAULICS:
            mended = self._mend_hydraulics(mended)
        if self.problem(mended) is not None:
            return {}
        keys = ("prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s")
        return {key: getattr(mended, key) for key in keys if getattr(mended, key) != getattr(step, key)}

    def _mend_stroke(self, step: HarmonicStep) -> HarmonicStep:
        known_mm = self.grounds.predictor.known_to_mm or math.inf
        top, prestress = min(self.grounds.limits.stroke.value, known_mm), step.prestress_mm
        room = min(prestress, top - prestress)
        if step.amplitude_mm <= room * (1.0 + TOLERANCE):
            return step
        if room >= RESOLUTION:
            return step.model_copy(update={"amplitude_mm": down(room)})
        amplitude = min(step.amplitude_mm, down(top / 2.0))  # no room at this prestress: move the prestress
        prestress = amplitude if prestress < top / 2.0 else down(top - amplitude)
        return step.model_copy(update={"prestress_mm": prestress, "amplitude_mm": amplitude})

    def _mend_rate(self, step: HarmonicStep) -> HarmonicStep:
        per_Hz = 2.0 * math.pi * step.amplitude_mm
        highest_Hz = min(self.grounds.limits.frequency.value, self.grounds.limits.speed.value / per_Hz)
        frequency, _ = step.rate()
        if frequency <= highest_Hz * (1.0 + TOLERANCE):
            return step
        if step.frequency_Hz is not None:
            return step.model_copy(update={"frequency_Hz": down(highest_Hz, RESOLUTION / 10.0)})
        return step.model_copy(update={"peak_speed_mm_per_s": down(highest_Hz * per_Hz)})

    def _mend_force(self, step: HarmonicStep) -> HarmonicStep:
        """Lower the amplitude, or where that cannot help the prestress, to the greatest force allowed."""

        def lower_amplitude(share: float) -> HarmonicStep:
            return self._mend_rate(step.model_copy(update={"amplitude_mm": down(step.amplitude_mm * share)}))

        def lower_prestress(share: float) -> HarmonicStep:
            prestress = down(step.prestress_mm * share)
            changed = {"prestress_mm": prestress, "amplitude_mm": min(step.amplitude_mm, prestress)}
            return self._mend_rate(step.model_copy(update=changed))

        for change, size in ((lower_amplitude, step.amplitude_mm), (lower_prestress, step.prestress_mm)):
            share = greatest_share(self._keeping(change), size)
            if share > 0.0:
                return change(share)
        return step

    def _mend_hydraulics(self, step: HarmonicStep) -> HarmonicStep:
        """Slow down to what the hydraulics deliver: the force hardly depends on the rate, the speed does."""
        frequency, speed = step.rate()

        def slower(share: float) -> HarmonicStep:
            if step.frequency_Hz is not None:
                return step.model_copy(update={"frequency_Hz": down(frequency * share, RESOLUTION / 10.0)})
            return step.model_copy(update={"peak_speed_mm_per_s": down(speed * share)})

        share = greatest_share(self._keeping(slower), speed)
        return slower(share) if share > 0.0 else step

    def _keeping(self, change: Callable[[float], HarmonicStep]) -> Callable[[float], bool]:
        return lambda share: self.problem(change(share)) is None
