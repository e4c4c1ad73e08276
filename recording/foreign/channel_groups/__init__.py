"""Measurement files with groups of channels: TDMS and MDF."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.foreign.channel_groups.mdf import (
        MdfRecord,
    )
    from bufferstand.recording.foreign.channel_groups.tdms import (
        TdmsRecord,
    )

__all__ = [
    "MdfRecord",
    "TdmsRecord",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
