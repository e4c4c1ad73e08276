"""A start of a campaign: what it will do, and what it writes into the folder before anything moves."""

from __future__ import annotations

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from daq.as_run import AS_RUN_NAME
from daq.folder import CampaignFolder, CampaignRecord, begin_record
from daq.metadata import CampaignFacts
from protocols.plan import Plan
from protocols.steps import Motion, PlannedStep, motions_after

LeftToDo = tuple[tuple[PlannedStep, tuple[Motion, ...]], ...]


def left_to_do(plan: Plan, before: CampaignRecord | None, folder: Path) -> LeftToDo:
    """Return what a start of this plan will do, in the order of the plan; nothing is written.

    Parameters
    ----------
    plan : Plan
        What is to be done.
    before : CampaignRecord or None
        How far an earlier start came.
    folder : Path
        The campaign's folder.
    """
    record = begin_record(plan, before, "", folder)
    left: list[tuple[PlannedStep, tuple[Motion, ...]]] = []
    for step in plan.steps:
        if step.pause:
            continue
        known = record.step(step)
        if not known.over:
            left.append((step, motions_after(step.motions, known.cycles_done if known.too_warm else 0)))
    return tuple(left)


def begin(plan: Plan, folder: CampaignFolder, facts: CampaignFacts) -> CampaignRecord:
    """Take the campaign's files into its folder and note that it begins or goes on.

    What an earlier start left that recorded nothing is no part of this one.

    Raises
    ------
    BadInput
        If a file cannot be read, or the folder holds something else.
    OSError
        If the disk does not take it.
    """
    before, now = folder.load(), datetime.now(UTC).isoformat()
    taken = folder.take_inputs(plan.campaign.path, before, now)
    if taken.kept and before is not None and before.recorded_nothing(folder.path):
        with suppress(FileNotFoundError):
            (folder.path / AS_RUN_NAME).rename(folder.path / taken.kept / AS_RUN_NAME)
    start: dict[str, Any] = {"at_utc": now, "arming": dict(facts.arming)}
    if taken.edits:
        edits = [edit.as_dict() for edit in taken.edits]
        start["edits"] = dict(facts.edits) | {"files": edits, "kept": taken.kept}
    record = taken.into(begin_record(plan, before, "", folder.path), plan, before).with_start(start)
    folder.save(record)
    return record


def edits_taken(record: CampaignRecord) -> tuple[dict[str, Any], ...]:
    """Return every edit of the campaign's files that a start has taken, oldest first, for the runs."""
    return tuple(
        {"at_utc": start["at_utc"], **start["edits"]} for start in record.starts if start.get("edits")
    )
