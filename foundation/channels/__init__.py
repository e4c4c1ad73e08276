"""Measuring channels as data: calibration, plausibility, zero."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.foundation.channels.calibration import (
        Branch,
        Calibration,
    )
    from bufferstand.foundation.channels.channel import (
        Channel,
        ChannelUncertainty,
        Plausibility,
    )
    from bufferstand.foundation.channels.plausibility import (
        ImplausibleSamples,
        PlausibilityWatch,
    )
    from bufferstand.foundation.channels.zero import (
        ChannelZero,
        Touch,
        Zero,
    )

__all__ = [
    "Branch",
    "Calibration",
    "Channel",
    "ChannelUncertainty",
    "ChannelZero",
    "ImplausibleSamples",
    "Plausibility",
    "PlausibilityWatch",
    "Touch",
    "Zero",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
