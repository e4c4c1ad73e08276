"""The campaign file as users write it: its schema, tables, kinds of steps and bounds of guard settings."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.protocols.campaign_file.guard_bounds import (
        UNSEEN_HEATING_K,
        WatchedSensors,
        demand_bounds,
    )
    from bufferstand.protocols.campaign_file.guard_table import (
        GuardActions,
        GuardTable,
        TripAction,
    )
    from bufferstand.protocols.campaign_file.schema import (
        Campaign,
        CampaignFile,
        MotionSettings,
        load_campaign,
    )
    from bufferstand.protocols.campaign_file.stroke_table import (
        StrokeTable,
    )
    from bufferstand.protocols.campaign_file.zero_table import (
        TOUCH_FORCE_MAX_KN,
        ZeroTable,
    )

__all__ = [
    "TOUCH_FORCE_MAX_KN",
    "UNSEEN_HEATING_K",
    "Campaign",
    "CampaignFile",
    "GuardActions",
    "GuardTable",
    "MotionSettings",
    "StrokeTable",
    "TripAction",
    "WatchedSensors",
    "ZeroTable",
    "demand_bounds",
    "load_campaign",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
