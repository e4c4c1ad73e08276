"""Campaigns that were published, so that the one of a campaign file can be compared with them."""

from __future__ import annotations

from typing import Final, Literal

PublishedCampaign = Literal["stiffness-characteristics-of-railway-buffers"]
PAPER_CAMPAIGN: Final = "stiffness-characteristics-of-railway-buffers"
"""That of the paper of this name, § 3."""
