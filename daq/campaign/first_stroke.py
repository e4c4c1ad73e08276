"""A specimen of which nothing is known: its first slow stroke shows the curve by which the rest is judged."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.planning.limit_checks import StepJudge, shows_the_curve
from bufferstand.protocols.prediction import CurvePredictor, Predictor, curve_of_stroke
from bufferstand.protocols.steps import Hold, PlannedStep, TouchOff, WaitUntilCool
from bufferstand.recording.runfile import open_run


class SpecimenKnowledge:
    """What becomes known of a specimen while its campaign runs.

    Parameters
    ----------
    plan : Plan
        Of the campaign.
    predictor : Predictor or None
        What it was planned with; only of one that knows no forces there is anything to learn.
    """

    def __init__(self, plan: Plan, predictor: Predictor | None) -> None:
        self._plan = plan
        self._strange = predictor is not None and predictor.known_to_mm == 0.0
        self._curve: CurvePredictor | None = None
        self._request = {
            step.plan_hash: request for step, request in zip(plan.steps, plan.requests, strict=True)
        }

    def meet(self, step: PlannedStep, run: Path) -> CurvePredictor | None:
        """Learn the curve from a step that was run, if it is the first to show it; return it if so."""
        request = self._request.get(step.plan_hash)
        if not self._strange or self._curve is not None or request is None:
            return None
        if shows_the_curve(request.step):
            self._curve = recorded_curve(run)
        return self._curve

    def recall(self, runs: Iterable[tuple[PlannedStep, Path]]) -> CurvePredictor | None:
        """Learn from the runs of an earlier start, in order; return the curve if there is one."""
        for step, run in runs:
            if (found := self.meet(step, run)) is not None:
                return found
        return None

    def refuses(self, step: PlannedStep) -> str | None:
        """Return why a step must not be run with what is known by now; None if it may, or always might."""
        request = self._request.get(step.plan_hash)
        if not self._strange or request is None:
            return None
        campaign = self._plan.campaign
        conditions = campaign.content.conditions
        known: Predictor | None = None if self._curve is None else self._curve.bounding()
        if known is None:
            moves = [one for one in step.motions if not isinstance(one, Hold | TouchOff | WaitUntilCool)]
            if shows_the_curve(request.step) or not moves:
                return None
            return f"step “{step.name}”: no slow stroke of this campaign has shown the specimen's curve yet"
        judge = StepJudge(
            self._plan.limits,
            known,
            campaign.content.motion.ramp_speed_mm_per_s,
            min(conditions.ambient_C, conditions.start_C()),
        )
        found = judge.of(request, stroke_done=True).breach(request.step)
        if found is None:
            return None
        return (
            f"step “{step.name}”: {found.problem}, by the curve that the first slow stroke has shown; "
            f"{found.remedy()}"
        )


def recorded_curve(path: Path) -> CurvePredictor | None:
    """Return the loading curve that a recorded run's first stroke shows; None if it cannot be had."""
    try:
        run = open_run(path)
        force, stroke = run.series("force"), run.series("stroke")
    except BadInput:
        return None
    if len(force.value) != len(stroke.value):
        return None
    return curve_of_stroke(stroke.value, force.value)
