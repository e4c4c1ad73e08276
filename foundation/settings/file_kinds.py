"""Which kind of file a settings file is, told by its tables: for who names the wrong one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

KINDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "CampaignFile": ("a campaign file", ("campaign",)),
    "StandFile": ("a stand file", ("stand", "controller")),
    "RecordingStand": ("a stand file", ("stand", "acquisition")),
    "SpecimenFile": ("a specimen file", ("specimen",)),
    "ModelFile": ("a spring model", ("model", "curves")),
    "TrainFile": ("a train file", ("train", "vehicle")),
    "ProfileFile": ("a register profile", ("profile", "register")),
    "Description": ("a description of a Modbus device", ("source", "point")),
    "FaultFile": ("a file of faults", ("fault",)),
    "Inspection": ("an inspection", ("inspection", "item")),
    "LimitSet": ("a limit set", ("applies",)),
}
"""Schema → what its files are called, and the keys at their top that no other kind has together."""


def mistaken_for(schema: str, content: Mapping[str, Any]) -> str:
    """Return that a file is one of another kind than its schema; empty where it may be meant for it.

    Parameters
    ----------
    schema : str
        Name of the schema that it does not keep.
    content : mapping
        What the file holds.
    """
    wanted, own = KINDS.get(schema, ("", ()))
    if not wanted or any(key in content for key in own):
        return ""
    for name, (kind, keys) in KINDS.items():
        if name != schema and all(key in content for key in keys):
            return f"this is {kind}; {wanted} is wanted here"
    return ""
