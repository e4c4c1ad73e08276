"""Wiring mistakes of a simulated stand.

Signals delayed, scaled, swapped or frozen, and sensors in the wrong place.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.miswiring.settings import (
        Miswired,
    )
    from bufferstand.drivers.simulated.miswiring.stand import (
        MiswiredStand,
    )
    from bufferstand.drivers.simulated.miswiring.thermometer import (
        MisplacedThermometer,
    )

__all__ = [
    "MisplacedThermometer",
    "Miswired",
    "MiswiredStand",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
