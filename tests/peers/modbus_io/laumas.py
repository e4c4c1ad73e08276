"""A Laumas weighing transmitter (TLU, LCB, TLB family), from its manuals' pages (docs/facts/devices.md).

Functions 3 and 16, at most 32 registers a request (TLU manual p. 30); register 40008 is the high half of the
gross weight, 40009 the low one, 40010 and 40011 the net weight; 40007 the status. Weights are positive whole
numbers without the decimal point, their signs are bits 7 and 8 of the status (LCB manual p. 3).
"""

from __future__ import annotations

from dataclasses import dataclass

from tests.peers.modbus_io.wire import ILLEGAL_ADDRESS, ILLEGAL_FUNCTION, ILLEGAL_VALUE, Refused

MOST_REGISTERS = 32
CELL_ERROR, CONVERTER_ERROR, OVER_MAXIMUM, OVER_110 = 0, 1, 2, 3
GROSS_NEGATIVE, NET_NEGATIVE, STABLE = 7, 8, 11


@dataclass
class Transmitter:
    """One, with what lies on its scale.

    Parameters
    ----------
    gross, net : int
        Weights in divisions, signed.
    faults : set of int
        Bits of the status that are set besides.
    """

    gross: int = 0
    net: int = 0
    faults: frozenset[int] = frozenset()
    unit: int = 1

    def registers(self, function: int, address: int, count: int) -> list[int]:
        """Return holding registers."""
        if function != 3:
            raise Refused(ILLEGAL_FUNCTION)
        if not 1 <= count <= MOST_REGISTERS:
            raise Refused(ILLEGAL_VALUE)
        status = sum(1 << bit for bit in self.faults)
        status |= int(self.gross < 0) << GROSS_NEGATIVE | int(self.net < 0) << NET_NEGATIVE
        gross, net = abs(self.gross), abs(self.net)
        # 40001 … 40016, by the table of the registers.
        content = [103, 4, 2018, 77, 1, 0, status, gross >> 16, gross & 0xFFFF, net >> 16, net & 0xFFFF]
        content += [0, 0, 0, 0, 0]
        if address + count > len(content):
            raise Refused(ILLEGAL_ADDRESS)
        return content[address : address + count]

    def bits(self, function: int, address: int, count: int) -> list[bool]:
        """Refuse: it knows no bits."""
        del function, address, count
        raise Refused(ILLEGAL_FUNCTION)
