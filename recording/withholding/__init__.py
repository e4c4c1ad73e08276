"""A copy of a run file for others: without what it says of the machine that recorded it."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.withholding.machine_facts import (
        WITHHELD,
        without_machine,
    )
    from bufferstand.recording.withholding.run_copy import (
        copy_without_machine,
    )

__all__ = [
    "WITHHELD",
    "copy_without_machine",
    "without_machine",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
