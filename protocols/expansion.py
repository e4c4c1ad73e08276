"""From the steps that a user wrote to single steps in order, and from those to motions."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

from protocols.campaign import Campaign, MotionSettings
from protocols.kinds import (
    ConditioningStep,
    CoolDownStep,
    HarmonicPiece,
    HarmonicStep,
    HoldPiece,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    RampPiece,
    ReleasePiece,
    SingleStep,
    StaticStep,
    SweepStep,
)
from protocols.limits import Envelope
from protocols.steps import Harmonic, Hold, Motion, RampTo, RampToForce, Release, StaticCycles, WaitUntilCool

APPROACH_SHARE = 0.9
"""So much of the force of a hold is reached at the ramp's speed, the rest at the approach speed: what comes
on while the stop is on its way is small then."""
HeatOf = Callable[[HarmonicStep], float]
"""Heat that a harmonic step is expected to bring [J], for ``order = "heat"``."""


@dataclass(frozen=True)
class Request:
    """One step of the plan before it is judged: what is asked, its name, and the ``[[step]]`` it is from.

    ``may_be_left_out`` is true for a combination of a sweep with ``beyond_limits = "leave-out"``; ``stays``
    for a step that the planner must not move; ``pause`` for a wait that the planner has put in.
    """

    step: SingleStep
    name: str
    number: int
    may_be_left_out: bool = False
    stays: bool = True
    pause: bool = False


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
    if isinstance(step, InnerLoopsStep):
        means = f"{step.mean_mm[0]:g} … {step.mean_mm[-1]:g}" if len(step.mean_mm) > 1 else step.mean_mm[0]
        return f"inner loops about {means} mm"
    if isinstance(step, MotionStep):
        return f"motion of {len(step.piece)} pieces"
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
        if isinstance(step, SweepStep):
            prefix = f"{step.name}: " if step.name else ""
            leave_out = step.beyond_limits == "leave-out"
            requests += [
                Request(single, prefix + _harmonic_name(single), number, leave_out, step.stays())
                for single in expand_sweep(step, heat_of)
            ]
        else:
            requests.append(Request(step, step.name or _own_name(step), number, stays=step.stays()))
    return tuple(requests)


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
        case InnerLoopsStep():
            return (*_loops(step, motion), release)
        case MotionStep():
            return _composed(step, release, limits)
        case CoolDownStep():
            return (WaitUntilCool(step.temperature_C, step.timeout_s),)
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
