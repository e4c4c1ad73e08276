"""The internal flash with the calibration constants, and the converter that they belong to.

T-Series Datasheet 20.0.1 (T7: from 0x3C4000, 41 floats; nominal values of the ±10 V range) and 20.0.2
(T8: from 0x687000, ``ain[8][11]`` at byte 64). Volts of a stream's 16 bits: below the centre
(centre − bits) × negative slope, else (bits − centre) × positive slope. The nominal constants of the T8 are
not in what was read: here its centre is 32768 and its slope the range over that; a driver has to read them.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

T7_FLASH, T8_FLASH = 0x3C4000, 0x687000
T7_RANGES_V = (10.0, 1.0, 0.1, 0.01)
T8_RANGES_V = (11.0, 9.768, 4.884, 2.442, 1.221, 0.611, 0.305, 0.153, 0.076, 0.038, 0.019)


@dataclass(frozen=True)
class CalSet:
    """``Cal_Set`` of the document."""

    positive_slope: float
    negative_slope: float
    center: float
    offset: float

    def pack(self) -> bytes:
        """Return it as it lies in flash."""
        return struct.pack(">4f", self.positive_slope, self.negative_slope, self.center, self.offset)

    def bits(self, volts: NDArray[np.float64]) -> NDArray[np.uint16]:
        """Return what the converter gives for volts; it ends at 0 and 65535."""
        rising = self.center + volts / self.positive_slope
        falling = self.center - volts / self.negative_slope
        bits = np.rint(np.where(volts >= 0.0, rising, falling))
        return np.clip(bits, 0, 0xFFFF).astype(np.uint16)


class Converter:
    """The analog part of one product: its ranges, constants and flash."""

    def __init__(self, product: int) -> None:
        self.product = product
        self.ranges_V = T7_RANGES_V if product == 7 else T8_RANGES_V
        self.flash_start = T7_FLASH if product == 7 else T8_FLASH
        self.flash = self._t7() if product == 7 else self._t8()

    def cal(self, range_V: float) -> CalSet:
        """Return the constants of a range (0: the widest)."""
        chosen = range_V or self.ranges_V[0]
        if self.product == 7:
            gain = self.ranges_V[0] / chosen
            return CalSet(0.000315805780 / gain, -0.000315805800 / gain, 33523.0, -10.586956522 / gain)
        return CalSet(chosen / 32768.0, -chosen / 32768.0, 32768.0, -chosen)

    def has_range(self, range_V: float) -> bool:
        """Whether the product has that range."""
        return range_V == 0.0 or any(abs(range_V - one) < 1e-6 * one for one in self.ranges_V)

    def nearest(self, range_V: float) -> float:
        """Return the range as the product names it."""
        return min(self.ranges_V, key=lambda one: abs(one - range_V)) if range_V else self.ranges_V[0]

    def read_flash(self, pointer: int, size: int) -> bytes | None:
        """Return bytes of flash; None outside the calibration section."""
        at = pointer - self.flash_start
        return self.flash[at : at + size] if at >= 0 and at + size <= len(self.flash) else None

    def _t7(self) -> bytes:
        high_speed = b"".join(self.cal(one).pack() for one in self.ranges_V)
        others = (13200.0, 0.0, 13200.0, 0.0, -92.6, 467.6, 1e-5, 2e-4, 1.5e-8)
        return high_speed + bytes(64) + struct.pack(">9f", *others)

    def _t8(self) -> bytes:
        each = b"".join(self.cal(one).pack() for one in self.ranges_V)
        return bytes(64) + 8 * each + bytes(1668 - 64 - 8 * len(each))
