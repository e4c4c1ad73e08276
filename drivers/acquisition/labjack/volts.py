"""From a stream's bits to volts, by the constants that the maker has left in the device.

Sources: T-Series Datasheet 20.0.1 (T7) and 20.0.2 (T8): where the constants lie and what they are. A stream
gives bits, and whoever reads it applies the constants (20.0.2; ljm_constants.json, AIN#_BINARY).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RANGES_V = {
    "T7": (10.0, 1.0, 0.1, 0.01),
    "T8": (11.0, 9.768, 4.884, 2.442, 1.221),
}
"""Ranges in the order of their constants. Of a T8 there are eleven; the pages read name the first five."""
FLASH = {"T7": 0x3C4000, "T8": 0x687000}
"""Where the constants begin."""
_SET_BYTES, _T8_FIRST, _T8_RANGES = 16, 64, 11
LARGEST = 0xFFFF


@dataclass(frozen=True)
class VoltScale:
    """Constants of one input at one range: slopes [V/bit], and the bits at 0 V.

    Parameters
    ----------
    positive, negative, centre : float
        ``(bits − centre) · positive`` from the centre up, ``(centre − bits) · negative`` below it.
    """

    positive: float
    negative: float
    centre: float

    def volts(self, bits: NDArray[np.uint16]) -> NDArray[np.float32]:
        """Return the voltages of samples [V], shape (n,); 32-bit floats hold all of 16 bits."""
        above = bits.astype(np.float64) - self.centre
        return np.where(above < 0.0, -above * self.negative, above * self.positive).astype(np.float32)

    @property
    def ends(self) -> tuple[float, float]:
        """What 0 and 0xFFFF stand for [V]: there the converter is at an end."""
        low, high = self.volts(np.array([0, LARGEST], dtype=np.uint16))
        return float(low), float(high)


def flash_address(model: str, terminal: int, range_V: float) -> int:
    """Return where the constants of an input at a range lie in the device's flash."""
    number = RANGES_V[model].index(range_V)
    if model == "T7":
        return FLASH["T7"] + _SET_BYTES * number
    return FLASH["T8"] + _T8_FIRST + _SET_BYTES * (_T8_RANGES * terminal + number)


def scale_of(words: list[int]) -> VoltScale:
    """Return the constants of eight registers: positive slope, negative slope, centre, offset.

    Raises
    ------
    ValueError
        If they are none: flash that was never written, or another thing.
    """
    positive, negative, centre, _ = struct.unpack(">ffff", struct.pack(">8H", *words))
    if not (0.0 < positive < 0.01 and -0.01 < negative < 0.0 and 0.0 < centre < LARGEST):
        raise ValueError(f"slopes {positive:g} and {negative:g}, centre {centre:g}")
    return VoltScale(positive, negative, centre)
