"""Registers of the T series: addresses and types as LabJack publishes them.

Source: ``ljm_constants.json`` (github.com/labjack/ljm_constants); T-Series Datasheet, sections 3.1 and 3.2.4.
Registers of 32 bits have the high word first.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence

TEST = 55100
TEST_VALUE = 0x00112233
"""What TEST reads; with the words the wrong way round it is 0x22330011."""
PRODUCT_ID, HARDWARE_VERSION, FIRMWARE_VERSION, SERIAL_NUMBER = 60000, 60002, 60004, 60028
SIMULATED_SERIAL = 0x53494D55
"""Of the simulated one (“SIMU”): those of the maker begin with 470 (T7) or 480 (T8) and have nine digits."""
LAST_ERROR = 55000
"""LAST_ERR_DETAIL: the device's own number of what it refused last."""
CORE_TIMER = 61520
FLASH_POINTER, FLASH_READ = 61810, 61812
AIN_RANGE, AIN_NEGATIVE = 40000, 41000
"""Of AIN0: two registers (FLOAT32), and one (UINT16), an input."""
SINGLE_ENDED = 199
"""Negative channel of an input that is measured against ground."""
SCAN_RATE, NUMBER_OF_ADDRESSES, SAMPLES_PER_PACKET, SETTLING_US, RESOLUTION = 4002, 4004, 4006, 4008, 4010
BUFFER_BYTES, CLOCK_SOURCE, AUTO_TARGET, DATA_TYPE, NUMBER_OF_SCANS = 4012, 4014, 4016, 4018, 4020
TRIGGER, START_STAMP, RECOVERY_OFF, SCAN_LIST, ENABLE, DATA_BY_REQUEST = 4024, 4026, 4028, 4100, 4990, 4500
TARGET_PACKETS, TARGET_REQUESTS = 1, 16
"""Bits of AUTO_TARGET: to port 702, or kept for requests."""
FIO0 = 2000
"""FIO0 to FIO7, EIO0 to EIO7, CIO0 to CIO3, MIO0 to MIO2 follow each other, a register (UINT16) each."""
TICKS_PER_S = {7: 40e6}
"""CORE_TIMER runs at half the core's speed; the constants name 80 MHz for the T7, none for the T8."""

_LINES = {"FIO": 0, "EIO": 8, "CIO": 16, "MIO": 20}
_COUNT = {"FIO": 8, "EIO": 8, "CIO": 4, "MIO": 3}


def analog_input(terminal: str) -> int | None:
    """Return the number of an analog input: of AIN0 to AIN249; None of anything else."""
    found = re.fullmatch(r"AIN(\d{1,3})", terminal)
    number = int(found[1]) if found else 250
    return number if number < 250 else None


def digital_line(terminal: str) -> int | None:
    """Return the number of a digital line, FIO0 to MIO2; None of anything else."""
    found = re.fullmatch(r"(FIO|EIO|CIO|MIO)(\d)", terminal)
    if not found or int(found[2]) >= _COUNT[found[1]]:
        return None
    return _LINES[found[1]] + int(found[2])


def words_of_real(value: float) -> list[int]:
    """Return a FLOAT32 as two registers."""
    return list(struct.unpack(">HH", struct.pack(">f", value)))


def words_of_number(value: int) -> list[int]:
    """Return a UINT32 as two registers."""
    return [value >> 16, value & 0xFFFF]


def real_of(words: Sequence[int]) -> float:
    """Return two registers as FLOAT32."""
    return float(struct.unpack(">f", struct.pack(">HH", *words))[0])


def number_of(words: Sequence[int]) -> int:
    """Return two registers as UINT32."""
    return words[0] << 16 | words[1]
