"""Does a step keep every limit? If not: which one does it break, and what is the nearest that would do?"""

from __future__ import annotations

from dataclasses import dataclass, replace

from bufferstand.protocols.campaign_file import MotionSettings
from bufferstand.protocols.campaign_file.step_kinds import (
    ConditioningStep,
    ForceCyclesStep,
    HarmonicPiece,
    HarmonicStep,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    RampPiece,
    ReleasePiece,
    SingleStep,
    StaticStep,
    WarmUpStep,
)
from bufferstand.protocols.planning.expansion import Request
from bufferstand.protocols.planning.limit_checks.basis import CheckBasis
from bufferstand.protocols.planning.limit_checks.between_forces import BetweenForcesJudge
from bufferstand.protocols.planning.limit_checks.broken_limit import BrokenLimit, over, within
from bufferstand.protocols.planning.limit_checks.sine import SineJudge
from bufferstand.protocols.planning.limit_checks.slow_motion import SlowJudge
from bufferstand.protocols.planning.limit_checks.unknown_specimen import too_soon


@dataclass(frozen=True)
class StepJudge(CheckBasis):
    """Judges steps of every kind by what it is given.

    Parameters
    ----------
    stroke_done : bool
        Whether a slow stroke comes before: what is known of a specimen of which nothing is known at first.
    """

    stroke_done: bool = False

    def breach(self, step: SingleStep) -> BrokenLimit | None:  # noqa: PLR0911 - one for each kind
        """Return the first limit that a step breaks, with the nearest admissible values, or None."""
        if self.predictor.known_to_mm == 0.0 and not self.stroke_done and (found := too_soon(step)):
            return found
        match step:
            case HarmonicStep():
                return self._sines.breach(step)
            case StaticStep():
                return self._slow.static(step)
            case HoldStep():
                return self._slow.hold(step)
            case ConditioningStep() | WarmUpStep():
                return self.breach(step.as_step())
            case InnerLoopsStep():
                return self._loops(step)
            case MotionStep():
                return self._composed(step)
            case ForceCyclesStep():
                return BetweenForcesJudge(self).breach(step)
        return None

    def of(self, request: Request, *, stroke_done: bool) -> StepJudge:
        """Return the judge of one request, before which a slow stroke comes or not.

        A step that does not begin below a temperature is judged at that: it has no colder spring.
        """
        band, coldest_C = request.step.start_band(), self.coldest_C
        if band is not None and band.refuses_cold:
            coldest_C = max(coldest_C, band.low_C)
        return replace(self, compensate=request.compensate, stroke_done=stroke_done, coldest_C=coldest_C)

    def motion_breach(self, motion: MotionSettings) -> BrokenLimit | None:
        """Return the limit that a ramp's speed breaks."""
        for key in ("ramp_speed_mm_per_s", "release_speed_mm_per_s"):
            if found := over(key, getattr(motion, key), self.limits.speed):
                return found
        return None

    @property
    def _sines(self) -> SineJudge:
        return SineJudge(self)

    @property
    def _slow(self) -> SlowJudge:
        return SlowJudge(self)

    def _loops(self, step: InnerLoopsStep) -> BrokenLimit | None:
        for loop in step.loops():
            if found := self._sines.breach(loop):
                which = f"loop {loop.prestress_mm:g} ± {loop.amplitude_mm:g} mm"
                return within(which, found, {"prestress_mm": "mean_mm"})
        return None

    def _composed(self, step: MotionStep) -> BrokenLimit | None:
        at_mm = 0.0
        for number, piece in enumerate(step.piece, start=1):
            found: BrokenLimit | None = None
            if isinstance(piece, HarmonicPiece):
                found = self._sines.breach(piece.about(at_mm))
                if found and "prestress_mm" in found.nearest:
                    found = BrokenLimit(found.limit, found.problem, {})  # that is the piece's before it
            elif isinstance(piece, RampPiece):
                found = self._slow.ramp(piece)
                at_mm = piece.to_mm if piece.to_mm is not None else self.limits.stroke.value
            elif isinstance(piece, ReleasePiece):
                if piece.speed_mm_per_s is not None:
                    found = over("speed_mm_per_s", piece.speed_mm_per_s, self.limits.speed)
                at_mm = 0.0
            if found:
                return within(f"piece {number}", found, {})
        return None
