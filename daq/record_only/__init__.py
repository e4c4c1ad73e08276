"""Record-only mode: another controller moves the stand; here it is recorded, and limits are warned of."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.record_only.document import (
        RecordingFacts,
        recording_document,
    )
    from bufferstand.daq.record_only.session import (
        RecordingOutcome,
        RecordingProgress,
        record_devices,
    )
    from bufferstand.daq.record_only.watch import (
        RecordingWatch,
    )

__all__ = [
    "RecordingFacts",
    "RecordingOutcome",
    "RecordingProgress",
    "RecordingWatch",
    "record_devices",
    "recording_document",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
