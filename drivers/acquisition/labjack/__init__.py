"""LabJack T7 and T8 on Modbus TCP: stream mode, by packets of their own or by request."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.acquisition.labjack.settings import (
        LabJackSettings,
    )

__all__ = [
    "LabJackSettings",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
