"""From the steps that a user wrote to single steps in order, and from those to motions."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

from protocols.campaign import (
    Campaign,
    CoolDownStep,
    HarmonicStep,
    HoldStep,
    MotionSettings,
    StaticStep,
    SweepStep,
)
from protocols.limits import Envelope
from protocols.steps import Harmonic, Hold, Motion, RampTo, Release, StaticCycles, WaitUntilCool

SingleStep = StaticStep | HarmonicStep | HoldStep | CoolDownStep
HeatOf = Callable[[HarmonicStep], float]
"""Heat that a harmonic step is expected to bring [J], for ``order = "heat"``."""


@dataclass(frozen=True)
class Request:
    """One step of the plan before it is judged: what is asked, its name, and the ``[[step]]`` it is from.

    ``may_be_left_out`` is true for a combination of a sweep with ``beyond_limits = "leave-out"``.
    """

    step: SingleStep
    name: str
    number: int
    may_be_left_out: bool = False


def _harmonic_name(step: HarmonicStep) -> str:
    given = f"{step.peak_speed_mm_per_s:g} mm/s" if step.frequency_Hz is None else f"{step.frequency_Hz:g} Hz"
    return f"{step.prestress_mm:g} ± {step.amplitude_mm:g} mm, {given}"


def _own_name(step: SingleStep) -> str:
    if isinstance(step, HarmonicStep):
        return _harmonic_name(step)
    if isinstance(step, StaticStep) and step.proof_load is not None:
        return f"proof load {step.proof_load}, {step.cycles} × to {step.force_limit_kN:g} kN"
    if isinstance(step, StaticStep):
        return f"static, {step.cycles} × at {step.speed_mm_per_s:g} mm/s"
    if isinstance(step, HoldStep):
        where = "zero force" if step.stroke_mm is None else f"{step.stroke_mm:g} mm"
        return f"hold at {where}"
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
            cycles=cycles,
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
                Request(single, prefix + _harmonic_name(single), number, leave_out)
                for single in expand_sweep(step, heat_of)
            ]
        else:
            requests.append(Request(step, step.name or _own_name(step), number))
    return tuple(requests)


def motions_of(step: SingleStep, motion: MotionSettings, limits: Envelope) -> tuple[Motion, ...]:
    """Return what the actuator does in a step: from zero force, back to zero force."""
    release = Release(motion.release_speed_mm_per_s)
    if isinstance(step, StaticStep):
        stroke = limits.stroke.value if step.stroke_limit_mm is None else step.stroke_limit_mm
        force = limits.force.value if step.force_limit_kN is None else step.force_limit_kN
        return (StaticCycles(step.speed_mm_per_s, force, stroke, step.cycles, step.pause_s), release)
    if isinstance(step, HarmonicStep):
        ramp = RampTo(step.prestress_mm, motion.ramp_speed_mm_per_s)
        frequency, _ = step.rate()
        return (ramp, Harmonic(step.prestress_mm, step.amplitude_mm, frequency, step.cycles), release)
    if isinstance(step, CoolDownStep):
        return (WaitUntilCool(step.temperature_C, step.timeout_s),)
    if step.stroke_mm is None:
        return (Hold(step.duration_s),)
    return (RampTo(step.stroke_mm, motion.ramp_speed_mm_per_s), Hold(step.duration_s), release)
