"""What happened: journal, sealing, the HDF5 run file, verifying, finding; and foreign records coming in."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.content import (
        MAIN_STREAM,
        Anchor,
        Event,
        RecordingFault,
    )
    from bufferstand.recording.recorder import (
        RunRecorder,
    )

__all__ = [
    "MAIN_STREAM",
    "Anchor",
    "Event",
    "RecordingFault",
    "RunRecorder",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
