"""From journal to run file.

Sealing, which can be repeated after any interruption, and verifying the result.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.sealing.seal_journal import (
        DAMAGED_SUFFIX,
        RUN_SUFFIX,
        is_in_use,
        seal_held,
        seal_orphans,
    )
    from bufferstand.recording.sealing.verification import (
        verify,
        verify_journal,
    )

__all__ = [
    "DAMAGED_SUFFIX",
    "RUN_SUFFIX",
    "is_in_use",
    "seal_held",
    "seal_orphans",
    "verify",
    "verify_journal",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
