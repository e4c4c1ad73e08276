"""The kinds of ``[[step]]`` of a campaign file, as users write them (docs/campaign-file.md)."""

from __future__ import annotations

from bufferstand.protocols.kinds.choosing import checked_kind
from bufferstand.protocols.kinds.common import HarmonicRateStep, Positive, StepSettings, UntilSteady, as_tuple
from bufferstand.protocols.kinds.composed import (
    HarmonicPiece,
    HoldPiece,
    MotionStep,
    Piece,
    RampPiece,
    ReleasePiece,
)
from bufferstand.protocols.kinds.cyclic import (
    ConditioningStep,
    HarmonicStep,
    InnerLoopsStep,
    StaticStep,
    SweepStep,
)
from bufferstand.protocols.kinds.force_cycles import ForceCyclesStep
from bufferstand.protocols.kinds.repeated import NESTED_KINDS, RepeatStep
from bufferstand.protocols.kinds.single import SingleStep
from bufferstand.protocols.kinds.still import CoolDownStep, HoldStep, TouchStep
from bufferstand.protocols.kinds.temperatures import StepTemperatureSettings
from bufferstand.protocols.kinds.warming import WarmUpStep

Step = SingleStep | SweepStep | RepeatStep
"""What ``[[step]]`` can be."""
KINDS = (*NESTED_KINDS, "repeat")
"""Kinds of ``[[step]]``."""

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
