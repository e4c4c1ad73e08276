"""The kinds that become one step of the plan."""

from __future__ import annotations

from bufferstand.protocols.kinds.composed import MotionStep
from bufferstand.protocols.kinds.cyclic import ConditioningStep, HarmonicStep, InnerLoopsStep, StaticStep
from bufferstand.protocols.kinds.force_cycles import ForceCyclesStep
from bufferstand.protocols.kinds.still import CoolDownStep, HoldStep, TouchStep
from bufferstand.protocols.kinds.warming import WarmUpStep

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
