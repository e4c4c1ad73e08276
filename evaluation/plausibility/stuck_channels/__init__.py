"""Channels that repeat or keep a value: clipping, freezing and held samples."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.stuck_channels.clipping import (
        clipped,
    )
    from bufferstand.evaluation.plausibility.stuck_channels.freezing import (
        frozen,
    )
    from bufferstand.evaluation.plausibility.stuck_channels.held_samples import (
        held,
    )

__all__ = [
    "clipped",
    "frozen",
    "held",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
