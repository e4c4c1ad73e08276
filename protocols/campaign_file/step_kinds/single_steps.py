"""The kinds that become one step of the plan."""

from __future__ import annotations

from bufferstand.protocols.campaign_file.step_kinds.cyclic import (
    ConditioningStep,
    HarmonicStep,
    InnerLoopsStep,
    StaticStep,
)
from bufferstand.protocols.campaign_file.step_kinds.force_cycles import ForceCyclesStep
from bufferstand.protocols.campaign_file.step_kinds.free_motion import MotionStep
from bufferstand.protocols.campaign_file.step_kinds.holds_and_waits import CoolDownStep, HoldStep, TouchStep
from bufferstand.protocols.campaign_file.step_kinds.warm_up import WarmUpStep

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
