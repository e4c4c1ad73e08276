"""The kinds of [[step]] of a campaign file, one module for each family."""

from __future__ import annotations

from bufferstand.protocols.campaign_file.step_kinds.common import (
    HarmonicRateStep,
    Positive,
    StepSettings,
    UntilSteady,
    as_tuple,
)
from bufferstand.protocols.campaign_file.step_kinds.cyclic import (
    ConditioningStep,
    HarmonicStep,
    InnerLoopsStep,
    StaticStep,
    SweepStep,
)
from bufferstand.protocols.campaign_file.step_kinds.force_cycles import ForceCyclesStep
from bufferstand.protocols.campaign_file.step_kinds.free_motion import (
    HarmonicPiece,
    HoldPiece,
    MotionStep,
    Piece,
    RampPiece,
    ReleasePiece,
)
from bufferstand.protocols.campaign_file.step_kinds.holds_and_waits import CoolDownStep, HoldStep, TouchStep
from bufferstand.protocols.campaign_file.step_kinds.kind_check import checked_kind
from bufferstand.protocols.campaign_file.step_kinds.repeated import NESTED_KINDS, RepeatStep
from bufferstand.protocols.campaign_file.step_kinds.single_steps import SingleStep
from bufferstand.protocols.campaign_file.step_kinds.temperatures import StepTemperatureSettings
from bufferstand.protocols.campaign_file.step_kinds.warm_up import WarmUpStep

__all__ = [
    "KINDS",
    "ConditioningStep",
    "CoolDownStep",
    "ForceCyclesStep",
    "HarmonicPiece",
    "HarmonicRateStep",
    "HarmonicStep",
    "HoldPiece",
    "HoldStep",
    "InnerLoopsStep",
    "MotionStep",
    "Piece",
    "Positive",
    "RampPiece",
    "ReleasePiece",
    "RepeatStep",
    "SingleStep",
    "StaticStep",
    "Step",
    "StepSettings",
    "StepTemperatureSettings",
    "SweepStep",
    "TouchStep",
    "UntilSteady",
    "WarmUpStep",
    "as_tuple",
    "checked_kind",
]


Step = SingleStep | SweepStep | RepeatStep
"""What ``[[step]]`` can be."""
KINDS = (*NESTED_KINDS, "repeat")
"""Kinds of ``[[step]]``."""
