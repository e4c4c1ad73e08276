"""The plan: every step expanded, judged against every limit, and estimated, before anything moves.

Dry run, progress and execution read the same list of steps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bufferstand.foundation import BadInput, duration_text
from bufferstand.foundation.settings import place_of, read_text
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.campaign_file import Campaign
from bufferstand.protocols.campaign_file.step_kinds import HarmonicStep
from bufferstand.protocols.limits import Envelope, StandLimits, TemperaturePolicy, envelope
from bufferstand.protocols.planning.estimate import (
    HASH_VERSION,
    DataRate,
    Estimator,
)
from bufferstand.protocols.planning.expansion import Request, expand
from bufferstand.protocols.planning.heating import LONGEST_WAIT_S, Surroundings
from bufferstand.protocols.planning.limit_checks import BrokenLimit, StepJudge, shows_the_curve
from bufferstand.protocols.planning.ordering import Ordering, put_in_order
from bufferstand.protocols.planning.start_temperature import demand_right_warmth
from bufferstand.protocols.planning.step_text import asked_text
from bufferstand.protocols.planning.temperature_limits import temperature_trouble
from bufferstand.protocols.prediction import (
    CoarsePredictor,
    HeatScale,
    LearnedPredictor,
    Predictor,
    Sine,
    Temperatures,
)
from bufferstand.protocols.steps import Hold, PlannedStep, WaitUntilCool

SCHEMA = "bufferstand/plan/1"
HEADER = (
    "step", "name", "prestress mm", "amplitude mm", "specimen mm", "piston mm", "frequency Hz",
    "peak speed mm/s", "cycles",
    "peak force kN", "heat kJ", "spring °C", "sensor °C", "duration", "disk MB",
)  # fmt: skip
"""Column heads of :meth:`Plan.rows`; temperatures are those at the step's end. The piston's sine is shown
where the specimen's is asked for, and the specimen's where the piston's is, if the machine gives way."""


@dataclass(frozen=True)
class Plan:
    """A campaign, ready to be run.

    Parameters
    ----------
    campaign : Campaign
        The file it is made of.
    specimen : Specimen
        What is tested.
    stand_limits : StandLimits
        Of the stand.
    limits : Envelope
        The narrowest of stand, campaign and specimen.
    steps : tuple of PlannedStep
        In order.
    notes : tuple of str
        What the user should know before starting: expected temperature stops, combinations left out.
    ordering : Ordering or None
        What the order "soonest" gains; None where the steps are in the given order.
    requests : tuple of Request
        What each step was made of, one for each, so that what is left can be planned anew.
    basis : tuple of str
        Where forces and heat come from, if not from a spring model.
    knows_heat : bool
        Whether temperatures are predicted; else they are those at the start, and are not shown.
    not_guarded : tuple of str
        What the stand cannot guard in this campaign, one sentence each.
    """

    campaign: Campaign
    specimen: Specimen
    stand_limits: StandLimits
    limits: Envelope
    steps: tuple[PlannedStep, ...]
    notes: tuple[str, ...]
    ordering: Ordering | None = None
    requests: tuple[Request, ...] = ()
    basis: tuple[str, ...] = ()
    knows_heat: bool = True
    not_guarded: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Duration of all steps, if nothing stops them [s]."""
        return sum(step.duration_s for step in self.steps)

    @property
    def expected_duration_s(self) -> float:
        """Duration with the expected temperature stops [s]: to the one that ends it, or with the waits."""
        return expected_total_s(self.steps, self.campaign.limits.on_temperature_stop)

    @property
    def heat_J(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Heat of all steps [J]."""
        return sum(step.expected_heat_J for step in self.steps)

    @property
    def disk_bytes(self) -> int:
        """Bytes of all runs, before compression."""
        return sum(step.disk_bytes for step in self.steps)

    @property
    def max_temperature_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Highest expected temperature of the specimen's mass [°C]."""
        return max(step.max_temperature_C for step in self.steps)

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON-ready data (``bufferstand plan --json``)."""
        return {
            "schema": SCHEMA,
            "campaign": self.campaign.as_dict(),
            "specimen": self.specimen.model_dump(mode="json"),
            "limits": {
                "stand": self.stand_limits.as_dict(),
                "test": self.campaign.limits.model_dump(mode="json"),
                "in_force": self.limits.as_dict(),
            },
            "conditions": {
                "ambient_C": self.campaign.content.conditions.ambient_C,
                "specimen_C": self.campaign.content.conditions.start_C(),
            },
            "steps": [self._step_dict(step) for step in self.steps],
            "totals": {
                "steps": len(self.steps),
                "duration_s": self.duration_s,
                "expected_duration_s": self.expected_duration_s,
                "heat_J": self.heat_J,
                "max_temperature_C": self.max_temperature_C if self.knows_heat else None,
                "disk_bytes": self.disk_bytes,
            },
            "ordering": None if self.ordering is None else self.ordering.as_dict(),
            "assumptions": list(self.assumptions),
            "notes": list(self.notes),
            "not_guarded": list(self.not_guarded),
        }

    def _step_dict(self, step: PlannedStep) -> dict[str, Any]:
        content = step.as_dict()
        return content if self.knows_heat else content | dict.fromkeys(_TEMPERATURES)

    def rows(self) -> list[tuple[str, ...]]:
        """Return one row of text for each step, in the columns of :data:`HEADER`; empty where it has none."""
        return [_row(step, knows_heat=self.knows_heat) for step in self.steps]

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the plan takes for granted because no file states it."""
        if self.limits.machine.stiffness_kN_per_mm is not None:
            return self.basis
        rigid = (
            "the machine is taken for rigid: strokes, forces and heat come out too high where it gives way "
            "(machine_stiffness_kN_per_mm in [limits] of the stand file is not stated)"
        )
        return (*self.basis, rigid)


_TEMPERATURES = (
    "end_temperature_C", "max_temperature_C", "sensor_end_temperature_C", "sensor_max_temperature_C",
)  # fmt: skip


def _row(step: PlannedStep, *, knows_heat: bool) -> tuple[str, ...]:
    def number(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    return (
        str(step.index),
        step.name,
        number(step.prestress_mm, "g"),
        number(step.amplitude_mm, "g"),
        *_sines(step),
        number(step.frequency_Hz, ".3g"),
        number(step.peak_speed_mm_per_s, ".4g"),
        _cycles_text(step),
        number(step.expected_peak_force_kN, ".0f"),
        "not known" if not knows_heat and step.nobody_says_heat else f"{step.expected_heat_J / 1000.0:.1f}",
        f"{step.end_temperature_C:.1f}" if knows_heat else "not known",
        _sensor_text(step) if knows_heat else "not known",
        duration_text(step.duration_s),
        f"{step.disk_bytes / 1e6:.1f}",
    )


def _sines(step: PlannedStep) -> tuple[str, str]:
    """Return the sine that is not asked for, in its place: the specimen's, or the piston's."""
    turns = step.turns
    if turns is None or step.amplitude_mm is None or turns.piston_upper_mm == turns.upper_mm:
        return "", ""
    if step.compensate:
        piston = Sine.between(turns.piston_lower_mm, turns.piston_upper_mm)
        return "", f"{piston.mean_mm:.1f} ± {piston.amplitude_mm:.1f}"
    specimen = Sine.between(turns.lower_mm, turns.upper_mm)
    return f"{specimen.mean_mm:.1f} ± {specimen.amplitude_mm:.1f}", ""


def _sensor_text(step: PlannedStep) -> str:
    return f"{step.sensor_end_temperature_C:.1f}" + (" (stop)" if step.stops else "")


def _cycles_text(step: PlannedStep) -> str:
    if step.cycles is None:
        return ""
    if step.is_open:
        return f"≤ {step.cycles}"
    if step.expected_cycles is not None:
        return f"≈ {step.expected_cycles:.0f}"
    return str(step.cycles) if step.steady is None else f"{step.steady.min_cycles}…{step.cycles}"


def make_plan(
    campaign: Campaign,
    limits: StandLimits,
    predictor: Predictor,
    specimen: Specimen,
    *,
    rate: DataRate | None = None,
    heating: HeatScale | None = None,
    over: Sequence[Mapping[str, Any]] = (),
) -> Plan:
    """Expand, judge and estimate every step of a campaign.

    Parameters
    ----------
    campaign : Campaign
        As read by :func:`bufferstand.protocols.campaign_file.schema.load_campaign`.
    limits : StandLimits
        From the stand file.
    predictor : Predictor
        The spring model of the specimen (:class:`bufferstand.protocols.prediction.predictor.ModelPredictor`).
    specimen : Specimen
        From the specimen file.
    rate : DataRate, optional
        What recording costs on disk.
    heating : HeatScale, optional
        What was learned of the specimen's heating from steps already run.
    over : sequence of mapping
        Steps of an earlier plan that are complete, as data: limits that were made stricter since do not
        refuse them.

    Returns
    -------
    Plan
        A temperature stop that is to be expected is said in its notes; it is no reason to refuse.

    Raises
    ------
    BadInput
        If a step breaks a limit: it names the step, the limit, who sets it and the nearest admissible value.
    """
    bounds = envelope(limits, campaign.limits, specimen)
    conditions = campaign.content.conditions
    ramp_speed = campaign.content.motion.ramp_speed_mm_per_s
    judge = StepJudge(
        bounds, predictor.bounding(), ramp_speed, min(conditions.ambient_C, conditions.start_C())
    )
    if found := judge.motion_breach(campaign.content.motion):
        key = next(iter(found.nearest))
        written = key in campaign.content.motion.model_fields_set
        said = found.problem if written else f"{found.problem} (so fast where {key} is not written)"
        path = ("motion", key) if written else ("limits", bounds.speed.name)
        place = place_of(path, read_text(campaign.path))
        raise BadInput(said, file=campaign.path, place=place, remedy=f"{found.remedy()}, under [motion]")

    def heat_of(step: HarmonicStep) -> float:
        frequency, _ = step.rate()
        cycle = predictor.harmonic(step.prestress_mm, step.amplitude_mm, frequency, conditions.start_C())
        return step.most_cycles() * cycle.absorbed_energy_J

    requests, notes, done = _admitted(campaign, expand(campaign, heat_of), judge, over)
    thermal = predictor if heating is None else LearnedPredictor(predictor, heating)
    hashing = {
        "version": HASH_VERSION,
        "specimen": specimen.model_dump(mode="json"),
        "stand_limits": limits.hashed(),
        "limits": campaign.limits.hashed(),
    }

    def estimator(predicted: Predictor) -> Estimator:
        around = Surroundings(predicted, bounds, campaign.limits, conditions.ambient_C)
        return Estimator(campaign, around, rate or DataRate(), hashing)

    put = None
    coarse = CoarsePredictor(thermal)
    if campaign.content.plan.order == "soonest":
        start = Temperatures(conditions.start_C(), conditions.start_C())
        around = Surroundings(coarse, bounds, campaign.limits, conditions.ambient_C)
        put = put_in_order(requests, campaign, around, start)
    final = estimator(thermal)
    chosen = tuple(requests) if put is None else put.chosen
    steps = final.steps(chosen)
    demand_right_warmth(campaign, final, done)
    ordering = None
    if put is not None:
        ordering = Ordering(
            method=put.method,
            tried=put.tried,
            given_s=_with_waits_s(estimator(coarse).steps(requests)),
            given_paused_s=_with_waits_s(estimator(coarse).steps(put.given)),
            chosen_s=_with_waits_s(steps),
            pauses_s=sum(step.duration_s for step in steps if _only_waits(step)),
        )
    return Plan(
        campaign,
        specimen,
        limits,
        bounds,
        steps,
        (*notes, *final.notes),
        ordering,
        chosen,
        predictor.assumptions,
        predictor.knows_heat,
    )


def expected_total_s(steps: Sequence[PlannedStep], policy: TemperaturePolicy) -> float:
    """Return how long steps should take [s]: to the temperature stop that ends them, or with the waits.

    Parameters
    ----------
    steps : sequence of PlannedStep
        In order.
    policy : str
        ``on_temperature_stop`` of the campaign.
    """
    total_s = 0.0
    for step in steps:
        total_s += step.expected_duration_s
        ends = step.stops and (policy != "wait-and-continue" or step.stops[-1].wait_s is None)
        if ends and (policy != "skip" or step.stops[-1].wait_s is None):
            break
        if ends and step is not steps[-1]:
            total_s += step.stops[-1].wait_s or 0.0
    return total_s


def _only_waits(step: PlannedStep) -> bool:
    return all(isinstance(motion, Hold | WaitUntilCool) for motion in step.motions)


def _with_waits_s(steps: Sequence[PlannedStep]) -> float:
    """Return how long steps take until all are through, with what a stop that ends one waits for [s]."""
    total_s = 0.0
    for step in steps:
        total_s += step.expected_duration_s
        if step.stops and step.expected_duration_s < step.duration_s:
            wait_s = step.stops[-1].wait_s
            total_s += LONGEST_WAIT_S if wait_s is None else wait_s
    return total_s


def _over(requests: Sequence[Request], over: Sequence[Mapping[str, Any]]) -> list[Request]:
    """Return the requests that ask for what steps that are over asked for, each of these once."""
    left = Counter(asked_text(step.get("asked"), compensate=step.get("compensate")) for step in over)
    found = []
    for request in requests:
        text = asked_text(request.step.asked(), compensate=request.compensate)
        if left[text] > 0:
            left[text] -= 1
            found.append(request)
    return found


def _admitted(
    campaign: Campaign, requests: Sequence[Request], judge: StepJudge, over: Sequence[Mapping[str, Any]]
) -> tuple[list[Request], list[str], list[Request]]:
    """Return the requests that keep every limit, notes on those left out as the user allowed, those over."""
    done = _over(requests, over)
    for request in requests:
        if any(request is one for one in done):
            continue
        if trouble := temperature_trouble(request.step, campaign.limits):
            problem, remedy = trouble
            place = campaign.place(request.number, request.nested)
            raise BadInput(f"“{request.name}”: {problem}", file=campaign.path, place=place, remedy=remedy)
    admitted: list[Request] = []
    notes: list[str] = []
    refused: list[tuple[int, Request, BrokenLimit]] = []
    stroke_done = False
    for position, request in enumerate(requests, start=1):
        found = judge.of(request, stroke_done=stroke_done).breach(request.step)
        stroke_done = stroke_done or shows_the_curve(request.step)
        if found is None:
            admitted.append(request)
        elif any(request is one for one in done):
            admitted.append(request)
            notes.append(f"step {position} “{request.name}” is complete, under other limits: {found.problem}")
        elif request.may_be_left_out:
            place = campaign.place(request.number, request.nested)
            notes.append(f"left out: “{request.name}” ({place}): {found.problem}")
        else:
            refused.append((position, request, found))
    if refused:
        position, request, found = refused[0]
        # A step that is repeated is one that is to be mended, however many turns it has.
        written = {(one.number, one.nested) for _, one, _ in refused}
        more = f"{len(written) - 1} more step{'s' * (len(written) > 2)} of the file"
        others = f" [limits are also broken by {more}]" if len(written) > 1 else ""
        raise BadInput(
            f"step {position} “{request.name}”: {found.problem}{others}",
            file=campaign.path,
            place=campaign.place(request.number, request.nested),
            remedy=found.remedy(),
        )
    if not admitted:
        raise BadInput(
            "every step was left out as beyond the limits", file=campaign.path, remedy="check the limits"
        )
    return admitted, notes, done
