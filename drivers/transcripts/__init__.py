"""Byte transcripts of sessions with devices: reading them, and recording them between driver and device."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.transcripts.recorder import (
        record_wires,
    )

__all__ = [
    "record_wires",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
