"""Delta RMC75 and RMC150 by Modbus: a gateway in software between their registers and a ring controller's."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.controllers.rmc.addresses import (
        MODELS,
        PRODUCT,
        VARIABLES,
        Model,
        RmcAddress,
        parse_address,
    )
    from bufferstand.drivers.controllers.rmc.axis import (
        AxisBit,
        AxisCommand,
    )
    from bufferstand.drivers.controllers.rmc.link import (
        RmcLink,
    )
    from bufferstand.drivers.controllers.rmc.motions import (
        MotionBounds,
    )
    from bufferstand.drivers.controllers.rmc.program import (
        AT,
        TEST_VALUE,
        VARIABLES_USED,
        program_text,
    )
    from bufferstand.drivers.controllers.rmc.registers import (
        bytes_of,
        words_of,
    )
    from bufferstand.drivers.controllers.rmc.settings import (
        RmcSettings,
    )

__all__ = [
    "AT",
    "MODELS",
    "PRODUCT",
    "TEST_VALUE",
    "VARIABLES",
    "VARIABLES_USED",
    "AxisBit",
    "AxisCommand",
    "Model",
    "MotionBounds",
    "RmcAddress",
    "RmcLink",
    "RmcSettings",
    "bytes_of",
    "parse_address",
    "program_text",
    "words_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
