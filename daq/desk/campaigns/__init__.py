"""A campaign from its start to its report: started and resumed from this computer only, watched, stopped."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.campaigns.pages import (
        Campaigns,
    )
    from bufferstand.daq.desk.campaigns.start import (
        Start,
    )

__all__ = [
    "Campaigns",
    "Start",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
