"""Plans the rest of a campaign again, with temperatures as measured and heating as learned.

Nothing about the steps themselves changes, only when they come, what the pauses between them are, and what is
expected: a step keeps its motions, its number and its hash.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from bufferstand.protocols.planning.estimate import DataRate, Estimator
from bufferstand.protocols.planning.expansion import Request
from bufferstand.protocols.planning.heating import Surroundings
from bufferstand.protocols.planning.ordering import course_of, soonest, with_pauses
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.prediction import (
    CoarsePredictor,
    HeatScale,
    LearnedPredictor,
    Predictor,
    Temperatures,
)
from bufferstand.protocols.steps import PlannedStep

REORDER = math.log(1.1)
"""The order is looked for anew when a learned factor has changed by more than this since (10 %)."""


class Replanner:
    """Plans what is left of a campaign.

    Parameters
    ----------
    plan : Plan
        Of the whole campaign.
    predictor : Predictor
        The spring model it was made with, not scaled.
    """

    def __init__(self, plan: Plan, predictor: Predictor) -> None:
        self._plan = plan
        self._coarse = CoarsePredictor(predictor)
        self._request = {
            step.plan_hash: request for step, request in zip(plan.steps, plan.requests, strict=True)
        }
        self._ordered_by = HeatScale()

    def know(self, predictor: Predictor) -> None:
        """Plan what is left with another predictor: of a specimen that has become known."""
        self._coarse = CoarsePredictor(predictor)

    @property
    def predictor(self) -> Predictor:
        """Return the model, not scaled."""
        return self._coarse

    def steps_left(
        self, left: Sequence[PlannedStep], now: Temperatures, ambient_C: float, scale: HeatScale
    ) -> tuple[PlannedStep, ...]:
        """Return the steps that are left with what is to be expected of them.

        With ``[plan] order = "soonest"`` the pauses between them are found anew, and where the specimen heats
        or cools otherwise than the order was made for, the order as well.

        Parameters
        ----------
        left : sequence of PlannedStep
            Steps of the plan in their present order; pauses among them are dropped.
        now : Temperatures
            Of the specimen.
        ambient_C : float
            Of the air, as measured [°C].
        scale : HeatScale
            What was learned.

        Raises
        ------
        KeyError
            If a step is none of the plan.
        """
        steps = [step for step in left if not step.pause]
        requests: tuple[Request, ...] = tuple(self._request[step.plan_hash] for step in steps)
        campaign = self._plan.campaign
        learned = LearnedPredictor(self._coarse, scale)
        around = Surroundings(learned, self._plan.limits, campaign.limits, ambient_C)
        if campaign.content.plan.order == "soonest":
            course = course_of(requests, campaign, around)
            order: Sequence[int] = range(len(requests))
            if self._differs(scale):
                order, _, _ = soonest(course, now)
                self._ordered_by = scale
            requests = with_pauses(course, order, requests, now)
            steps = [steps[number] for number in order]
        estimated = Estimator(campaign, around, DataRate(), {}).steps(requests, now)
        return _as_before(estimated, steps)

    def _differs(self, scale: HeatScale) -> bool:
        before = self._ordered_by
        return (
            max(abs(math.log(scale.heating / before.heating)), abs(math.log(scale.cooling / before.cooling)))
            > REORDER
        )


def _as_before(estimated: Sequence[PlannedStep], steps: Sequence[PlannedStep]) -> tuple[PlannedStep, ...]:
    """Return the estimated steps with the plan's number and hash; a pause has the number of what follows."""
    found: list[PlannedStep] = []
    known = list(steps)
    for step in estimated:
        same = known[0] if step.pause else known.pop(0)
        plan_hash = step.plan_hash if step.pause else same.plan_hash
        found.append(replace(step, index=same.index, plan_hash=plan_hash))
    return tuple(found)
