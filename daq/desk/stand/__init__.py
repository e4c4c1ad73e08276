"""The stand before a campaign: check, zero and touch-off, slow motions, the laboratory's own checklist."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.desk.stand.checklist import (
        CHECKLIST_NAME,
        checklist_of,
        demand_id,
        demand_ticked,
    )
    from bufferstand.daq.desk.stand.pages import (
        Check,
    )

__all__ = [
    "CHECKLIST_NAME",
    "Check",
    "checklist_of",
    "demand_id",
    "demand_ticked",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
