"""Serial ports: questions and answers with bounded waits, and what to do when a port cannot be opened."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.serial_line.line import (
        QUIET_S,
        READ_S,
        SerialLine,
        open_port,
        parity_of,
    )
    from bufferstand.drivers.serial_line.port_errors import (
        cannot_be_opened,
        is_held,
    )

__all__ = [
    "QUIET_S",
    "READ_S",
    "SerialLine",
    "cannot_be_opened",
    "is_held",
    "open_port",
    "parity_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
