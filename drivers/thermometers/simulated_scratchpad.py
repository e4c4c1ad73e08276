"""What a simulated DS18B20 holds in its scratchpad, and what the kernel makes of it."""

from __future__ import annotations

from bufferstand.drivers.thermometers.ds18b20 import crc8

_POWER_ON_BYTE_6 = 0x0C


def scratchpad(counts: int, *, power_on: bool = False) -> bytes:
    """Return the nine bytes of a DS18B20's scratchpad at 12 bit.

    Parameters
    ----------
    counts : int
        Temperature in 1/16 °C.
    power_on : bool
        Whether no conversion has been made yet: byte 6 of a genuine part tells it from a true 85 °C.
    """
    low, high = counts & 0xFF, counts >> 8 & 0xFF
    byte_6 = _POWER_ON_BYTE_6 if power_on else 0x10 - (low & 0x0F)
    data = bytes((low, high, 0x4B, 0x46, 0x7F, 0xFF, byte_6, 0x10))
    return data + bytes((crc8(data),))


def slave_text(data: bytes) -> str:
    """Return what the kernel shows as ``w1_slave`` for a scratchpad."""
    shown = " ".join(f"{byte:02x}" for byte in data)
    valid = "YES" if crc8(data[:8]) == data[8] else "NO"
    return f"{shown} : crc={data[8]:02x} {valid}\n{shown} t={millidegrees(data)}\n"


def millidegrees(data: bytes) -> int:
    """Return the temperature of a scratchpad in 1/1000 °C as the kernel computes it, towards zero."""
    counts = int.from_bytes(data[:2], "little", signed=True)
    return int(counts * 1000 / 16)
