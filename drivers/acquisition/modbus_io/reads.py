"""Which requests a poll takes: what lies together is read together, holes are left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from bufferstand.drivers.acquisition.modbus_io.description import BIT_TABLES, IoTable
from bufferstand.drivers.acquisition.modbus_io.points import Place
from bufferstand.drivers.modbus import ModbusLink

MOST_BITS = 2000
"""Bits that a request may ask for (Modbus application protocol 1.1b3, 6.1)."""
_REQUEST_BYTES, _REPLY_BYTES = 8, 5
"""Bytes of a request and of a reply without its content, on a serial line: unit, function, … and CRC."""
_SILENCE_CHARACTERS = 3.5
"""Silence that ends a frame on a serial line (serial line guide 1.02, 2.5.1.1)."""


@dataclass(frozen=True)
class Read:
    """One request."""

    table: IoTable
    address: int
    count: int

    @property
    def bits(self) -> bool:
        """Whether it asks for bits."""
        return self.table in BIT_TABLES

    def line_characters(self) -> float:
        """Return how many characters it takes on a serial line, with the silences and the reply."""
        content = (self.count + 7) // 8 if self.bits else 2 * self.count
        return _REQUEST_BYTES + _REPLY_BYTES + content + 2 * _SILENCE_CHARACTERS

    def ask(self, link: ModbusLink, what: str) -> list[int]:
        """Return what lies there: registers, or 0 and 1.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        match self.table:
            case "coil" | "discrete":
                bits = link.read_bits(self.address, self.count, what, table=self.table)
                return [int(one) for one in bits]
            case _:
                return link.read(self.address, self.count, what, table=self.table)


class Image:
    """What the requests of a poll brought."""

    def __init__(self) -> None:
        self._words: dict[tuple[str, int], int] = {}

    def take(self, read: Read, words: Sequence[int]) -> None:
        """Keep the content of a request."""
        for place, word in enumerate(words):
            self._words[read.table, read.address + place] = word

    def at(self, places: Iterable[Place]) -> Mapping[Place, list[int]]:
        """Return the content of places, each as it came."""
        return {
            place: [self._words[place.table, place.address + one] for one in range(place.words)]
            for place in places
        }


def planned_reads(places: Iterable[Place], *, most_registers: int, bridge: int = 0) -> tuple[Read, ...]:
    """Return the requests that bring places, table by table and by rising address.

    A place is never split: its registers are of one instant.

    Parameters
    ----------
    places : iterable of Place
        What is wanted; may overlap, and come twice.
    most_registers : int
        Registers that one request may ask for.
    bridge : int
        Registers between two places that may be read with them.
    """
    reads: list[Read] = []
    for place in sorted(set(places), key=lambda one: (one.table, one.address, one.words)):
        most = MOST_BITS if place.table in BIT_TABLES else most_registers
        last = reads[-1] if reads else None
        end = place.address + place.words
        if (
            last is not None
            and last.table == place.table
            and place.address <= last.address + last.count + bridge
            and end - last.address <= most
        ):
            reads[-1] = Read(last.table, last.address, max(last.count, end - last.address))
        else:
            reads.append(Read(place.table, place.address, place.words))
    return tuple(reads)
