"""An RMC's 32-bit registers over Modbus: reading and writing REALs and DWORDs in either word order."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Literal

from bufferstand.drivers.controllers.rmc.addresses import RmcAddress

WordOrder = Literal["big", "little"]
Read = Callable[[int, int, str], list[int]]
"""Address on the wire, registers, and what is asked for."""
Write = Callable[[int, Sequence[int], str, bool], None]
"""Address on the wire, values, what is written, and whether it is sent once only."""


def words_of(raw: bytes, order: WordOrder) -> list[int]:
    """Return 32-bit values, high byte first, as registers in a word order."""
    words = list(struct.unpack(f">{len(raw) // 2}H", raw))
    if order == "little":
        words[0::2], words[1::2] = words[1::2], words[0::2]
    return words


def bytes_of(words: Sequence[int], order: WordOrder) -> bytes:
    """Return registers of 32-bit values as bytes, high byte first."""
    given = list(words)
    if order == "little":
        given[0::2], given[1::2] = given[1::2], given[0::2]
    return struct.pack(f">{len(given)}H", *given)


class RmcRegisters:
    """Registers by their addresses.

    Parameters
    ----------
    read, write : callable
        Of the wire; what they raise goes through.
    order : {'big', 'little'}
        Which word comes first.
    """

    def __init__(self, read: Read, write: Write, order: WordOrder) -> None:
        self._read, self._write, self.order = read, write, order

    def raw(self, at: RmcAddress, count: int, what: str) -> bytes:
        """Get values as bytes, high byte first, in one read."""
        return bytes_of(self._read(at.wire, 2 * count, what), self.order)

    def reals(self, at: RmcAddress, count: int, what: str) -> tuple[float, ...]:
        """Get REALs in one read."""
        return struct.unpack(f">{count}f", self.raw(at, count, what))

    def set_reals(self, at: RmcAddress, values: Sequence[float], what: str, *, once: bool = False) -> None:
        """Set REALs in one write.

        Parameters
        ----------
        at : RmcAddress
            Of the first.
        values : sequence of float
        what : str
            What is written, for messages.
        once : bool
            Never send it again: what it does must not be done twice.
        """
        self._write(at.wire, words_of(struct.pack(f">{len(values)}f", *values), self.order), what, once)

    def set_whole(self, at: RmcAddress, value: int, what: str) -> None:
        """Set a UDINT."""
        self._write(at.wire, words_of(struct.pack(">I", value), self.order), what, False)
