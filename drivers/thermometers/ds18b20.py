"""DS18B20 readings as the Linux kernel's ``w1_slave`` file gives them, and all the ways in which they fail.

Source: DS18B20 data sheet (scratchpad, CRC), kernel documentation of w1_therm, and what is known of
counterfeit parts (docs/drivers.md).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

SCRATCHPAD_BYTES = 9
CELSIUS_PER_COUNT = 0.0625
"""Resolution at 12 bit [°C per count]."""
CONVERSION_S = 0.75
"""Time of a conversion at 12 bit [s]."""
POWER_ON_COUNT = 0x0550
"""85.0 °C: what the scratchpad holds before the first conversion."""
NO_POWER_COUNT = 0x07FF
"""127.94 °C: what a conversion without enough power leaves behind."""
LOWEST_COUNT, HIGHEST_COUNT = -55 * 16, 125 * 16
"""Range of the part, −55 … 125 °C."""

_LINE = re.compile(r"^((?:[0-9a-f]{2} ){9}): crc=([0-9a-f]{2}) (YES|NO)\s*$", re.IGNORECASE)
_POWER_ON_BYTE_6 = 0x0C


class ReadingFault(StrEnum):
    """Why a reading is none; each has its own cause."""

    ABSENT = "absent"
    EMPTY = "empty"
    CRC_REFUSED = "crc-refused"
    CRC_MISMATCH = "crc-mismatch"
    ALL_ZERO = "all-zero"
    POWER_ON = "power-on"
    NO_POWER = "no-power"
    OUT_OF_RANGE = "out-of-range"
    UNREADABLE = "unreadable"
    GARBLED = "garbled"
    SHORTED = "shorted"
    UNFINISHED = "unfinished"
    UNPOWERED = "unpowered"


FAULT_TEXTS = {
    ReadingFault.ABSENT: "not on the bus; look at plug and cable, and at the ROM in the stand file",
    ReadingFault.EMPTY: "the kernel returned an empty read (bus error or wrong CRC); "
    "look at cable length, pull-up and loose contacts",
    ReadingFault.CRC_REFUSED: "the kernel read it with a wrong CRC (“NO”); "
    "look at cable length, pull-up and interference",
    ReadingFault.CRC_MISMATCH: "its nine bytes do not match their CRC; look at cable and interference",
    ReadingFault.ALL_ZERO: "all bytes are zero, whose CRC is valid by chance; "
    "look for a short circuit of the data line",
    ReadingFault.POWER_ON: "it shows its power-on value 85.0 °C: it was reset and has not converted; "
    "look at its supply wire and loose contacts",
    ReadingFault.NO_POWER: "it shows 127.94 °C: too little power for a conversion; "
    "look at its supply wire (parasite power is not enough here)",
    ReadingFault.OUT_OF_RANGE: "its value is outside −55 … 125 °C; look at the sensor",
    ReadingFault.UNREADABLE: "its file cannot be read; look at the rights on the 1-Wire folder",
    ReadingFault.GARBLED: "its file does not look like that of a DS18B20; look at the 1-Wire folder",
    ReadingFault.SHORTED: "the data line is shorted; look at plugs and crushed cables",
    ReadingFault.UNFINISHED: "the conversion did not end in time; look at the supply wire of every sensor "
    "on the bus",
    ReadingFault.UNPOWERED: "a sensor on the bus has no supply wire (parasite power); look at its plug, "
    "use three wires, or say temperature.parasite = true",
}
"""Each fault in words: what it is and where to look."""


@dataclass(frozen=True)
class TemperatureReading:
    """A temperature that can be true: ``count``, of a DS18B20 in 1/16 °C with undefined bits cleared."""

    count: int
    resolution_bits: int | None = None


def crc8(data: bytes) -> int:
    """Return the Dallas/Maxim CRC-8 of ``data``: x⁸ + x⁵ + x⁴ + 1, reflected (0x8C), initial value 0."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x8C if crc & 1 else crc >> 1
    return crc


def decode_scratchpad(scratchpad: bytes) -> TemperatureReading | ReadingFault:
    """Return the reading that nine scratchpad bytes hold, or why they hold none.

    85.0 °C is refused only together with byte 6 = 0x0C, the power-on mark: each of them alone also occurs
    in true readings.

    Raises
    ------
    ValueError
        If there are not nine bytes.
    """
    if len(scratchpad) != SCRATCHPAD_BYTES:
        raise ValueError(f"a scratchpad has {SCRATCHPAD_BYTES} bytes, got {len(scratchpad)}")
    if not any(scratchpad):
        return ReadingFault.ALL_ZERO
    if crc8(scratchpad[:8]) != scratchpad[8]:
        return ReadingFault.CRC_MISMATCH
    raw = int.from_bytes(scratchpad[:2], "little", signed=True)
    if raw == POWER_ON_COUNT and scratchpad[6] == _POWER_ON_BYTE_6:
        return ReadingFault.POWER_ON
    if raw == NO_POWER_COUNT:
        return ReadingFault.NO_POWER
    resolution = 9 + (scratchpad[4] >> 5 & 3)
    count = raw & ~((1 << 12 - resolution) - 1)  # below 12 bits the low ones are undefined
    if not LOWEST_COUNT <= count <= HIGHEST_COUNT:
        return ReadingFault.OUT_OF_RANGE
    return TemperatureReading(count, resolution)


def decode_w1_slave(text: str) -> TemperatureReading | ReadingFault:
    """Return the reading in the text of a ``w1_slave`` file, or why it holds none.

    The bytes are decoded and checked here; the kernel's ``t=`` is not used, since it prints a number
    whatever the CRC says.
    """
    if not text.strip():
        return ReadingFault.EMPTY
    lines = text.splitlines()
    line = _LINE.match(lines[0])
    if line is None:
        return ReadingFault.GARBLED
    scratchpad = bytes.fromhex(line[1])
    if line[3].upper() == "NO":
        return ReadingFault.CRC_REFUSED
    return decode_scratchpad(scratchpad)


def decode_temperature(text: str) -> TemperatureReading | ReadingFault | None:
    """Return the reading in the text of a ``temperature`` file, why it holds none, or None if it cannot tell.

    The file has a number only [1/1000 °C, cut towards zero]: 85 °C may be the power-on value, and 0 °C an
    all-zero scratchpad. Its resolution is taken as 12 bit.
    """
    shown = text.strip()
    if not shown:
        return ReadingFault.EMPTY
    if not re.fullmatch(r"-?\d{1,6}", shown):
        return ReadingFault.GARBLED
    count = round(int(shown) * 16 / 1000)
    if count in {POWER_ON_COUNT, 0}:
        return None
    if count == NO_POWER_COUNT:
        return ReadingFault.NO_POWER
    if not LOWEST_COUNT <= count <= HIGHEST_COUNT:
        return ReadingFault.OUT_OF_RANGE
    return TemperatureReading(count, 12)


def looks_genuine(rom: str) -> bool:
    """Return whether a ROM (``28-`` and 12 hex digits, most significant first) is of the maker's pattern.

    Genuine parts have two zero bytes at the top of their serial number; others are clones, which may differ
    in accuracy, conversion time and power-on behaviour (cpetrich/counterfeit_DS18B20).
    """
    return rom[3:7] == "0000"
