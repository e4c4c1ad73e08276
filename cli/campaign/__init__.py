"""What the commands of a campaign share: preparing, resuming, edits, consent, running, pictures of a plan."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.campaign.as_run_view import (
        as_run_document,
        rows_against,
        show_as_run,
    )
    from bufferstand.cli.campaign.edits import (
        going_on,
        taken_without_a_start,
    )
    from bufferstand.cli.campaign.interrupt_text import (
        nothing_moved,
    )
    from bufferstand.cli.campaign.movement import (
        stand_text,
        touch_rows,
    )
    from bufferstand.cli.campaign.plan_picture import (
        picture_plan,
    )
    from bufferstand.cli.campaign.preparation import (
        PreparedCampaign,
        outage_leeway,
        prepare,
        prepare_campaign,
    )
    from bufferstand.cli.campaign.resume_checks import (
        accepted_changes,
        accepted_serial,
        demand_begun_anew,
        going_on_simulated,
    )
    from bufferstand.cli.campaign.running import (
        consent_to_move,
        perform,
        waits,
    )

__all__ = [
    "PreparedCampaign",
    "accepted_changes",
    "accepted_serial",
    "as_run_document",
    "consent_to_move",
    "demand_begun_anew",
    "going_on",
    "going_on_simulated",
    "nothing_moved",
    "outage_leeway",
    "perform",
    "picture_plan",
    "prepare",
    "prepare_campaign",
    "rows_against",
    "show_as_run",
    "stand_text",
    "taken_without_a_start",
    "touch_rows",
    "waits",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
