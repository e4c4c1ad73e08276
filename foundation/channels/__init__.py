"""Measuring channels as data: calibration, plausibility, zero, the stroke of several sensors."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.channels.calibration import (
        Branch,
        Calibration,
    )
    from bufferstand.foundation.channels.channel import (
        CHANNEL_UNITS,
        Channel,
        ChannelUncertainty,
        Plausibility,
        Quantity,
    )
    from bufferstand.foundation.channels.plausibility import (
        ImplausibleSamples,
        PlausibilityWatch,
    )
    from bufferstand.foundation.channels.strokes import (
        STROKE_CHANNELS,
        farthest_strokes,
        mean_of_strokes,
        tilt_of_strokes,
    )
    from bufferstand.foundation.channels.thermometers import (
        recorded_thermometers,
    )
    from bufferstand.foundation.channels.zero import (
        ChannelZero,
        Touch,
        Zero,
    )

__all__ = [
    "CHANNEL_UNITS",
    "STROKE_CHANNELS",
    "Branch",
    "Calibration",
    "Channel",
    "ChannelUncertainty",
    "ChannelZero",
    "ImplausibleSamples",
    "Plausibility",
    "PlausibilityWatch",
    "Quantity",
    "Touch",
    "Zero",
    "farthest_strokes",
    "mean_of_strokes",
    "recorded_thermometers",
    "tilt_of_strokes",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
