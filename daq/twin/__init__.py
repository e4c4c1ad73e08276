"""The twin beside a running campaign: a process that judges every finished cycle (docs/twin.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.twin.beside import (
        demand_known,
        twin_process,
    )
    from bufferstand.daq.twin.live_twin import (
        LiveTwin,
    )

__all__ = ["LiveTwin", "demand_known", "twin_process"]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
