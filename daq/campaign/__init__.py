"""Running a campaign: sessions on the stand, step by step, from the opening to the safe end."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.campaign.campaign_runner import (
        CampaignOutcome,
        run_campaign,
    )
    from bufferstand.daq.campaign.run_settings import (
        RunSettings,
    )
    from bufferstand.daq.campaign.stroke_forecast import (
        HEADER,
        outlook_rows,
        reached_rows,
        stroke_outlook,
    )
    from bufferstand.daq.campaign.until_known import (
        HOURS,
        MOST_HOURS,
        MOST_ROUNDS,
        ROUNDS,
        UntilKnown,
        until_of,
    )

__all__ = [
    "HEADER",
    "HOURS",
    "MOST_HOURS",
    "MOST_ROUNDS",
    "ROUNDS",
    "CampaignOutcome",
    "RunSettings",
    "UntilKnown",
    "outlook_rows",
    "reached_rows",
    "run_campaign",
    "stroke_outlook",
    "until_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
