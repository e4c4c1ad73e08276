"""Grades of findings, and the time of a look; the command names both before it imports the rest."""

from __future__ import annotations

from enum import StrEnum

WATCH_S = 5.0
"""Time over which rate and clock of the controller are watched [s of wall time]."""


class Verdict(StrEnum):
    """How a finding is to be taken."""

    OK = "ok"
    NOTE = "note"
    FAULT = "fault"
