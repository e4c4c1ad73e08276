"""A WAGO 750 node behind a Modbus TCP coupler, from its manuals' pages (docs/facts/devices.md).

What the pages say, and nothing else: input words from address 0 on, modules in their order, analog ones
before digital ones, read by function 3 or 4; constants at 0x2000 to 0x2008; 0x2010 to 0x2014 about the
coupler. The status byte of a module is not to be had over Modbus TCP.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from tests.peers.modbus_io.wire import ILLEGAL_ADDRESS, ILLEGAL_VALUE, Refused

CONSTANTS = (0x0000, 0xFFFF, 0x1234, 0xAAAA, 0x5555, 0x7FFF, 0x8000, 0x3FFF, 0x4000)
"""0x2000 … 0x2008 (manual of the coupler, table of the Modbus registers)."""
SHORT_CIRCUIT, WIRE_BREAK = -1e9, 1e9
"""What a Pt100 is said to show when its leads touch, or one is off."""


def pt100_word(celsius: float) -> int:
    """Return the process value of a 750-461 or 750-464 set to Pt100 (750-464 manual 1.0.1, table 59).

    0.1 °C per digit, two's complement; −200.0 °C below the range and with a short circuit, 850.0 °C above it
    and with a broken wire.
    """
    tenths = round(min(max(celsius, -200.0), 850.0) * 10.0)
    return tenths & 0xFFFF


def ten_volt_word(volts: float) -> int:
    """Return the process value of a 750-456, ±10 V (753-456 manual 1.2.0, table 13).

    The thirteen upper bits are the value, −10 V = 0x8000, 10 V = 0x7FF8; bit 0 is set outside of the range.
    """
    steps = round(volts * 4096.0 / 10.0)
    outside = int(not -10.0 <= volts <= 10.0)
    return ((min(max(steps, -4096), 4095) << 3) & 0xFFFF) | outside


@dataclass
class Module:
    """A module: a process word for each input, made when it is asked for."""

    words: Sequence[Callable[[], int]]


@dataclass
class WagoNode:
    """A coupler with its modules.

    Parameters
    ----------
    modules : sequence of Module
        Analog ones, from left to right.
    item : int
        Number of the coupler: 352 of a 750-352.
    """

    modules: Sequence[Module]
    item: int = 352
    unit: int = 0
    digital: list[bool] = field(default_factory=list)

    def registers(self, function: int, address: int, count: int) -> list[int]:
        """Return registers, the same by both functions."""
        del function
        if not 1 <= count <= 125:
            raise Refused(ILLEGAL_VALUE)
        image = [word() & 0xFFFF for module in self.modules for word in module.words]
        about = {0x2010: 7, 0x2011: 750, 0x2012: self.item, 0x2013: 1, 0x2014: 3}
        about |= {0x2000 + place: word for place, word in enumerate(CONSTANTS)}
        found = []
        for one in range(address, address + count):
            if one < len(image):
                found.append(image[one])
            elif one in about:
                found.append(about[one])
            else:
                raise Refused(ILLEGAL_ADDRESS)
        return found

    def bits(self, function: int, address: int, count: int) -> list[bool]:
        """Return digital inputs."""
        del function
        if address + count > len(self.digital):
            raise Refused(ILLEGAL_ADDRESS)
        return self.digital[address : address + count]
