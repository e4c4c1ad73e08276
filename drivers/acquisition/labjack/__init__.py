"""LabJack T7 and T8 on Modbus TCP: stream mode, by packets of their own or by request."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.acquisition.labjack.packets import (
        FUNCTION,
        HEAD_BYTES,
        TYPE,
    )
    from bufferstand.drivers.acquisition.labjack.registers import (
        AIN_NEGATIVE,
        AIN_RANGE,
        AUTO_TARGET,
        CORE_TIMER,
        ENABLE,
        FIO0,
        FIRMWARE_VERSION,
        FLASH_POINTER,
        FLASH_READ,
        LAST_ERROR,
        PRODUCT_ID,
        SAMPLES_PER_PACKET,
        SCAN_LIST,
        SCAN_RATE,
        SERIAL_NUMBER,
        SIMULATED_SERIAL,
        START_STAMP,
        TARGET_PACKETS,
        TEST,
        TEST_VALUE,
        TICKS_PER_S,
        number_of,
        words_of_number,
        words_of_real,
    )
    from bufferstand.drivers.acquisition.labjack.settings import (
        LabJackSettings,
    )
    from bufferstand.drivers.acquisition.labjack.volts import (
        FLASH,
        LARGEST,
        RANGES_V,
    )

__all__ = [
    "AIN_NEGATIVE",
    "AIN_RANGE",
    "AUTO_TARGET",
    "CORE_TIMER",
    "ENABLE",
    "FIO0",
    "FIRMWARE_VERSION",
    "FLASH",
    "FLASH_POINTER",
    "FLASH_READ",
    "FUNCTION",
    "HEAD_BYTES",
    "LARGEST",
    "LAST_ERROR",
    "PRODUCT_ID",
    "RANGES_V",
    "SAMPLES_PER_PACKET",
    "SCAN_LIST",
    "SCAN_RATE",
    "SERIAL_NUMBER",
    "SIMULATED_SERIAL",
    "START_STAMP",
    "TARGET_PACKETS",
    "TEST",
    "TEST_VALUE",
    "TICKS_PER_S",
    "TYPE",
    "LabJackSettings",
    "number_of",
    "words_of_number",
    "words_of_real",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
