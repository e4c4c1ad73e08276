"""Expands the steps of a campaign file into single steps in order, and these into motions."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

from bufferstand.foundation import Harmonic, RampTo, Release, StaticCycles
from bufferstand.protocols.campaign_file import Campaign, MotionSettings
from bufferstand.protocols.campaign_file.step_kinds import (
    ConditioningStep,
    CoolDownStep,
    ForceCyclesStep,
    HarmonicPiece,
    HarmonicStep,
    HoldPiece,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    RampPiece,
    ReleasePiece,
    RepeatStep,
    SingleStep,
    StaticStep,
    SweepStep,
    TouchStep,
    WarmUpStep,
)
from bufferstand.protocols.limits import Envelope
from bufferstand.protocols.steps import Hold, Motion, RampToForce, TouchOff, WaitUntilCool

APPROACH_SHARE = 0.9
"""So much of the force of a hold is reached at the ramp's speed, the rest at the approach speed: what comes
on while the stop is on its way is small then."""
HeatOf = Callable[[HarmonicStep], float]
"""Heat that a harmonic step is expected to bring [J], for ``order = "heat"``."""


@dataclass(frozen=True)
class Request:
    """One step of the plan before it is judged: what is asked, its name, and the ``[[step]]`` it is from.

    ``may_be_left_out`` is true for a combination of a sweep with ``beyond_limits = "leave-out"``; ``stays``
    for a step that the planner must not move; ``pause`` for a wait that the planner has put in. ``nested`` is
    the ``[[step.step]]`` of a repetition. ``compensate`` says whose strokes are asked for: the specimen's, or
    (False) the piston's.
    """

    step: SingleStep
    name: str
    number: int
    may_be_left_out: bool = False
    stays: bool = True
    pause: bool = False
    nested: int | None = None
    compensate: bool = True


def _harmonic_name(step: HarmonicStep) -> str:
    given = f"{step.peak_speed_mm_per_s:g} mm/s" if step.frequency_Hz is None else f"{step.frequency_Hz:g} Hz"
    return f"{step.prestress_mm:g} ± {step.amplitude_mm:g} mm, {given}"


def _own_name(step: SingleStep) -> str:  # noqa: PLR0911 - one for each kind
    if isinstance(step, HarmonicStep):
        return _harmonic_name(step)
    if isinstance(step, StaticStep) and step.proof_load is not None:
        return f"proof load {step.proof_load}, {step.cycles} × to {step.force_limit_kN:g} kN"
    if isinstance(step, StaticStep):
        return f"static, {step.cycles} × at {step.speed_mm_per_s:g} mm/s"
    if isinstance(step, HoldStep):
        where = "zero force"
        if step.stroke_mm is not None:
            where = f"{step.stroke_mm:g} mm"
        elif step.force_kN is not None:
            where = f"{step.force_kN:g} kN"
        return f"hold at {where}"
    if isinstance(step, ConditioningStep):
        return f"conditioning: {_own_name(step.as_step())}"
    if isinstance(step, WarmUpStep):
        return f"warm up to {step.temperature_C:g} °C"
    if isinstance(step, ForceCyclesStep):
        forces = f"{step.force_min_kN:g} … {step.force_max_kN:g} kN"
        return f"{step.cycles} × {forces} at {step.speed_mm_per_s:g} mm/s"
    if isinstance(step, InnerLoopsStep):
        means = f"{step.mean_mm[0]:g} … {step.mean_mm[-1]:g}" if len(step.mean_mm) > 1 else step.mean_mm[0]
        return f"inner loops about {means} mm"
    if isinstance(step, MotionStep):
        return f"motion of {len(step.piece)} pieces"
    if isinstance(step, TouchStep):
        return "touch off first contact"
    return f"cool down to {step.temperature_C:g} °C"


def expand_sweep(sweep: SweepStep, heat_of: HeatOf) -> tuple[HarmonicStep, ...]:
    """Return a sweep's combinations in its order: prestress outermost, frequency or speed innermost.

    ``order = "heat"`` puts what heats least first; ``"random"`` shuffles by the seed (the same on every
    machine and Python: only ``random()``, whose sequence is guaranteed, is used).
    """
    frequencies = sweep.frequency_Hz is not None
    steps = [
        HarmonicStep(
            kind="harmonic",
            prestress_mm=prestress,
            amplitude_mm=amplitude,
            frequency_Hz=rate if frequencies else None,
            peak_speed_mm_per_s=None if frequencies else rate,
            **({"cycles": cycles} if sweep.until_steady is None else {"until_steady": sweep.until_steady}),
            **sweep.temperatures(),
            compensate=sweep.compensate,
        )
        for prestress, amplitude, (rate, cycles) in product(
            sweep.prestress_mm, sweep.amplitude_mm, zip(sweep.rates(), sweep.cycle_counts(), strict=True)
        )
    ]
    if sweep.order == "heat":
        steps.sort(key=heat_of)
    elif sweep.order == "random":
        draw = random.Random(sweep.seed)
        keys = [draw.random() for _ in steps]
        steps = [step for _, step in sorted(zip(keys, steps, strict=True), key=lambda pair: pair[0])]
    return tuple(steps)


def expand(campaign: Campaign, heat_of: HeatOf) -> tuple[Request, ...]:
    """Return every single step of a campaign in the order in which it is to be run."""
    requests: list[Request] = []
    for number, step in enumerate(campaign.content.step, start=1):
        if isinstance(step, RepeatStep):
            requests += _repeated(step, number, heat_of)
        else:
            requests += _requests(step, number, heat_of)
    return tuple(_with_strokes(request, campaign) for request in requests)


def _with_strokes(request: Request, campaign: Campaign) -> Request:
    """Return a request that says whose strokes it asks for: as the step does, else as the campaign does."""
    own = request.step.compensate
    return replace(request, compensate=campaign.content.stroke.compensate if own is None else own)


def _requests(step: SingleStep | SweepStep, number: int, heat_of: HeatOf) -> list[Request]:
    if isinstance(step, SweepStep):
        prefix = f"{step.name}: " if step.name else ""
        leave_out = step.beyond_limits == "leave-out"
        return [
            Request(single, prefix + _harmonic_name(single), number, leave_out, step.stays())
            for single in expand_sweep(step, heat_of)
        ]
    return [Request(step, step.name or _own_name(step), number, stays=step.stays())]


def _repeated(repeat: RepeatStep, number: int, heat_of: HeatOf) -> list[Request]:
    """Return the steps of a repetition, each with its turn in its name; at random each turn is drawn anew."""
    found: list[Request] = []
    prefix = f"{repeat.name}: " if repeat.name else ""
    for turn in range(1, repeat.times + 1):
        for nested, step in enumerate(repeat.step, start=1):
            drawn = step
            if isinstance(step, SweepStep) and step.seed is not None:
                drawn = step.model_copy(update={"seed": step.seed + turn - 1})
            found += [
                replace(
                    one,
                    name=f"{prefix}{one.name} ({turn} of {repeat.times})",
                    nested=nested,
                    stays=one.stays or repeat.keeps_order(),
                )
                for one in _requests(drawn, number, heat_of)
            ]
    return found


def motions_of(  # noqa: PLR0911 - one for each kind
    step: SingleStep, motion: MotionSettings, limits: Envelope
) -> tuple[Motion, ...]:
    """Return what the actuator does in a step: from zero force, back to zero force."""
    release = Release(motion.release_speed_mm_per_s)
    match step:
        case StaticStep():
            stroke = limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
            force = limits.force.value if step.force_limit_kN is None else step.force_limit_kN
            return (StaticCycles(step.speed_mm_per_s, force, stroke, step.cycles, step.pause_s), release)
        case HarmonicStep():
            ramp = RampTo(step.prestress_mm, motion.ramp_speed_mm_per_s)
            return (ramp, _sine(step), release)
        case ConditioningStep():
            return motions_of(step.as_step(), motion, limits)
        case WarmUpStep():
            soak = (Hold(step.soak_s),) if step.soak_s > 0.0 else ()
            return (*motions_of(step.as_step(), motion, limits), *soak)
        case InnerLoopsStep():
            return (*_loops(step, motion), release)
        case ForceCyclesStep():
            limit_mm = limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
            return (step.motion(limit_mm), release)
        case MotionStep():
            return _composed(step, release, limits)
        case CoolDownStep():
            return (WaitUntilCool(step.temperature_C, step.timeout_s),)
        case TouchStep():
            return (TouchOff(step.touch_force_kN, step.speed_mm_per_s),)
    return _held(step, motion, release, limits)


def _sine(step: HarmonicStep) -> Harmonic:
    frequency, _ = step.rate()
    return Harmonic(step.prestress_mm, step.amplitude_mm, frequency, step.most_cycles())


def _held(step: HoldStep, motion: MotionSettings, release: Release, limits: Envelope) -> tuple[Motion, ...]:
    hold = Hold(step.duration_s)
    if step.force_kN is not None:
        speed, slow = motion.ramp_speed_mm_per_s, step.approach_speed_mm_per_s
        fast = RampToForce(APPROACH_SHARE * step.force_kN, limits.stroke.value, max(speed, slow))
        return (fast, RampToForce(step.force_kN, limits.stroke.value, slow), hold, release)
    if step.stroke_mm is None:
        return (hold,)
    return (RampTo(step.stroke_mm, motion.ramp_speed_mm_per_s), hold, release)


def _loops(step: InnerLoopsStep, motion: MotionSettings) -> list[Motion]:
    motions: list[Motion] = []
    for loop in step.loops():
        ramp = RampTo(loop.prestress_mm, motion.ramp_speed_mm_per_s)
        if ramp not in motions:
            motions.append(ramp)
        motions.append(_sine(loop))
    return motions


def _composed(step: MotionStep, release: Release, limits: Envelope) -> tuple[Motion, ...]:
    motions: list[Motion] = []
    at_mm = 0.0
    for piece in step.piece:
        made = _piece(piece, at_mm, release, limits)
        at_mm = made.end_mm(at_mm)
        motions.append(made)
    return (*motions,) if isinstance(motions[-1], Release) else (*motions, release)


def _piece(
    piece: RampPiece | HoldPiece | HarmonicPiece | ReleasePiece,
    at_mm: float,
    release: Release,
    limits: Envelope,
) -> Motion:
    match piece:
        case RampPiece(to_kN=float() as force):
            return RampToForce(force, limits.stroke.value, piece.speed_mm_per_s)
        case RampPiece():
            return RampTo(piece.to_mm or 0.0, piece.speed_mm_per_s)
        case HoldPiece():
            return Hold(piece.duration_s)
        case HarmonicPiece():
            return _sine(piece.about(at_mm))
    return release if piece.speed_mm_per_s is None else Release(piece.speed_mm_per_s)
