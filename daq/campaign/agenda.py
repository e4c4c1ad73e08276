"""The remaining steps of a campaign, their order and their time, updated as the specimen becomes known."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime

from bufferstand.daq.campaign_folder import AsRun, ExpectedOutcome
from bufferstand.daq.warm_up import StepHeat
from bufferstand.protocols.planning import Plan, Replanner, expected_total_s
from bufferstand.protocols.prediction import (
    HeatScale,
    Observation,
    Predictor,
    Temperatures,
    end_as_measured,
    learn_heating,
)
from bufferstand.protocols.steps import PlannedStep

MISSED_K = 0.3
"""As long as a step ends no further from what was expected, and the factors stay, the outlook holds."""
WARMER_K = 1.0
"""A specimen or air that is so much warmer or colder at the start than planned is planned for anew."""
MOVED = math.log(1.02)
"""A factor that has changed by more than 2 % is worth a new outlook."""
REMEMBERED = 60
"""So many of the last steps are learned from: a specimen changes, and an old one says little of it."""


class Agenda:
    """The steps that are left of a campaign.

    Parameters
    ----------
    plan : Plan
        What the campaign began with.
    over : callable
        Whether a step need not be done again.
    replanner : Replanner or None
        Plans what is left anew; without one the first plan stands.
    known : sequence of Observation
        Of steps that were run at an earlier start.
    """

    def __init__(
        self,
        plan: Plan,
        over: Callable[[PlannedStep], bool],
        replanner: Replanner | None,
        known: Sequence[Observation] = (),
    ) -> None:
        self._policy = plan.campaign.limits.on_temperature_stop
        self._air_C = plan.campaign.content.conditions.ambient_C
        self._replanner = replanner
        self._plan_knows_heat = self._knows_heat = plan.knows_heat
        self._first, self._pause_before = _with_their_pauses(plan.steps)
        self._planned = {step.plan_hash: step for step in plan.steps}
        self._left = [step for step in plan.steps if not step.pause and not over(step)]
        self._left = [
            one for step in self._left for one in (self._pause_before.get(step.plan_hash), step) if one
        ]
        self._observations = list(known)
        self._now: Temperatures | None = None
        self._outlook_by: HeatScale | None = None
        self._outdated = False
        self._began = self._after_pause = False
        self.scale = HeatScale()
        """What was learned of the specimen."""
        self._learn()
        self.later_s = expected_total_s(self._left, self._policy)
        """How long what comes after the present step should take, as learned [s]."""

    @property
    def learns(self) -> bool:
        """Return whether there is a model to learn with."""
        return self._replanner is not None

    @property
    def specimen_C(self) -> float | None:  # noqa: N802 - the unit keeps its capital
        """Return the temperature of the specimen's mass after what was seen last [°C]; None: unknown."""
        return None if self._now is None else self._now.mass_C

    @property
    def left(self) -> tuple[PlannedStep, ...]:
        """Return the steps that are left, without the one under way."""
        return tuple(self._left)

    @property
    def planned_later_s(self) -> float:
        """Return how long the first plan would take for what comes after the present step [s]."""
        left = {step.plan_hash for step in self._left}
        steps = [
            one
            for step in self._first
            if step.plan_hash in left
            for one in (self._pause_before.get(step.plan_hash), step)
            if one
        ]
        return expected_total_s(steps, self._policy)

    def next(self) -> PlannedStep | None:
        """Return the step that comes now, and take it off; None at the end."""
        if not self._left:
            return None
        step = self._left.pop(0)
        self.later_s = expected_total_s(self._left, self._policy)
        return step

    def done(self, step: PlannedStep, seen: StepHeat, cycles: int, *, complete: bool, run: str = "") -> AsRun:
        """Learn from a step that has ended, or was stopped; return it as it was run.

        Parameters
        ----------
        step : PlannedStep
            With what was expected of it.
        seen : Seen
            What was measured.
        cycles : int
            Full cycles done in this part of it.
        complete : bool
            Whether it came to its end.
        run : str
            Its run file.
        """
        heat_J = _heat_J(step, cycles, complete=complete)
        if seen.ambient_C is not None:
            self._air_C = seen.ambient_C
        if (
            heat_J is not None
            and seen.start_C is not None
            and seen.end_C is not None
            and seen.duration_s > 0.0
        ):
            self._observe(step, seen, heat_J, seen.start_C, seen.end_C)
        planned = self._planned.get(step.plan_hash)
        if step.pause:
            planned = self._pause_before.get(self._left[0].plan_hash) if self._left else None
        return self._as_run(
            step, seen, cycles, complete, run, heat_J or 0.0,
            None if planned is None else _expected(planned, knows_heat=self._plan_knows_heat),
            _expected(step, knows_heat=self._knows_heat),
        )  # fmt: skip

    def rested(self, step: PlannedStep, seen: StepHeat, temperature_C: float) -> AsRun:
        """Learn from the wait after a temperature stop in a step; return it as it was run.

        Parameters
        ----------
        step : PlannedStep
            That was stopped.
        seen : Seen
            What was measured while it cooled.
        temperature_C : float
            What it was to cool to [°C].
        """

        def expected(of: PlannedStep) -> ExpectedOutcome | None:
            wait_s = of.stops[-1].wait_s if of.stops else None
            return None if wait_s is None else ExpectedOutcome(wait_s, 0.0, temperature_C)

        planned = expected(self._planned.get(step.plan_hash, step))
        return self._waited(step, seen, temperature_C, planned, expected(step))

    def waited(self, step: PlannedStep, seen: StepHeat) -> AsRun:
        """Learn from the wait before a step that begins in a band of temperatures; return it as it was run.

        Parameters
        ----------
        step : PlannedStep
            That was waited for; it has a ``start_band``.
        seen : Seen
            What was measured while it cooled.
        """
        to_C = seen.end_C or 0.0 if step.start_band is None else step.start_band.high_C

        def expected(of: PlannedStep) -> ExpectedOutcome | None:
            return ExpectedOutcome(of.wait_s, 0.0, to_C) if of.wait_s > 0.0 else None

        planned = expected(self._planned.get(step.plan_hash, step))
        return self._waited(step, seen, to_C, planned, expected(step))

    def _waited(
        self,
        step: PlannedStep,
        seen: StepHeat,
        to_C: float,
        planned: ExpectedOutcome | None,
        estimated: ExpectedOutcome | None,
    ) -> AsRun:
        wait = replace(
            step, name=f"cooled down to {to_C:g} °C", kind="cool-down", pause=True, cycles=None,
            expected_heat_J=0.0, sensor_end_temperature_C=to_C,
        )  # fmt: skip
        if seen.start_C is not None and seen.end_C is not None and seen.duration_s > 0.0:
            self._observe(wait, seen, 0.0, seen.start_C, seen.end_C)
        none = ExpectedOutcome(0.0, 0.0, to_C)
        return self._as_run(wait, seen, 0, True, "", 0.0, planned, estimated or none)

    def know(self, predictor: Predictor) -> None:
        """Expect of what is left what a predictor says that was not there when it was planned."""
        if self._replanner is not None:
            self._replanner.know(predictor)
            self._knows_heat = predictor.knows_heat
            self._outdated = True

    def begin(self, specimen_C: float | None, ambient_C: float | None) -> None:
        """Take what is measured at the start; what differs from the plan is planned for."""
        if self._replanner is None or specimen_C is None:
            return
        expected_C = self._left[0].start_temperature_C if self._left else specimen_C
        air_C = self._air_C if ambient_C is None else ambient_C
        other = abs(specimen_C - expected_C) > WARMER_K or abs(air_C - self._air_C) > WARMER_K
        self._air_C, self._now = air_C, Temperatures(specimen_C, specimen_C)
        self._outdated = other or bool(self._observations)

    def _as_run(
        self,
        step: PlannedStep,
        seen: StepHeat,
        cycles: int,
        complete: bool,
        run: str,
        modelled_heat_J: float,
        planned: ExpectedOutcome | None,
        estimated: ExpectedOutcome,
    ) -> AsRun:
        return AsRun(
            index=step.index,
            name=step.name,
            kind=step.kind,
            plan_hash=step.plan_hash,
            pause=step.pause,
            run=run,
            ended_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            complete=complete,
            cycles=cycles,
            duration_s=seen.duration_s,
            start_C=seen.start_C,
            end_C=seen.end_C,
            ambient_C=self._air_C,
            heat_J=seen.heat_J,
            modelled_heat_J=modelled_heat_J,
            planned=planned,
            estimated=estimated,
            heating=self.scale.heating,
            cooling=self.scale.cooling,
            left_s=self.later_s,
            planned_left_s=self.planned_later_s,
            warmed=seen.warmed,
        )

    @property
    def outdated(self) -> bool:
        """Return whether the outlook no longer holds: :meth:`look_ahead` is due before the next step."""
        return (
            self._outdated
            and not self._after_pause  # it was made for the step that comes now, with a margin
            and self._replanner is not None
            and bool(self._left)
        )

    def look_ahead(self) -> None:
        """Plan what is left anew; may take seconds, so it is for a thread of its own."""
        if self._replanner is None or self._now is None:
            return
        self._left = list(self._replanner.steps_left(self._left, self._now, self._air_C, self.scale))
        self.later_s = expected_total_s(self._left, self._policy)
        self._outlook_by, self._outdated = self.scale, False

    def _observe(
        self, step: PlannedStep, seen: StepHeat, heat_J: float, start_C: float, end_C: float
    ) -> None:
        if self._replanner is None:
            return
        follows, self._began = self._began, True
        self._observations.append(
            Observation(step.name, start_C, end_C, self._air_C, heat_J, seen.duration_s, follows=follows)
        )
        self._learn()
        self._now = end_as_measured(self._lately, self._replanner.predictor, self.scale)
        before = self._outlook_by or HeatScale()
        moved = max(
            abs(math.log(self.scale.heating / before.heating)),
            abs(math.log(self.scale.cooling / before.cooling)),
        )
        missed_K = abs(end_C - step.sensor_end_temperature_C)
        if self._outlook_by is None or moved > MOVED or missed_K > MISSED_K:
            self._outdated = True
        self._after_pause = step.pause

    def _learn(self) -> None:
        if self._replanner is not None:
            self.scale = learn_heating(self._lately, self._replanner.predictor)

    @property
    def _lately(self) -> list[Observation]:
        return self._observations[-REMEMBERED:]


def _with_their_pauses(
    steps: Sequence[PlannedStep],
) -> tuple[tuple[PlannedStep, ...], dict[str, PlannedStep]]:
    """Return the steps without the planner's pauses, and each pause by the hash of the step it waits for."""
    kept: list[PlannedStep] = []
    pauses: dict[str, PlannedStep] = {}
    waiting: PlannedStep | None = None
    for step in steps:
        if step.pause:
            waiting = step
            continue
        kept.append(step)
        if waiting is not None:
            pauses[step.plan_hash] = replace(waiting, index=step.index)
            waiting = None
    return tuple(kept), pauses


def _expected(step: PlannedStep, *, knows_heat: bool) -> ExpectedOutcome:
    moves_s = step.expected_duration_s - step.wait_s  # the wait before it has a line of its own
    return ExpectedOutcome(
        moves_s,
        None if not knows_heat and step.nobody_says_heat else step.expected_heat_J,
        step.sensor_end_temperature_C if knows_heat else None,
        step.is_open,
    )


def _heat_J(step: PlannedStep, cycles: int, *, complete: bool) -> float | None:  # noqa: N802 - the unit's capital
    """Return what the model expects of the cycles that were done [J]; None where nobody can say."""
    planned_cycles = step.cycles if step.expected_cycles is None else step.expected_cycles
    if not planned_cycles:
        return step.expected_heat_J if complete and not cycles else None
    cut_short = bool(step.stops) and step.expected_duration_s < step.duration_s
    expected_cycles = step.stops[-1].cycles_done if cut_short else float(planned_cycles)
    return step.expected_heat_J * cycles / expected_cycles if expected_cycles > 0.0 else None
