"""The kinds that become one step of the plan."""

from __future__ import annotations

from protocols.kinds.composed import MotionStep
from protocols.kinds.cyclic import ConditioningStep, HarmonicStep, InnerLoopsStep, StaticStep
from protocols.kinds.force_cycles import ForceCyclesStep
from protocols.kinds.still import CoolDownStep, HoldStep, TouchStep
from protocols.kinds.warming import WarmUpStep

SingleStep = (
    StaticStep
    | HarmonicStep
    | HoldStep
    | ConditioningStep
    | InnerLoopsStep
    | MotionStep
    | CoolDownStep
    | WarmUpStep
    | ForceCyclesStep
    | TouchStep
)
"""What becomes one step of the plan."""
