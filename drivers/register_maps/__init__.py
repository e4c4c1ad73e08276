"""Register maps as data.

Coding of values in 16-bit registers, maps of controllers (profiles/) and of amplifiers (amplifier_maps/).
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.register_maps.amplifier_map import (
        AmplifierMap,
        AmplifierRegister,
        load_amplifier_map,
        status_texts,
    )
    from bufferstand.drivers.register_maps.coding import (
        DTYPES,
        WHOLE_RANGES,
        Layout,
        RegisterType,
        crc_of,
        decode_value,
        encode_value,
        pack,
    )
    from bufferstand.drivers.register_maps.profile import (
        ASKED,
        CHECK,
        COMMAND,
        IDENTITY,
        LIMITS,
        MAX_READ,
        OPTIONAL_REGISTERS,
        POLLED_REGISTERS,
        RING_REGISTERS,
        SHIPPED,
        SIMULATED,
        SIMULATED_SIGN,
        STATUS,
        WATCHDOG_LEFT,
        Profile,
        ProfileFile,
        ProfileRegister,
        Ring,
        load_profile,
    )
    from bufferstand.drivers.register_maps.sampled_channels import (
        REQUIRED_CHANNELS,
        hole_in_strokes,
        missing_channels,
        quantity_of,
        unknown_name,
    )

__all__ = [
    "ASKED",
    "CHECK",
    "COMMAND",
    "DTYPES",
    "IDENTITY",
    "LIMITS",
    "MAX_READ",
    "OPTIONAL_REGISTERS",
    "POLLED_REGISTERS",
    "REQUIRED_CHANNELS",
    "RING_REGISTERS",
    "SHIPPED",
    "SIMULATED",
    "SIMULATED_SIGN",
    "STATUS",
    "WATCHDOG_LEFT",
    "WHOLE_RANGES",
    "AmplifierMap",
    "AmplifierRegister",
    "Layout",
    "Profile",
    "ProfileFile",
    "ProfileRegister",
    "RegisterType",
    "Ring",
    "crc_of",
    "decode_value",
    "encode_value",
    "hole_in_strokes",
    "load_amplifier_map",
    "load_profile",
    "missing_channels",
    "pack",
    "quantity_of",
    "status_texts",
    "unknown_name",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
