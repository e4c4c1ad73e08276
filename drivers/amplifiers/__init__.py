"""Measuring amplifiers.

A folder for each kind, beside the time stamps and text values that they share.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.serial import (
        AmplifierDialect,
        Complain,
        Decoder,
        SerialAmplifier,
        StreamValue,
        TellingDecoder,
        resync_text,
        with_saturation,
    )
    from bufferstand.drivers.amplifiers.settings import (
        AmplifierSettings,
    )
    from bufferstand.drivers.amplifiers.text_values import (
        LineDecoder,
        decimal_counts,
    )

__all__ = [
    "AmplifierDialect",
    "AmplifierSettings",
    "Complain",
    "Decoder",
    "LineDecoder",
    "SerialAmplifier",
    "StreamValue",
    "TellingDecoder",
    "decimal_counts",
    "resync_text",
    "with_saturation",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
