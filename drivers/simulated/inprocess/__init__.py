"""The simulated stand in this process and in virtual time, without wires."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.inprocess.stand import (
        open_in_process,
    )

__all__ = [
    "open_in_process",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
