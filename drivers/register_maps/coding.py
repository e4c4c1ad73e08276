"""Values in registers: the coding of numbers into 16-bit words, singly, in windows and in rows of samples."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

RegisterType = Literal["u16", "i16", "u32", "i32", "f32"]
WordOrder = Literal["big", "little"]
"""Which of the two registers of a 32-bit value comes first: the high word (``big``) or the low one."""

WORDS: Mapping[str, int] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}
"""Registers that a value of each type takes."""
_CODES: Mapping[str, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
DTYPES: Mapping[str, str] = {"u16": "u2", "i16": "i2", "u32": "u4", "i32": "i4", "f32": "f4"}
"""Array type of each register type."""
WHOLE_RANGES: Mapping[str, tuple[float, float]] = {
    "u16": (0.0, 65535.0),
    "i16": (-32768.0, 32767.0),
    "u32": (0.0, 2.0**32 - 1.0),
    "i32": (-(2.0**31), 2.0**31 - 1.0),
}
"""Counts that a register can hold; a float holds any."""


def encode_value(value: float, kind: str, word_order: str = "big") -> list[int]:
    """Return the registers of a value.

    Parameters
    ----------
    value : float or int
        In the register's own unit.
    kind : str
        ``u16``, ``i16``, ``u32``, ``i32`` or ``f32``.
    word_order : str
        ``big`` or ``little``.

    Returns
    -------
    list of int
        One or two unsigned 16-bit words.

    Raises
    ------
    ValueError
        If the value does not fit the type, or is no whole number where one is needed.
    """
    number: float | int = value
    if kind != "f32":
        if not float(value).is_integer():
            raise ValueError(f"{value!r} is not a whole number, {kind} needs one")
        number = int(value)
    try:
        packed = struct.pack(_CODES[kind], number)
    except (struct.error, OverflowError):
        raise ValueError(f"{value!r} does not fit {kind}") from None
    words = list(struct.unpack(f">{len(packed) // 2}H", packed))
    return words if word_order == "big" else words[::-1]


def decode_value(registers: Sequence[int], kind: str, word_order: str = "big") -> float | int:
    """Return the value that registers hold: the inverse of :func:`encode_value`.

    Raises
    ------
    ValueError
        If the number of registers is not that of the type.
    """
    if len(registers) != WORDS[kind]:
        raise ValueError(f"{kind} takes {WORDS[kind]} registers, got {len(registers)}")
    words = registers if word_order == "big" else registers[::-1]
    packed = struct.pack(f">{len(words)}H", *words)
    value: float | int = struct.unpack(_CODES[kind], packed)[0]
    return value


def to_wire(value: float, kind: str, word_order: str = "big", scale: float = 1.0) -> list[int]:
    """Return the registers of a value in its unit, where one count of the register is ``scale`` units.

    Whole-numbered registers take the nearest count.

    Raises
    ------
    ValueError
        As :func:`encode_value`.
    """
    if scale == 1.0:
        return encode_value(value, kind, word_order)
    counts = value / scale
    return encode_value(
        counts if kind == "f32" or not np.isfinite(counts) else round(counts), kind, word_order
    )


def from_wire(
    registers: Sequence[int], kind: str, word_order: str = "big", scale: float = 1.0
) -> float | int:
    """Return the value in its unit that registers hold: undoes :func:`to_wire`.

    Raises
    ------
    ValueError
        As :func:`decode_value`.
    """
    counts = decode_value(registers, kind, word_order)
    return counts if scale == 1.0 else counts * scale


def crc_of(registers: Sequence[int]) -> int:
    """Return the CRC-32 (ISO-HDLC, as zlib and Ethernet have it) of registers, each high byte first.

    Another polynomial than the CRC-16 of Modbus RTU, so that what slips through one is caught by the other.
    """
    return zlib.crc32(pack(registers))


def pack(registers: Sequence[int]) -> bytes:
    """Return registers as they are on the wire, each high byte first."""
    return struct.pack(f">{len(registers)}H", *registers)


@dataclass(frozen=True)
class RegisterPlace:
    """One typed value inside a window of registers.

    Parameters
    ----------
    name : str
    kind : str
        Register type.
    offset : int
        Registers before it in the window.
    scale : float
        Units per count.
    word_order : str
        Its own, where it differs from the window's.
    """

    name: str
    kind: str
    offset: int
    scale: float = 1.0
    word_order: str = ""

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return WORDS[self.kind]


@dataclass(frozen=True)
class Layout:
    """A window of registers as named values: a block of the map, the ring's header, one sample.

    Parameters
    ----------
    address : int
        Wire address of the window's first register (0 for a part of another window).
    words : int
        Registers in the window, those without a name included.
    places : tuple of Place
        The values, by ascending offset.
    word_order : str
        ``big`` or ``little``, for places without one of their own.
    table : str
        ``holding`` or ``input``.
    """

    address: int
    words: int
    places: tuple[RegisterPlace, ...]
    word_order: str
    table: Literal["holding", "input"] = "holding"

    def decode(self, registers: Sequence[int]) -> dict[str, float | int]:
        """Return every value of the window by name.

        Raises
        ------
        ValueError
            If the number of registers is not that of the window.
        """
        self._demand(len(registers), self.words)
        if self._coding is not None:
            return self.unpack(pack(registers))
        return {
            place.name: from_wire(
                registers[place.offset : place.offset + place.words],
                place.kind,
                place.word_order or self.word_order,
                place.scale,
            )
            for place in self.places
        }

    def unpack(self, packed: bytes) -> dict[str, float | int]:
        """Return every value of the window by name, from its bytes as they are on the wire.

        Raises
        ------
        ValueError
            If the number of bytes is not that of the window.
        """
        if self._coding is None:
            return self.decode(struct.unpack(f">{len(packed) // 2}H", packed))
        self._demand(len(packed) // 2, self.words)
        return dict(zip(self._names, self._coding.unpack(packed), strict=True))

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(place.name for place in self.places)

    @cached_property
    def _coding(self) -> struct.Struct | None:
        """How the whole window is unpacked at once; None where words are swapped or values are scaled."""
        form, at = ">", 0
        for place in self.places:
            order = place.word_order or self.word_order
            if place.scale != 1.0 or (place.words > 1 and order != "big"):
                return None
            form += f"{2 * (place.offset - at)}x{_CODES[place.kind][1:]}"
            at = place.offset + place.words
        return struct.Struct(form + f"{2 * (self.words - at)}x")

    def encode(self, values: Mapping[str, float]) -> list[int]:
        """Return the window's registers; registers without a name are 0.

        Raises
        ------
        ValueError
            If a value is missing, has no place here, or does not fit.
        """
        return list(struct.unpack(f">{self.words}H", self.pack(values)))

    def pack(self, values: Mapping[str, float]) -> bytes:
        """Return the same as bytes on the wire.

        Raises
        ------
        ValueError
            As :meth:`encode`.
        """
        if values.keys() != set(self._names):
            wrong = set(self._names).symmetric_difference(values)
            raise ValueError(f"values do not match the window: {', '.join(sorted(wrong))}")
        if self._coding is not None:
            with suppress(struct.error, OverflowError):  # what does not fit is said by name below
                return self._coding.pack(*(values[name] for name in self._names))
        registers = [0] * self.words
        for place in self.places:
            try:
                order = place.word_order or self.word_order
                words = to_wire(values[place.name], place.kind, order, place.scale)
            except ValueError as error:
                raise ValueError(f"{place.name}: {error}") from None
            registers[place.offset : place.offset + place.words] = words
        return pack(registers)

    def decode_rows(self, registers: Sequence[int], rows: int) -> dict[str, NDArray[Any]]:
        """Return each value of ``rows`` windows in a row, as an array of its own type, shape (rows,).

        Raises
        ------
        ValueError
            If the number of registers is not ``rows`` windows.
        """
        return self.unpack_rows(pack(registers), rows)

    def unpack_rows(self, packed: bytes, rows: int) -> dict[str, NDArray[Any]]:
        """Return the same from the bytes of the windows as they are on the wire.

        Raises
        ------
        ValueError
            If the number of bytes is not that of ``rows`` windows.
        """
        self._demand(len(packed) // 2, rows * self.words)
        table = np.frombuffer(packed, dtype=self._row_type, count=rows)
        columns: dict[str, NDArray[Any]] = {}
        for place in self.places:
            column = table[place.name]
            if place.words > 1 and (place.word_order or self.word_order) == "little":
                words = np.ascontiguousarray(column).view(">u2").reshape(rows, place.words)[:, ::-1]
                column = np.ascontiguousarray(words).view(">" + DTYPES[place.kind])[:, 0]
            columns[place.name] = column.astype(DTYPES[place.kind])
        return columns

    @cached_property
    def _row_type(self) -> np.dtype[np.void]:
        return np.dtype(
            {
                "names": list(self._names),
                "formats": [">" + DTYPES[place.kind] for place in self.places],
                "offsets": [2 * place.offset for place in self.places],
                "itemsize": 2 * self.words,
            }
        )

    def encode_rows(self, columns: Mapping[str, NDArray[Any]]) -> list[int]:
        """Return the registers of windows in a row from arrays of equal length (undoes :meth:`decode_rows`).

        Raises
        ------
        ValueError
            If a column is missing, lengths differ, or a value does not fit its type.
        """
        flat: list[int] = self.pack_rows(columns).ravel().tolist()
        return flat

    def pack_rows(self, columns: Mapping[str, NDArray[Any]]) -> NDArray[np.uint16]:
        """Return the same as an array of registers as they are on the wire, shape (rows, words).

        Raises
        ------
        ValueError
            As :meth:`encode_rows`.
        """
        rows = len(columns[self.places[0].name])
        table = np.zeros((rows, self.words), dtype=">u2")
        by_name = table.view(self._row_type)[:, 0]
        for place in self.places:
            column = np.asarray(columns[place.name])
            own = DTYPES[place.kind]
            with np.errstate(invalid="ignore", over="ignore"):  # what does not fit is refused below
                typed = column if column.dtype == own else column.astype(own)
            fits = typed is column or place.kind == "f32" or np.array_equal(typed, column)
            if typed.shape != (rows,) or not fits:
                raise ValueError(f"{place.name}: a value does not fit {place.kind}, or lengths differ")
            by_name[place.name] = typed
            if self.word_order == "little" and place.words > 1:
                words = table[:, place.offset : place.offset + place.words]
                words[:] = words[:, ::-1].copy()
        return table

    @staticmethod
    def _demand(got: int, wanted: int) -> None:
        if got != wanted:
            raise ValueError(f"the window has {wanted} registers, got {got}")
