"""Does a motion at constant speed, to a stroke or a force, keep every limit?"""

from __future__ import annotations

from dataclasses import dataclass

from protocols.admissible.breach import HYDRAULICS, Breach, down, greatest_share, over, said, too_fast
from protocols.admissible.grounds import Grounds
from protocols.kinds import ForceCyclesStep, HoldStep, RampPiece, StaticStep
from protocols.limits import TOLERANCE
from protocols.prediction import force_at


@dataclass(frozen=True)
class SlowJudge:
    """Judges motions at constant speed by what it is given."""

    grounds: Grounds

    def static(self, step: StaticStep) -> Breach | None:
        """Return the limit that strokes to a limit break."""
        asked = (
            ("speed_mm_per_s", step.speed_mm_per_s, self.grounds.limits.speed),
            ("force_limit_kN", step.force_limit_kN, self.grounds.limits.force),
            ("stroke_limit_mm", step.stroke_limit_mm, self.grounds.limits.stroke),
        )
        for key, value, bound in asked:
            if value is not None and (found := over(key, value, bound)):
                return found
        force = self.grounds.limits.force.value if step.force_limit_kN is None else step.force_limit_kN
        stroke = self.grounds.limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
        return self._slow("speed_mm_per_s", step.speed_mm_per_s, force, stroke)

    def between_forces(self, step: ForceCyclesStep) -> Breach | None:
        """Return the limit that cycles between two forces break."""
        asked = (
            ("speed_mm_per_s", step.speed_mm_per_s, self.grounds.limits.speed),
            ("force_max_kN", step.force_max_kN, self.grounds.limits.force),
            ("stroke_limit_mm", step.stroke_limit_mm, self.grounds.limits.stroke),
        )
        for key, value, bound in asked:
            if value is not None and (found := over(key, value, bound)):
                return found
        stroke_mm = self.grounds.limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
        return self._slow("speed_mm_per_s", step.speed_mm_per_s, step.force_max_kN, stroke_mm)

    def _slow(
        self, key: str, speed_mm_per_s: float, force_limit_kN: float, stroke_limit_mm: float
    ) -> Breach | None:
        """Judge a compression at constant speed to a limit by what the hydraulics deliver there."""
        curve = self.grounds.limits.machine.force_speed
        if curve is None:
            return None
        end = self.grounds.predictor.static(
            force_limit_kN,
            stroke_limit_mm,
            speed_mm_per_s,
            self.grounds.coldest_C,
            self.grounds.taken_mm_per_kN,
        )
        allowed = float(curve.speed_at(end.peak_force_kN))
        if speed_mm_per_s <= allowed * (1.0 + TOLERANCE):
            return None
        problem = too_fast(f"{key} = {speed_mm_per_s:g} mm/s", end.peak_force_kN, allowed)
        return Breach(HYDRAULICS, problem, {key: down(allowed)} if allowed > 0.0 else {})

    def ramp(self, piece: RampPiece) -> Breach | None:
        """Return the limit that a ramp to a stroke or a force breaks."""
        if found := over("speed_mm_per_s", piece.speed_mm_per_s, self.grounds.limits.speed):
            return found
        speed = piece.speed_mm_per_s
        if piece.to_kN is not None:
            found = over("to_kN", piece.to_kN, self.grounds.limits.force)
            return found or self._slow("speed_mm_per_s", speed, piece.to_kN, self.grounds.limits.stroke.value)
        found = self._stroke("to_mm", piece.to_mm or 0.0, speed)
        if found or not piece.to_mm:
            return found
        return self._slow("speed_mm_per_s", speed, self.grounds.limits.force.value, piece.to_mm)

    def hold(self, step: HoldStep) -> Breach | None:
        """Return the limit that the way to where it stands breaks."""
        if step.force_kN is not None:
            found = over("approach_speed_mm_per_s", step.approach_speed_mm_per_s, self.grounds.limits.speed)
            return found or over("force_kN", step.force_kN, self.grounds.limits.force)
        return self._stroke("stroke_mm", step.stroke_mm or 0.0, self.grounds.ramp_speed_mm_per_s)

    def _stroke(self, key: str, asked_mm: float, speed_mm_per_s: float) -> Breach | None:
        """Judge a compression to a stroke by stroke and force."""
        if asked_mm <= 0.0:
            return None
        if found := self.grounds.unknown(asked_mm):
            nearest_mm = {key: self.grounds.predictor.known_to_mm}
            return Breach(found.limit, found.problem, nearest_mm)
        stroke = min(asked_mm, self.grounds.limits.stroke.value)

        def force_at_mm(stroke_mm: float) -> float:
            return force_at(
                self.grounds.predictor,
                stroke_mm,
                speed_mm_per_s,
                self.grounds.coldest_C,
                self.grounds.taken_mm_per_kN,
            )

        def keeps(share: float) -> bool:
            return self.grounds.limits.force.allows(force_at_mm(down(stroke * share)))

        if self.grounds.limits.force.allows(force_at_mm(stroke)):
            return over(key, asked_mm, self.grounds.limits.stroke)
        share = greatest_share(keeps, stroke)
        nearest = {key: down(stroke * share)} if share > 0.0 else {}
        if not self.grounds.limits.stroke.allows(asked_mm):
            return Breach(*said(key, asked_mm, self.grounds.limits.stroke), nearest)
        what = f"the expected force at {self.grounds.place(asked_mm)}"
        return Breach(*said(what, force_at_mm(asked_mm), self.grounds.limits.force), nearest)
