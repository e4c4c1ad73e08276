"""Does a motion at constant speed, to a stroke or a force, keep every limit?"""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.protocols.campaign_file.step_kinds import HoldStep, RampPiece, StaticStep
from bufferstand.protocols.limits import TOLERANCE
from bufferstand.protocols.planning.limit_checks.basis import CheckBasis
from bufferstand.protocols.planning.limit_checks.broken_limit import (
    HYDRAULICS,
    BrokenLimit,
    down,
    greatest_share,
    over,
    said,
    too_fast,
)
from bufferstand.protocols.prediction import StaticEstimate, force_at, piston_mm


@dataclass(frozen=True)
class SlowJudge:
    """Judges motions at constant speed by what it is given."""

    grounds: CheckBasis

    def static(self, step: StaticStep) -> BrokenLimit | None:
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
        return self.at_speed("speed_mm_per_s", step.speed_mm_per_s, "force_limit_kN", force, stroke)

    def at_speed(
        self,
        speed_key: str,
        speed_mm_per_s: float,
        force_key: str,
        force_limit_kN: float,
        stroke_limit_mm: float,
    ) -> BrokenLimit | None:
        """Return what a compression at constant speed to a limit breaks in this machine.

        Parameters
        ----------
        speed_key, force_key : str
            Keys of the step that set speed and force limit.
        speed_mm_per_s, force_limit_kN, stroke_limit_mm : float
            The speed, and where it turns, whichever comes first.
        """
        return self._travel(force_key, force_limit_kN, stroke_limit_mm, speed_mm_per_s) or self._hydraulics(
            speed_key, speed_mm_per_s, force_limit_kN, stroke_limit_mm
        )

    def _end(self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float) -> StaticEstimate:
        """Return the compression to whichever limit comes first, at the coldest."""
        return self.grounds.predictor.static(
            force_limit_kN,
            stroke_limit_mm,
            speed_mm_per_s,
            self.grounds.coldest_C,
            self.grounds.taken_mm_per_kN,
        )

    def _travel(
        self, key: str, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float
    ) -> BrokenLimit | None:
        """Return whether the piston would have to go beyond its travel, because the machine gives way."""
        travel, give = self.grounds.limits.travel, self.grounds.limits.machine.give_mm_per_kN

        def position_mm(share: float) -> float:
            end = self._end(share * force_limit_kN, stroke_limit_mm, speed_mm_per_s)
            return piston_mm(end.end_stroke_mm, end.peak_force_kN, give)

        if travel.allows(position_mm(1.0)):
            return None
        end = self._end(force_limit_kN, stroke_limit_mm, speed_mm_per_s)
        share = greatest_share(lambda share: travel.allows(position_mm(share)), force_limit_kN)
        what = f"the piston's position at {end.end_stroke_mm:.4g} mm of stroke and {end.peak_force_kN:.4g} kN"
        nearest = {key: down(share * force_limit_kN)} if share > 0.0 else {}
        return BrokenLimit(*said(what, position_mm(1.0), travel), nearest)

    def _hydraulics(
        self, key: str, speed_mm_per_s: float, force_limit_kN: float, stroke_limit_mm: float
    ) -> BrokenLimit | None:
        """Judge a compression at constant speed to a limit by what the hydraulics deliver there."""
        curve = self.grounds.limits.machine.force_speed
        if curve is None:
            return None
        end = self._end(force_limit_kN, stroke_limit_mm, speed_mm_per_s)
        allowed = float(curve.speed_at(end.peak_force_kN))
        if speed_mm_per_s <= allowed * (1.0 + TOLERANCE):
            return None
        problem = too_fast(f"{key} = {speed_mm_per_s:g} mm/s", end.peak_force_kN, allowed)
        return BrokenLimit(HYDRAULICS, problem, {key: down(allowed)} if allowed > 0.0 else {})

    def ramp(self, piece: RampPiece) -> BrokenLimit | None:
        """Return the limit that a ramp to a stroke or a force breaks."""
        if found := over("speed_mm_per_s", piece.speed_mm_per_s, self.grounds.limits.speed):
            return found
        speed = piece.speed_mm_per_s
        if piece.to_kN is not None:
            found = over("to_kN", piece.to_kN, self.grounds.limits.force)
            stroke_mm = self.grounds.limits.stroke.value
            return found or self.at_speed("speed_mm_per_s", speed, "to_kN", piece.to_kN, stroke_mm)
        found = self._stroke("to_mm", piece.to_mm or 0.0, speed)
        if found or not piece.to_mm:
            return found
        return self._hydraulics("speed_mm_per_s", speed, self.grounds.limits.force.value, piece.to_mm)

    def hold(self, step: HoldStep) -> BrokenLimit | None:
        """Return the limit that the way to where it stands breaks."""
        if step.force_kN is not None:
            speed, limits = step.approach_speed_mm_per_s, self.grounds.limits
            found = over("approach_speed_mm_per_s", speed, limits.speed)
            found = found or over("force_kN", step.force_kN, limits.force)
            return found or self._travel("force_kN", step.force_kN, limits.stroke.value, speed)
        return self._stroke("stroke_mm", step.stroke_mm or 0.0, self.grounds.ramp_speed_mm_per_s)

    def _stroke(self, key: str, asked_mm: float, speed_mm_per_s: float) -> BrokenLimit | None:
        """Judge a compression to a stroke by stroke and force."""
        if asked_mm <= 0.0 or self.grounds.predictor.known_to_mm == 0.0:
            # Where nothing is known the first slow stroke shows the force, before this moves.
            return over(key, asked_mm, self.grounds.limits.stroke)
        if found := self.grounds.unknown(asked_mm):
            nearest_mm = {key: self.grounds.predictor.known_to_mm}
            return BrokenLimit(found.limit, found.problem, nearest_mm)
        stroke = min(asked_mm, self.grounds.limits.stroke.value)

        def force_at_mm(stroke_mm: float) -> float:
            return force_at(
                self.grounds.predictor,
                stroke_mm,
                speed_mm_per_s,
                self.grounds.coldest_C,
                self.grounds.taken_mm_per_kN,
            )

        def position_at_mm(stroke_mm: float) -> float:
            give = self.grounds.limits.machine.give_mm_per_kN if self.grounds.compensate else 0.0
            return piston_mm(stroke_mm, force_at_mm(stroke_mm), give)

        def allowed(stroke_mm: float) -> bool:
            limits = self.grounds.limits
            return limits.force.allows(force_at_mm(stroke_mm)) and limits.travel.allows(
                position_at_mm(stroke_mm)
            )

        def keeps(share: float) -> bool:
            return allowed(down(stroke * share))

        if allowed(stroke):
            return over(key, asked_mm, self.grounds.limits.stroke)
        share = greatest_share(keeps, stroke)
        nearest = {key: down(stroke * share)} if share > 0.0 else {}
        if not self.grounds.limits.stroke.allows(asked_mm):
            return BrokenLimit(*said(key, asked_mm, self.grounds.limits.stroke), nearest)
        force_kN = force_at_mm(asked_mm)
        if not self.grounds.limits.force.allows(force_kN):
            what = f"the expected force at {self.grounds.place(asked_mm)}"
            return BrokenLimit(*said(what, force_kN, self.grounds.limits.force), nearest)
        what = f"the piston's position at {asked_mm:g} mm of stroke and {force_kN:.4g} kN"
        return BrokenLimit(*said(what, position_at_mm(asked_mm), self.grounds.limits.travel), nearest)
