"""Amplifiers and sensors with Modbus registers, described by a map."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.amplifiers.modbus.amplifier import (
        ModbusAmplifier,
    )

__all__ = [
    "ModbusAmplifier",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
