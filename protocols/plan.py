"""The plan: every step expanded, judged against every limit, and estimated, before anything moves.

Dry run, progress and execution read the same list of steps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from foundation.canonical import content_hash
from foundation.durations import duration_text
from foundation.errors import BadInput
from foundation.specimen import Kind, Specimen
from protocols.admissible import Breach, Judge, cool_down_note
from protocols.campaign import Campaign, CoolDownStep, HarmonicStep, HoldStep, StaticStep
from protocols.expansion import Request, SingleStep, expand, motions_of
from protocols.limits import Envelope, StandLimits, envelope
from protocols.prediction import Predictor, Temperatures, force_at, peak_force
from protocols.steps import Motion, PlannedStep, motion_dict
from protocols.thermal import LONGEST_WAIT_S, Surroundings, Walk, Walker

SCHEMA = "bufferstand/plan/1"
HASH_VERSION = 1
"""Raised when the meaning of a motion changes, so that no old run passes for a new one."""

HEADER = (
    "step", "name", "prestress mm", "amplitude mm", "frequency Hz", "peak speed mm/s", "cycles",
    "peak force kN", "heat kJ", "spring °C", "sensor °C", "duration", "disk MB",
)  # fmt: skip
"""Column heads of :meth:`Plan.rows`; temperatures are those at the step's end."""


@dataclass(frozen=True)
class DataRate:
    """What recording costs, before compression.

    Parameters
    ----------
    bytes_per_s : float
        Default: 20 bytes for each of 1000 controller samples, 12 for each of 250 of the amplifier, and the
        temperatures.
    bytes_per_run : float
        Metadata and the container.
    """

    bytes_per_s: float = 23_100.0
    bytes_per_run: float = 65_536.0

    def of_run(self, duration_s: float) -> int:
        """Return the bytes of one run of ``duration_s``."""
        return round(self.bytes_per_s * duration_s + self.bytes_per_run)


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
    """

    campaign: Campaign
    specimen: Specimen
    stand_limits: StandLimits
    limits: Envelope
    steps: tuple[PlannedStep, ...]
    notes: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        """Duration of all steps, if nothing stops them [s]."""
        return sum(step.duration_s for step in self.steps)

    @property
    def expected_duration_s(self) -> float:
        """Duration with the expected temperature stops [s]: to the one that ends it, or with the waits."""
        total = 0.0
        policy = self.campaign.limits.on_temperature_stop
        for step in self.steps:
            total += step.expected_duration_s
            ends = step.stops and (policy != "wait-and-continue" or step.stops[-1].wait_s is None)
            if ends and (policy != "skip" or step.stops[-1].wait_s is None):
                break
            if ends and step is not self.steps[-1]:
                total += step.stops[-1].wait_s or 0.0
        return total

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
            "steps": [step.as_dict() for step in self.steps],
            "totals": {
                "steps": len(self.steps),
                "duration_s": self.duration_s,
                "expected_duration_s": self.expected_duration_s,
                "heat_J": self.heat_J,
                "max_temperature_C": self.max_temperature_C,
                "disk_bytes": self.disk_bytes,
            },
            "notes": list(self.notes),
        }

    def rows(self) -> list[tuple[str, ...]]:
        """Return one row of text for each step, in the columns of :data:`HEADER`; empty where it has none."""
        return [_row(step) for step in self.steps]


def _row(step: PlannedStep) -> tuple[str, ...]:
    def number(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    return (
        str(step.index),
        step.name,
        number(step.prestress_mm, "g"),
        number(step.amplitude_mm, "g"),
        number(step.frequency_Hz, ".3g"),
        number(step.peak_speed_mm_per_s, ".4g"),
        number(step.cycles, "d"),
        number(step.expected_peak_force_kN, ".0f"),
        f"{step.expected_heat_J / 1000.0:.1f}",
        f"{step.end_temperature_C:.1f}",
        f"{step.sensor_end_temperature_C:.1f}" + (" (stop)" if step.stops else ""),
        duration_text(step.duration_s),
        f"{step.disk_bytes / 1e6:.1f}",
    )


def make_plan(
    campaign: Campaign,
    limits: StandLimits,
    predictor: Predictor,
    specimen: Specimen,
    *,
    rate: DataRate | None = None,
) -> Plan:
    """Expand, judge and estimate every step of a campaign.

    Parameters
    ----------
    campaign : Campaign
        As read by :func:`protocols.campaign.load_campaign`.
    limits : StandLimits
        From the stand file.
    predictor : Predictor
        The spring model of the specimen (:class:`protocols.prediction.ModelPredictor`).
    specimen : Specimen
        From the specimen file.
    rate : DataRate, optional
        What recording costs on disk.

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
    judge = Judge(bounds, predictor, ramp_speed, min(conditions.ambient_C, conditions.start_C()))
    if found := judge.motion_breach(campaign.content.motion):
        raise BadInput(found.problem, file=campaign.path, place="[motion]", remedy=found.remedy())

    def heat_of(step: HarmonicStep) -> float:
        frequency, _ = step.rate()
        cycle = predictor.harmonic(step.prestress_mm, step.amplitude_mm, frequency, conditions.start_C())
        return step.cycles * cycle.absorbed_energy_J

    requests, notes = _admitted(campaign, expand(campaign, heat_of), judge)
    around = Surroundings(predictor, bounds, campaign.limits, conditions.ambient_C)
    hashing = {
        "version": HASH_VERSION,
        "specimen": specimen.model_dump(mode="json"),
        "stand_limits": limits.as_dict(),
        "limits": campaign.limits.hashed(),
    }
    estimator = _Estimator(campaign, around, rate or DataRate(), hashing)
    return Plan(campaign, specimen, limits, bounds, estimator.steps(requests), (*notes, *estimator.notes))


def _admitted(
    campaign: Campaign, requests: Sequence[Request], judge: Judge
) -> tuple[list[Request], list[str]]:
    """Return the requests that keep every limit, with notes on those left out as the user allowed."""
    admitted: list[Request] = []
    notes: list[str] = []
    refused: list[tuple[int, Request, Breach]] = []
    for position, request in enumerate(requests, start=1):
        found = judge.breach(request.step)
        if found is None:
            admitted.append(request)
        elif request.may_be_left_out:
            notes.append(f"left out: “{request.name}” ({campaign.place(request.number)}): {found.problem}")
        else:
            refused.append((position, request, found))
    if refused:
        position, request, found = refused[0]
        others = f" [limits are also broken by {len(refused) - 1} more]" if len(refused) > 1 else ""
        raise BadInput(
            f"step {position} “{request.name}”: {found.problem}{others}",
            file=campaign.path,
            place=campaign.place(request.number),
            remedy=found.remedy(),
        )
    if not admitted:
        raise BadInput(
            "every step was left out as beyond the limits", file=campaign.path, remedy="check the limits"
        )
    return admitted, notes


class _Estimator:
    """Turns admitted requests into planned steps: each begins as warm as the last ended."""

    def __init__(
        self, campaign: Campaign, around: Surroundings, rate: DataRate, hashing: dict[str, Any]
    ) -> None:
        self._campaign = campaign
        self._around = around
        self._rate = rate
        self._hashing = hashing
        self._seen: Counter[str] = Counter()
        self.notes: list[str] = []

    def steps(self, requests: Sequence[Request]) -> tuple[PlannedStep, ...]:
        around = self._around
        start_C = self._campaign.content.conditions.start_C()
        now = Temperatures(start_C, start_C)
        planned = []
        for index, request in enumerate(requests, start=1):
            motions = motions_of(request.step, self._campaign.content.motion, around.limits)
            walk = Walker(around, now).walk(motions)
            planned.append(self._step(index, request, motions, walk, now.mass_C))
            now = walk.end
            if walk.ended:  # the next starts when the specimen has cooled; if it cannot, at the air's
                wait_s = walk.stops[-1].wait_s
                rest_s = LONGEST_WAIT_S if wait_s is None else wait_s
                now = around.predictor.temperatures_after(now, around.ambient_C, 0.0, rest_s)
        return tuple(planned)

    def _step(
        self, index: int, request: Request, motions: tuple[Motion, ...], walk: Walk, start_C: float
    ) -> PlannedStep:
        step = request.step
        run_kind: Kind | None = None
        prestress = amplitude = frequency = speed = None
        if isinstance(step, HarmonicStep):
            run_kind = "harmonic"
            prestress, amplitude = step.prestress_mm, step.amplitude_mm
            frequency, speed = step.rate()
        elif isinstance(step, StaticStep):
            run_kind, speed = "static" if step.proof_load is None else "proof", step.speed_mm_per_s
        proof_load = step.proof_load if isinstance(step, StaticStep) else None
        duration_s = sum(estimate.duration_s for estimate in walk.estimates)
        self._note(index, request, walk)
        return PlannedStep(
            index=index,
            name=request.name,
            kind=step.kind,
            run_kind=run_kind,
            place=self._campaign.place(request.number),
            motions=motions,
            estimates=walk.estimates,
            prestress_mm=prestress,
            amplitude_mm=amplitude,
            frequency_Hz=frequency,
            peak_speed_mm_per_s=speed,
            cycles=step.cycles if isinstance(step, StaticStep | HarmonicStep) else None,
            expected_peak_force_kN=self._peak_force(step, start_C),
            expected_heat_J=walk.heat_J,
            start_temperature_C=start_C,
            end_temperature_C=walk.end.mass_C,
            max_temperature_C=walk.highest.mass_C,
            sensor_end_temperature_C=walk.end.sensor_C,
            sensor_max_temperature_C=walk.highest.sensor_C,
            duration_s=duration_s,
            expected_duration_s=walk.expected_duration_s,
            disk_bytes=0 if run_kind is None else self._rate.of_run(duration_s),
            stops=walk.stops,
            plan_hash=self._hash(motions, proof_load),
            proof_load=proof_load,
        )

    def _peak_force(self, step: SingleStep, temperature_C: float) -> float | None:
        predictor, limits = self._around.predictor, self._around.limits
        ramp_speed = self._campaign.content.motion.ramp_speed_mm_per_s
        if isinstance(step, HarmonicStep):
            frequency, _ = step.rate()
            return peak_force(
                predictor, step.prestress_mm, step.amplitude_mm, frequency, ramp_speed, temperature_C
            )
        if isinstance(step, StaticStep):
            force = limits.force.value if step.force_limit_kN is None else step.force_limit_kN
            stroke = limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
            return predictor.static(force, stroke, step.speed_mm_per_s, temperature_C).peak_force_kN
        if isinstance(step, HoldStep) and step.stroke_mm is not None:
            return force_at(predictor, step.stroke_mm, ramp_speed, temperature_C)
        return None

    def _hash(self, motions: Sequence[Motion], proof_load: str | None) -> str:
        content = self._hashing | {"motions": [motion_dict(motion) for motion in motions]}
        if proof_load is not None:  # else as ever: hashes of recorded runs must stay
            content |= {"proof_load": proof_load}
        same = content_hash(content)
        self._seen[same] += 1
        return content_hash({"content": same, "occurrence": self._seen[same]})

    def _note(self, index: int, request: Request, walk: Walk) -> None:
        test = self._around.test
        if isinstance(request.step, CoolDownStep):
            note = cool_down_note(request.step, self._around.ambient_C)
            if note and walk.estimates[0].duration_s > 0.0:
                self.notes.append(f"step {index} “{request.name}”: {note}")
        for stop in walk.stops:
            text = (
                f"step {index} “{request.name}”: the {test.temperature_stop_C:g} °C stop is expected "
                f"{duration_text(stop.at_s)} after its start, after {stop.cycles_done:.1f} cycles; "
            )
            if stop.wait_s is None:
                text += (
                    f"in air of {self._around.ambient_C:g} °C the specimen will not cool to "
                    f"{test.temperature_resume_C:g} °C, so the campaign ends there"
                )
            else:
                cooling = (
                    f"cooling to {test.temperature_resume_C:g} °C takes about {duration_text(stop.wait_s)}"
                )
                text += {
                    "stop": f"the campaign ends there, to be resumed ({cooling})",
                    "skip": f"the rest of the step is left out ({cooling} before the next)",
                    "wait-and-continue": f"{cooling}, then the cycles left are run",
                }[test.on_temperature_stop]
            self.notes.append(text)
