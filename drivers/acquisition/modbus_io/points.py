"""Points of a description with the answers of a stand file in their places, and how they are decoded."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bufferstand.drivers.acquisition.modbus_io.description import (
    BIT_TABLES,
    WORDS,
    Description,
    Fault,
    IoTable,
    Order,
    PointEntry,
)
from bufferstand.drivers.descriptions import Answer, checked_answers
from bufferstand.foundation import BadInput

_ONE_WORD = 16


@dataclass(frozen=True)
class Place:
    """Registers (or bits) that lie together.

    Parameters
    ----------
    table : str
    address : int
        0-based, as on the wire.
    words : int
        Registers, or bits of a table of bits.
    """

    table: IoTable
    address: int
    words: int = 1


@dataclass(frozen=True)
class StatusPlace:
    """Where a status lies, and what it says with which content."""

    place: Place
    bit: int | None
    equals: int
    what: str
    valid: bool

    def says(self, words: Sequence[int]) -> bool:
        """Return whether its content says what it can say."""
        content = words[0] if self.bit is None else words[0] >> self.bit & 1
        return content == self.equals


@dataclass(frozen=True)
class Reading:
    """What a point showed.

    Parameters
    ----------
    value : float
        In its unit; NaN where it is no measurement.
    what : tuple of str
        What is wrong, where something is.
    """

    value: float
    what: tuple[str, ...] = ()


@dataclass(frozen=True)
class Point:
    """One value of a device."""

    name: str
    unit: str
    place: Place
    type: str
    word_order: Order
    byte_order: Order
    bits: tuple[int, int] | None
    sign: tuple[Place, int] | None
    scale: float
    offset: float
    range: tuple[float, float] | None
    faults: tuple[Fault, ...]
    status: tuple[StatusPlace, ...]

    @property
    def value_places(self) -> tuple[Place, ...]:
        """What its value is made of."""
        return (self.place,) if self.sign is None else (self.place, self.sign[0])

    @property
    def status_places(self) -> tuple[Place, ...]:
        """What says whether it can be believed."""
        return tuple(one.place for one in self.status)

    def raw_of(self, words: Sequence[int]) -> int | float:
        """Return the number in its registers, without the sign that lies apart.

        Parameters
        ----------
        words : sequence of int
            Its registers, each 0 … 65535 and as they came.
        """
        if self.byte_order == "little":
            words = [one >> 8 | (one & 0xFF) << 8 for one in words]
        if self.word_order == "little":
            words = words[::-1]
        whole = 0
        for word in words:
            whole = whole << _ONE_WORD | word
        if self.type == "f32":
            value: float = struct.unpack(">f", struct.pack(">I", whole))[0]
            return value
        low, high = self.bits or (0, _ONE_WORD * len(words) - 1)
        width = high - low + 1
        whole = whole >> low & (1 << width) - 1
        top = whole >> width - 1
        if self.type.startswith("i") and top:
            return whole - (1 << width)
        if self.type.startswith("sm") and top:
            return -(whole & (1 << width - 1) - 1)
        return whole

    def read(self, content: Mapping[Place, Sequence[int]]) -> Reading:
        """Return the value, or why it is none.

        Parameters
        ----------
        content : mapping of Place to sequence of int
            Registers of each of its places.
        """
        said = [one for one in self.status if one.says(content[one.place])]
        told = tuple(f"{self.name}: {one.what}" for one in said)
        if any(not one.valid for one in said):
            return Reading(math.nan, told)
        raw = self.raw_of(content[self.place])
        for fault in self.faults:
            if raw == fault.raw:
                return Reading(math.nan, (*told, f"{self.name}: {fault.what} (it shows {raw:g})"))
        if not math.isfinite(raw):
            return Reading(math.nan, (*told, f"{self.name}: its value is no number; look at its sensor"))
        if self.sign is not None and content[self.sign[0]][0] >> self.sign[1] & 1:
            raw = -raw
        value = raw * self.scale + self.offset
        if self.range is not None and not self.range[0] <= value <= self.range[1]:
            low, high = self.range
            beyond = f"{self.name}: {value:g} {self.unit} is outside of its range ({low:g} to {high:g})"
            return Reading(math.nan, (*told, beyond))
        return Reading(value, told)


def resolved_points(found: Description, answers: Mapping[str, Answer]) -> dict[str, Point]:
    """Return every point of a description by its name, the answers in their places.

    Parameters
    ----------
    found : Description
    answers : mapping of str to number or text
        Of the stand file (:func:`checked_answers`).

    Raises
    ------
    BadInput
        If an answer is missing or wrong, an address is beyond 65535, or two points have one name.
    """
    given = checked_answers(found.id, found.ask, answers)

    def answered(value: object) -> object:
        return given[value[1:]] if isinstance(value, str) and value.startswith("?") else value

    base = answered(found.base)
    assert isinstance(base, int)
    points: dict[str, Point] = {}
    for entry in found.point:
        for number in range(entry.count):
            point = _point(found, entry, number, base, answered)
            if point.name in points:
                raise BadInput(f"description “{found.id}” has two points “{point.name}”")
            points[point.name] = point
    return points


def _point(found: Description, entry: PointEntry, number: int, base: int, answered: object) -> Point:
    assert callable(answered)

    def place(table: object, address: int, step: int, words: int = 1) -> Place:
        at = address + base + step * number
        if not 0 <= at <= 0x10000 - words:
            raise BadInput(
                f"description “{found.id}” has “{entry.name}” at address {at}, which no device has",
                remedy="look at its base",
            )
        return Place(answered(table), at, words)

    sign = entry.sign
    bits = entry.table in BIT_TABLES
    return Point(
        name=entry.name.replace("{n}", str(entry.first + number)),
        unit=str(answered(entry.unit)),
        place=place(entry.table, entry.address, entry.step, WORDS[entry.type]),
        type=entry.type,
        word_order=answered(found.word_order),
        byte_order="big" if bits else answered(found.byte_order),
        bits=entry.bits,
        sign=None if sign is None else (place(sign.table, sign.address, sign.step), sign.bit),
        scale=float(answered(entry.scale)),
        offset=float(answered(entry.offset)),
        range=entry.range,
        faults=entry.fault,
        status=tuple(
            StatusPlace(place(one.table, one.address, one.step), one.bit, one.equals, one.what, one.valid)
            for one in entry.status
        ),
    )
