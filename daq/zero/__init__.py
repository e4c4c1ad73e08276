"""The zero of a specimen: touching it, finding first contact, and keeping the result."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.zero.file import (
        keep_zero,
        store_zero,
        stored_path,
        stored_zero,
        zero_to_take,
    )
    from bufferstand.daq.zero.limits import (
        BEYOND_MM,
        BY_HAND,
        ZeroLimits,
        zero_refusal,
    )
    from bufferstand.daq.zero.touch_force import (
        met_peak_kN,
        turned_peak_kN,
    )
    from bufferstand.daq.zero.zeroing import (
        LATE_S,
        Zeroing,
        rest_zero,
    )

__all__ = [
    "BEYOND_MM",
    "BY_HAND",
    "LATE_S",
    "ZeroLimits",
    "Zeroing",
    "keep_zero",
    "met_peak_kN",
    "rest_zero",
    "store_zero",
    "stored_path",
    "stored_zero",
    "turned_peak_kN",
    "zero_refusal",
    "zero_to_take",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
