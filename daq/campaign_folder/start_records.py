"""A start of a campaign: what it will do, and what it writes into the folder before anything moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.daq.campaign_folder.as_run import AS_RUN_NAME
from bufferstand.daq.campaign_folder.changes import file_changes
from bufferstand.daq.campaign_folder.first_start import CHANGES, TRIP, start_facts
from bufferstand.daq.campaign_folder.folder import CampaignFolder, CampaignRecord, begin_record
from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.steps import Motion, PlannedStep, motions_after

_CHANGED = "{what}: {before} → {now}"

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


def begin(plan: Plan, folder: CampaignFolder, facts: CampaignMetadata) -> CampaignRecord:
    """Take the campaign's files into its folder and note that it begins or goes on.

    What an earlier start left that recorded nothing is no part of this one.

    Raises
    ------
    BadInput
        If a file cannot be read, or the folder holds something else.
    OSError
        If the disk does not take it.
    """
    start = start_facts(simulate=facts.started_here, speed=facts.speed)
    start |= {CHANGES: [dict(one) for one in facts.changes]} if facts.changes else {}
    record = _taken(plan, folder, folder.load(), {"arming": dict(facts.arming), **start}, facts.edits)
    folder.save(record)
    return record


def take_edits(plan: Plan, folder: CampaignFolder, edits: Mapping[str, Any]) -> CampaignRecord:
    """Take the edited files of a campaign of which nothing is left to do, and note it; nothing moves.

    Parameters
    ----------
    plan : Plan
        Of the edited files.
    folder : CampaignFolder
        Holds the campaign.
    edits : mapping
        How they came to be taken.

    Raises
    ------
    BadInput
        As :func:`begin`.
    OSError
        As :func:`begin`.
    """
    before = folder.load()
    record = _taken(plan, folder, before, {"arming": {}}, edits)
    if before is not None:
        record = replace(record, status=before.status, reason=before.reason, stopped_by=before.stopped_by)
    folder.save(record)
    return record


def _taken(
    plan: Plan,
    folder: CampaignFolder,
    before: CampaignRecord | None,
    facts: Mapping[str, Any],
    edits: Mapping[str, Any],
) -> CampaignRecord:
    """Take the files into the folder; return the record with one start more, which is not saved yet."""
    now = datetime.now(UTC).isoformat()
    taken = folder.take_inputs(plan.campaign.path, before, now)
    if taken.kept and before is not None and before.recorded_nothing(folder.path):
        with suppress(FileNotFoundError):
            (folder.path / AS_RUN_NAME).rename(folder.path / taken.kept / AS_RUN_NAME)
    start: dict[str, Any] = {"at_utc": now, **facts}
    if taken.edits:
        settings = [change.as_dict() for change in file_changes(taken.edits)]
        start[CHANGES] = [*settings, *start.get(CHANGES, ())]
        files = [edit.as_dict() for edit in taken.edits]
        start["edits"] = dict(edits) | {"files": files, "kept": taken.kept}
    return taken.into(begin_record(plan, before, "", folder.path), plan, before).with_start(start)


def edits_taken(record: CampaignRecord) -> tuple[dict[str, Any], ...]:
    """Return every edit of the campaign's files that a start has taken, oldest first, for the runs."""
    return tuple(
        {"at_utc": start["at_utc"], **start["edits"]} for start in record.starts if start.get("edits")
    )


def doubts_before(record: CampaignRecord) -> tuple[dict[str, Any], ...]:
    """Return what ended earlier starts before they recorded a run, oldest first, for the runs.

    Each is the trip's facts, with ``at_utc`` of its start, ``changed`` (texts of the settings that were
    another at a start from then on, up to the first one that was not ended so) and the whole as a ``text``.

    Parameters
    ----------
    record : CampaignRecord
        Its last start is the one that goes on.
    """
    found = []
    for at, start in enumerate(record.starts[:-1], start=1):
        if not (trip := start.get(TRIP)):
            continue
        passed = next((i for i, one in enumerate(record.starts[at:], at) if not one.get(TRIP)), None)
        later = record.starts[at:] if passed is None else record.starts[at : passed + 1]
        changed = [_CHANGED.format_map(change) for one in later for change in one.get(CHANGES, ())]
        text = _said_before(start["at_utc"], trip, changed)
        found.append({"at_utc": start["at_utc"], **trip, "changed": changed, "text": text})
    return tuple(found)


def _said_before(at_utc: str, trip: Mapping[str, Any], changed: Sequence[str]) -> str:
    when = f"{at_utc[:16].replace('T', ' ')} UTC"
    since = "no setting was changed since: mended at the stand, or accepted by going on"
    if changed:
        since = f"changed since: {'; '.join(changed)}"
    reason = str(trip.get("reason") or "no reason recorded").rstrip(". ")
    return f"the start of {when} recorded nothing and was ended by “{trip.get('guard')}”: {reason}; {since}"


def changes_taken(record: CampaignRecord) -> tuple[dict[str, Any], ...]:
    """Return what differed from what the campaign began with, as starts found it, oldest first, for the runs.

    What was edited of steps is left out: a run has its own step, and the edits with their differences.
    """
    return tuple(
        {"at_utc": start["at_utc"], **change}
        for start in record.starts
        for change in start.get(CHANGES, ())
        if ": step[" not in change["what"]
    )
