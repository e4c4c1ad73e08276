"""Names, addresses and types of the registers that the emulator has.

Source: LabJack ``ljm_constants.json`` 2025.12.18 (``STREAM_DATATYPE``: T-Series Datasheet, 3.2.4).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

FORMATS = {"UINT16": ">H", "UINT32": ">I", "INT32": ">i", "FLOAT32": ">f"}


@dataclass(frozen=True)
class Register:
    """One value of the map: a name at an address; 32 bits take two registers, high word first."""

    name: str
    address: int
    kind: str
    writable: bool = False

    @property
    def words(self) -> int:
        """Registers that it takes."""
        return struct.calcsize(FORMATS[self.kind]) // 2

    def pack(self, value: float) -> bytes:
        """Return the value as it goes over the wire."""
        return struct.pack(FORMATS[self.kind], value if self.kind == "FLOAT32" else int(value))

    def unpack(self, raw: bytes) -> float:
        """Return the value that came over the wire."""
        found: float = struct.unpack(FORMATS[self.kind], raw)[0]
        return found


SCAN_LIST = 4100
SCAN_LIST_LENGTH = 128
STREAM_DATA_CR = 4500
FLASH_READ = 61812
AINS = 14
DIOS = 23

STREAM_SETTINGS = (
    Register("STREAM_SCANRATE_HZ", 4002, "FLOAT32", writable=True),
    Register("STREAM_NUM_ADDRESSES", 4004, "UINT32", writable=True),
    Register("STREAM_SAMPLES_PER_PACKET", 4006, "UINT32", writable=True),
    Register("STREAM_SETTLING_US", 4008, "FLOAT32", writable=True),
    Register("STREAM_RESOLUTION_INDEX", 4010, "UINT32", writable=True),
    Register("STREAM_BUFFER_SIZE_BYTES", 4012, "UINT32", writable=True),
    Register("STREAM_CLOCK_SOURCE", 4014, "UINT32", writable=True),
    Register("STREAM_AUTO_TARGET", 4016, "UINT32", writable=True),
    Register("STREAM_DATATYPE", 4018, "UINT32", writable=True),
    Register("STREAM_NUM_SCANS", 4020, "UINT32", writable=True),
    Register("STREAM_TRIGGER_INDEX", 4024, "UINT32", writable=True),
    Register("STREAM_AUTORECOVER_DISABLE", 4028, "UINT32", writable=True),
)
"""What a stream is set up by; none can be written while one runs (the scan list neither)."""

OTHERS = (
    Register("STREAM_START_TIME_STAMP", 4026, "UINT32"),
    Register("STREAM_ENABLE", 4990, "UINT32", writable=True),
    Register("LAST_ERR_DETAIL", 55000, "UINT16"),
    Register("TEST", 55100, "UINT32"),
    Register("TEST_UINT16", 55110, "UINT16", writable=True),
    Register("TEST_UINT32", 55120, "UINT32", writable=True),
    Register("TEST_INT32", 55122, "INT32", writable=True),
    Register("TEST_FLOAT32", 55124, "FLOAT32", writable=True),
    Register("PRODUCT_ID", 60000, "FLOAT32"),
    Register("HARDWARE_VERSION", 60002, "FLOAT32"),
    Register("FIRMWARE_VERSION", 60004, "FLOAT32"),
    Register("SERIAL_NUMBER", 60028, "UINT32"),
    Register("CORE_TIMER", 61520, "UINT32"),
    Register("SYSTEM_TIMER_20HZ", 61522, "UINT32"),
    Register("INTERNAL_FLASH_READ_POINTER", 61810, "UINT32", writable=True),
)
AIN_ALL_RANGE = Register("AIN_ALL_RANGE", 43900, "FLOAT32", writable=True)
STARTS_WITH = {
    "TEST": 0x00112233,
    "TEST_UINT16": 0x0011,
    "TEST_UINT32": 0x00112233,
    "TEST_INT32": -2003195205,
    "TEST_FLOAT32": -9999.0,
}
"""Test values after a start."""


def register_map() -> dict[int, Register]:
    """Return every register that has a value of its own, by address."""
    found = [*STREAM_SETTINGS, *OTHERS, AIN_ALL_RANGE]
    for number in range(AINS):
        found += [
            Register(f"AIN{number}", 2 * number, "FLOAT32"),
            Register(f"AIN{number}_RANGE", 40000 + 2 * number, "FLOAT32", writable=True),
            Register(f"AIN{number}_NEGATIVE_CH", 41000 + number, "UINT16", writable=True),
        ]
    found += [Register(f"DIO{number}", 2000 + number, "UINT16", writable=True) for number in range(DIOS)]
    found += [
        Register(f"STREAM_SCANLIST_ADDRESS{number}", SCAN_LIST + 2 * number, "UINT32", writable=True)
        for number in range(SCAN_LIST_LENGTH)
    ]
    return {one.address: one for one in found}
