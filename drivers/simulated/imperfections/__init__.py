"""What a clean simulated stand does not have and a real one does.

Drift, latency, missed cycles, coloured noise.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.imperfections.coloured_noise import (
        ColouredNoise,
    )
    from bufferstand.drivers.simulated.imperfections.drift import (
        TransducerDrift,
    )
    from bufferstand.drivers.simulated.imperfections.latency import (
        DelayedConnection,
        Latency,
    )
    from bufferstand.drivers.simulated.imperfections.missed_cycles import (
        MissedCycles,
    )

__all__ = [
    "ColouredNoise",
    "DelayedConnection",
    "Latency",
    "MissedCycles",
    "TransducerDrift",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
