"""Makes planned steps from admitted requests: forces, heat, temperatures, disk and hash of each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from bufferstand.foundation import Harmonic, Kind, Purpose, RampTo, StaticCycles, duration_text
from bufferstand.foundation.files import content_hash
from bufferstand.protocols.campaign_file import Campaign
from bufferstand.protocols.campaign_file.step_kinds import (
    ConditioningStep,
    CoolDownStep,
    ForceCyclesStep,
    HarmonicPiece,
    HarmonicStep,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    SingleStep,
    StaticStep,
    WarmUpStep,
)
from bufferstand.protocols.planning.expansion import Request, motions_of
from bufferstand.protocols.planning.heating import LONGEST_WAIT_S, MOST_STOPS, Surroundings, Walk, Walker
from bufferstand.protocols.planning.temperature_limits import limits_of
from bufferstand.protocols.planning.warm_up_estimate import never_warm, warm_up_notes
from bufferstand.protocols.prediction import SpecimenLoading, Temperatures, force_at, peak_force, turn_changes
from bufferstand.protocols.steps import (
    ForceCycles,
    Motion,
    MotionEstimate,
    PlannedStep,
    RampToForce,
    Steadiness,
    motion_dict,
)

HASH_VERSION = 1
"""Raised when the meaning of a motion changes, so that no old run passes for a new one."""


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


SAID_STOPS = 20
"""So many stops of a step by its temperature are told one by one."""
_REACHED_K = 0.01
"""A wait is found to a millionth of its time; so near its end it has come there [K]."""


@dataclass(frozen=True)
class BeginsOffBand:
    """A step that is expected to begin beside its band: its number, and the sensor by then [°C]."""

    index: int
    request: Request
    sensor_C: float


@dataclass(frozen=True)
class NeverWarm:
    """A warm-up that cannot end: its number, why not, and what to do."""

    index: int
    request: Request
    problem: str
    remedy: str


@dataclass(frozen=True)
class _Shape:
    """What a step is, apart from its motions; fields as in
    :class:`bufferstand.protocols.steps.PlannedStep`."""

    run_kind: Kind | None = None
    prestress_mm: float | None = None
    amplitude_mm: float | None = None
    frequency_Hz: float | None = None
    peak_speed_mm_per_s: float | None = None
    proof_load: str | None = None
    steady: Steadiness | None = None
    purpose: Purpose | None = None


def _shape(step: SingleStep) -> _Shape:  # noqa: PLR0911 - one for each kind
    match step:
        case HarmonicStep():
            steady = None if step.until_steady is None else step.until_steady.criterion()
            return _Shape("harmonic", step.prestress_mm, step.amplitude_mm, *step.rate(), steady=steady)
        case StaticStep():
            run_kind: Kind = "static" if step.proof_load is None else "proof"
            return _Shape(
                run_kind,
                peak_speed_mm_per_s=step.speed_mm_per_s,
                proof_load=step.proof_load,
                purpose=step.purpose,
            )
        case ConditioningStep() | WarmUpStep():
            shape = _shape(step.as_step())
            return shape if step.record else replace(shape, run_kind=None)
        case ForceCyclesStep():
            return _Shape("static", peak_speed_mm_per_s=step.speed_mm_per_s)
        case InnerLoopsStep():
            return _Shape(
                "harmonic", frequency_Hz=step.frequency_Hz, peak_speed_mm_per_s=step.peak_speed_mm_per_s
            )
        case MotionStep() if step.record:
            sines = any(isinstance(piece, HarmonicPiece) for piece in step.piece)
            return _Shape("harmonic" if sines else "static")
        case HoldStep() if step.record:
            return _Shape("static")
    return _Shape()


class Estimator:
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
        self.too_cold: list[BeginsOffBand] = []
        """Steps that are expected to begin below their band of temperatures."""
        self.never_cool: list[BeginsOffBand] = []
        """Steps that are expected to begin above a band that ends below the air."""
        self.never_warm: list[NeverWarm] = []
        """Warm-ups that are not expected to end, by more than the model may be wrong."""

    def steps(
        self, requests: Sequence[Request], start: Temperatures | None = None
    ) -> tuple[PlannedStep, ...]:
        """Return the planned steps, each beginning as warm as the last ended.

        Parameters
        ----------
        requests : sequence of Request
            In order.
        start : Temperatures, optional
            Of the specimen at the start; by the campaign's ``[conditions]`` if not given.
        """
        start_C = self._campaign.content.conditions.start_C()
        now = start or Temperatures(start_C, start_C)
        planned = []
        for index, request in enumerate(requests, start=1):
            around = replace(self._around, test=limits_of(request.step, self._around.test))
            motions = motions_of(request.step, self._campaign.content.motion, around.limits)
            walker = Walker(around, now, compensate=request.compensate)
            wait_s = walker.cool_into(request.step.start_band())
            begins = walker.now
            self._note_beginning(index, request, wait_s, begins)
            warmth = request.step.warmth() if isinstance(request.step, WarmUpStep) else None
            heating = None if warmth is None else walker.heating(motions)
            walk = walker.walk(motions, warmth, heating)
            step = self._step(index, request, motions, walk, begins.mass_C, wait_s)
            planned.append(replace(step, heating=heating))
            if isinstance(request.step, WarmUpStep):
                self._look_at_warming(request, request.step, planned[-1], walk, begins.sensor_C)
            now = walk.end
            if walk.ended:  # the next starts when the specimen has cooled; if it cannot, at the air's
                cools_s = walk.stops[-1].wait_s
                rest_s = LONGEST_WAIT_S if cools_s is None else cools_s
                now = around.predictor.temperatures_after(now, around.ambient_C, 0.0, rest_s)
        return tuple(planned)

    def _step(
        self,
        index: int,
        request: Request,
        motions: tuple[Motion, ...],
        walk: Walk,
        start_C: float,
        wait_s: float,
    ) -> PlannedStep:
        shape = _shape(request.step)
        moves_s = sum(estimate.duration_s for estimate in walk.estimates)
        self._note(index, request, motions, walk, start_C)
        kinds = Harmonic | StaticCycles | ForceCycles
        cyclic = [motion.cycles for motion in motions if isinstance(motion, kinds)]
        warms = isinstance(request.step, WarmUpStep)
        is_open = warms and not self._around.predictor.knows_heat
        return PlannedStep(
            index=index,
            name=request.name,
            kind=request.step.kind,
            run_kind=shape.run_kind,
            place=self._campaign.place(request.number, request.nested),
            motions=motions,
            estimates=self._with_changes(motions, walk, start_C, compensate=request.compensate),
            prestress_mm=shape.prestress_mm,
            amplitude_mm=shape.amplitude_mm,
            frequency_Hz=shape.frequency_Hz,
            peak_speed_mm_per_s=shape.peak_speed_mm_per_s,
            cycles=sum(cyclic) if cyclic else None,
            expected_peak_force_kN=self._peak_force(motions, start_C, compensate=request.compensate),
            expected_heat_J=0.0 if is_open else walk.heat_J,
            start_temperature_C=start_C,
            end_temperature_C=walk.end.mass_C,
            max_temperature_C=walk.highest.mass_C,
            sensor_end_temperature_C=walk.end.sensor_C,
            sensor_max_temperature_C=walk.highest.sensor_C,
            duration_s=wait_s + moves_s,
            expected_duration_s=walk.expected_duration_s,
            disk_bytes=0 if shape.run_kind is None else self._rate.of_run(moves_s),
            stops=walk.stops,
            plan_hash=self._hash(request, motions, shape),
            proof_load=shape.proof_load,
            steady=shape.steady,
            pause=request.pause,
            purpose=shape.purpose,
            compensate=request.compensate,
            warmth=request.step.warmth() if isinstance(request.step, WarmUpStep) else None,
            expected_cycles=walk.cycles if warms and not is_open else None,
            start_band=request.step.start_band(),
            wait_s=wait_s,
            asked=request.step.asked(),
            temperature_stop_C=request.step.temperature_stop_C,
            temperature_resume_C=request.step.temperature_resume_C,
        )

    def _with_changes(
        self, motions: Sequence[Motion], walk: Walk, start_C: float, *, compensate: bool
    ) -> tuple[MotionEstimate, ...]:
        """Return the estimates with how the turns of each motion change."""
        ramp_speed, give = self._campaign.content.motion.ramp_speed_mm_per_s, self._around.give_mm_per_kN
        found, begin_C = [], start_C
        for motion, estimate in zip(motions, walk.estimates, strict=True):
            changes = turn_changes(
                self._around.predictor, motion, estimate.turns, begin_C, ramp_speed, give,
                compensate=compensate,
            )  # fmt: skip
            found.append(replace(estimate, changes=changes))
            begin_C = estimate.end_temperature_C
        return tuple(found)

    def _peak_force(
        self, motions: Sequence[Motion], temperature_C: float, *, compensate: bool
    ) -> float | None:
        """Return the greatest force that a motion is expected to bring, None if none compresses."""
        predictor, give = self._around.predictor.bounding(), self._around.give_mm_per_kN
        taken = 0.0 if compensate else give
        ramp_speed = self._campaign.content.motion.ramp_speed_mm_per_s
        forces = []
        for motion in motions:
            if predictor.known_to_mm == 0.0 and not isinstance(motion, StaticCycles | RampToForce):
                continue  # only what turns at a force is known to bring no more
            match motion:
                case Harmonic(mean_mm=mean, amplitude_mm=amplitude, frequency_Hz=frequency):
                    force = peak_force(
                        predictor, mean, amplitude, frequency, ramp_speed, temperature_C,
                        give_mm_per_kN=give, compensated=compensate,
                    )  # fmt: skip
                    forces.append(force)
                case (
                    StaticCycles(force_limit_kN=force, stroke_limit_mm=stroke)
                    | RampToForce(force_kN=force, stroke_limit_mm=stroke)
                    | ForceCycles(force_max_kN=force, stroke_limit_mm=stroke)
                ):
                    cycle = predictor.static(force, stroke, motion.speed_mm_per_s, temperature_C, taken)
                    forces.append(cycle.peak_force_kN)
                case RampTo(target_mm=target):
                    forces.append(force_at(predictor, target, motion.speed_mm_per_s, temperature_C, taken))
        return max(forces) if forces else None

    def _hash(self, request: Request, motions: Sequence[Motion], shape: _Shape) -> str:
        step = request.step
        content = self._hashing | {"motions": [motion_dict(motion) for motion in motions]}
        if step.temperature_stop_C is not None:
            content |= {"temperature_stop_C": step.temperature_stop_C}
        if isinstance(step, WarmUpStep):
            content |= {"warmth": asdict(step.warmth())}
        if band := step.start_band():
            content |= {"start_temperature_C": [band.low_C, band.high_C]}
        if shape.proof_load is not None:  # else as ever: hashes of recorded runs must stay
            content |= {"proof_load": shape.proof_load}
        if shape.steady is not None:
            content |= {"steady": asdict(shape.steady)}
        if not request.compensate:
            content |= {"compensate": False}
        same = content_hash(content)
        self._seen[same] += 1
        return content_hash({"content": same, "occurrence": self._seen[same]})

    def _note_beginning(self, index: int, request: Request, wait_s: float, begins: Temperatures) -> None:
        """Say what is expected of a step that begins in a band of temperatures."""
        band = request.step.start_band()
        if band is None:
            return
        step = f"step {index} “{request.name}”"
        if begins.sensor_C > band.high_C + _REACHED_K and band.high_C < self._around.ambient_C:
            self.never_cool.append(BeginsOffBand(index, request, begins.sensor_C))
        elif begins.sensor_C > band.high_C + _REACHED_K:
            self.notes.append(
                f"{step}: cooling to {band.high_C:g} °C ({band.text()}) is not expected within "
                f"start_timeout_s = {band.timeout_s:g}: it would give up at {begins.sensor_C:.1f} °C"
            )
        elif wait_s > 0.0:
            self.notes.append(
                f"{step}: waits about {duration_text(wait_s)} until the specimen is at or below "
                f"{band.high_C:g} °C ({band.text()})"
            )
        elif begins.sensor_C < band.low_C - _REACHED_K:
            self.too_cold.append(BeginsOffBand(index, request, begins.sensor_C))
            if not band.refuses_cold:
                self.notes.append(
                    f"{step}: {begins.sensor_C:.1f} °C expected at its start, below {band.text()}; it is run "
                    "all the same (too_cold = “run”)"
                )

    def _look_at_warming(
        self, request: Request, step: WarmUpStep, planned: PlannedStep, walk: Walk, begins_C: float
    ) -> None:
        """Say how long warming up should take, or keep that it cannot end."""
        predictor, ambient_C = self._around.predictor, self._around.ambient_C
        found = never_warm(step, walk, begins_C, ambient_C, knows_heat=predictor.knows_heat)
        if found is not None:
            self.never_warm.append(NeverWarm(planned.index, request, *found))
            return
        name = f"step {planned.index} “{planned.name}”"
        notes = warm_up_notes(step, walk, planned.heating, knows_heat=predictor.knows_heat)
        self.notes += [f"{name}: {note}" for note in notes]

    def _note(
        self, index: int, request: Request, motions: Sequence[Motion], walk: Walk, start_C: float
    ) -> None:
        test = limits_of(request.step, self._around.test)
        if isinstance(request.step, ForceCyclesStep) and self._around.predictor.known_to_mm > 0.0:
            give = self._around.give_mm_per_kN
            taken = 0.0 if request.compensate else give
            loading = SpecimenLoading(self._around.predictor, start_C, give, taken)
            between = [motion for motion in motions if isinstance(motion, ForceCycles)]
            said = [note for motion in between for note in loading.notes(motion)]
            self.notes += [f"step {index} “{request.name}”: {note}" for note in said]
        if isinstance(request.step, CoolDownStep):
            note = _cool_down_note(request.step, self._around.ambient_C)
            if note and walk.estimates[0].duration_s > 0.0:
                self.notes.append(f"step {index} “{request.name}”: {note}")
        for stop in walk.stops[:SAID_STOPS]:
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
        if (more := len(walk.stops) - SAID_STOPS) > 0:
            name, least = (
                f"step {index} “{request.name}”",
                "at least " if len(walk.stops) >= MOST_STOPS else "",
            )
            self.notes.append(f"{name}: {least}{more} more such stops are expected: let it heat less")


def _cool_down_note(step: CoolDownStep, ambient_C: float) -> str | None:
    """Return a warning for a cool-down that the air is too warm for, None if it can end."""
    if step.temperature_C > ambient_C:
        return None
    return (
        f"cooling to {step.temperature_C:g} °C cannot end in air of {ambient_C:g} °C (conditions.ambient_C): "
        f"it would give up after {step.timeout_s:g} s"
    )
