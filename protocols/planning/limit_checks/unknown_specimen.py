"""A specimen without known forces: which step must come before all others that move."""

from __future__ import annotations

from bufferstand.protocols.campaign_file.step_kinds import (
    ConditioningStep,
    CoolDownStep,
    HoldStep,
    SingleStep,
    StaticStep,
    TouchStep,
)
from bufferstand.protocols.planning.limit_checks.broken_limit import KNOWN, BrokenLimit

SLOW_MM_PER_S = 10.0
"""So slow at most is the first stroke of a specimen of which nothing is known: at 600 mm/s it would be 6 mm
further within 10 ms, at 10 mm/s it is a tenth of a millimetre."""


def shows_the_curve(step: SingleStep) -> bool:
    """Return whether a step is a slow stroke that is recorded: what a specimen becomes known by."""
    if isinstance(step, ConditioningStep):
        return step.record and shows_the_curve(step.as_step())
    return isinstance(step, StaticStep) and step.speed_mm_per_s <= SLOW_MM_PER_S


def too_soon(step: SingleStep) -> BrokenLimit | None:
    """Return the breach of a step that needs to know forces before any was measured."""
    waits = isinstance(step, CoolDownStep | TouchStep) or (
        isinstance(step, HoldStep) and step.stroke_mm is None and step.force_kN is None
    )
    if waits or shows_the_curve(step):
        return None
    problem = "nothing is known of the specimen's forces"
    if isinstance(step, StaticStep):
        said = f"{problem}: speed_mm_per_s = {step.speed_mm_per_s:g} mm/s is too fast for its first stroke"
        return BrokenLimit(KNOWN, said, {"speed_mm_per_s": SLOW_MM_PER_S})
    return BrokenLimit(
        KNOWN,
        problem,
        {},
        f"put a step kind = “static” at {SLOW_MM_PER_S:g} mm/s or less before it (it turns at the force "
        "limit, and shows the curve), or give the specimen a [catalogue] or a model",
    )
