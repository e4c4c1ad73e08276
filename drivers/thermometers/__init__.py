"""DS18B20 temperature sensors: through the kernel's 1-Wire folder or a DS2480B serial adapter."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.thermometers.ds18b20 import (
        FAULT_TEXTS,
        HIGHEST_COUNT,
        NO_POWER_COUNT,
        POWER_ON_COUNT,
        ReadingFault,
        crc8,
        looks_genuine,
    )
    from bufferstand.drivers.thermometers.ds2480b import (
        BAUD,
        rom_bytes,
    )
    from bufferstand.drivers.thermometers.ds2480b_bus import (
        Ds2480bBus,
    )
    from bufferstand.drivers.thermometers.w1_folder import (
        W1Bus,
        roms_on_bus,
    )

__all__ = [
    "BAUD",
    "FAULT_TEXTS",
    "HIGHEST_COUNT",
    "NO_POWER_COUNT",
    "POWER_ON_COUNT",
    "Ds2480bBus",
    "ReadingFault",
    "W1Bus",
    "crc8",
    "looks_genuine",
    "rom_bytes",
    "roms_on_bus",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
