"""From admitted requests to planned steps: forces, heat, temperatures, disk and hash of each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from foundation.canonical import content_hash
from foundation.durations import duration_text
from foundation.kind import Kind
from foundation.purpose import Purpose
from protocols.admissible import cool_down_note
from protocols.campaign import Campaign
from protocols.expansion import Request, motions_of
from protocols.kinds import (
    ConditioningStep,
    CoolDownStep,
    HarmonicPiece,
    HarmonicStep,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    SingleStep,
    StaticStep,
)
from protocols.prediction import Temperatures, force_at, peak_force
from protocols.steps import (
    Harmonic,
    Motion,
    PlannedStep,
    RampTo,
    RampToForce,
    StaticCycles,
    Steadiness,
    motion_dict,
)
from protocols.thermal import LONGEST_WAIT_S, Surroundings, Walk, Walker

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


@dataclass(frozen=True)
class _Shape:
    """What a step is, apart from its motions; fields as in :class:`protocols.steps.PlannedStep`."""

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
        case ConditioningStep():
            shape = _shape(step.as_step())
            return shape if step.record else replace(shape, run_kind=None)
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
        around = self._around
        start_C = self._campaign.content.conditions.start_C()
        now = start or Temperatures(start_C, start_C)
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
        shape = _shape(request.step)
        duration_s = sum(estimate.duration_s for estimate in walk.estimates)
        self._note(index, request, walk)
        cyclic = [motion.cycles for motion in motions if isinstance(motion, Harmonic | StaticCycles)]
        return PlannedStep(
            index=index,
            name=request.name,
            kind=request.step.kind,
            run_kind=shape.run_kind,
            place=self._campaign.place(request.number),
            motions=motions,
            estimates=walk.estimates,
            prestress_mm=shape.prestress_mm,
            amplitude_mm=shape.amplitude_mm,
            frequency_Hz=shape.frequency_Hz,
            peak_speed_mm_per_s=shape.peak_speed_mm_per_s,
            cycles=sum(cyclic) if cyclic else None,
            expected_peak_force_kN=self._peak_force(motions, start_C),
            expected_heat_J=walk.heat_J,
            start_temperature_C=start_C,
            end_temperature_C=walk.end.mass_C,
            max_temperature_C=walk.highest.mass_C,
            sensor_end_temperature_C=walk.end.sensor_C,
            sensor_max_temperature_C=walk.highest.sensor_C,
            duration_s=duration_s,
            expected_duration_s=walk.expected_duration_s,
            disk_bytes=0 if shape.run_kind is None else self._rate.of_run(duration_s),
            stops=walk.stops,
            plan_hash=self._hash(motions, shape),
            proof_load=shape.proof_load,
            steady=shape.steady,
            pause=request.pause,
            purpose=shape.purpose,
        )

    def _peak_force(self, motions: Sequence[Motion], temperature_C: float) -> float | None:
        """Return the greatest force that a motion is expected to bring, None if none compresses."""
        predictor = self._around.predictor
        ramp_speed = self._campaign.content.motion.ramp_speed_mm_per_s
        forces = []
        for motion in motions:
            match motion:
                case Harmonic(mean_mm=mean, amplitude_mm=amplitude, frequency_Hz=frequency):
                    forces.append(
                        peak_force(predictor, mean, amplitude, frequency, ramp_speed, temperature_C)
                    )
                case (
                    StaticCycles(force_limit_kN=force, stroke_limit_mm=stroke)
                    | RampToForce(force_kN=force, stroke_limit_mm=stroke)
                ):
                    cycle = predictor.static(force, stroke, motion.speed_mm_per_s, temperature_C)
                    forces.append(cycle.peak_force_kN)
                case RampTo(target_mm=target):
                    forces.append(force_at(predictor, target, motion.speed_mm_per_s, temperature_C))
        return max(forces) if forces else None

    def _hash(self, motions: Sequence[Motion], shape: _Shape) -> str:
        content = self._hashing | {"motions": [motion_dict(motion) for motion in motions]}
        if shape.proof_load is not None:  # else as ever: hashes of recorded runs must stay
            content |= {"proof_load": shape.proof_load}
        if shape.steady is not None:
            content |= {"steady": asdict(shape.steady)}
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
