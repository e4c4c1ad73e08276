"""The stand check: read every device once; find what does not answer, is stale or cannot be true."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.check.devices import (
        check_recording,
        check_stand,
    )
    from bufferstand.drivers.check.foreign import (
        known_devices,
        probe,
    )
    from bufferstand.drivers.check.rows import (
        CheckRow,
    )
    from bufferstand.drivers.check.verdict import (
        WATCH_S,
        Verdict,
    )

__all__ = [
    "WATCH_S",
    "CheckRow",
    "Verdict",
    "check_recording",
    "check_stand",
    "known_devices",
    "probe",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
