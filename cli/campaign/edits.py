"""The files that ``resume`` uses: those of the campaign's beginning, or as they were edited since.

Edits are shown as a diff, with what they mean for steps and limits, and the operator says whether to take
them. A limit that was made stricter is never left out.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import click

from bufferstand.cli.arming import is_terminal, typed_line, user_name
from bufferstand.cli.campaign.edit_effects import (
    LimitEdit,
    edits_shown,
    limits_edited,
    means_nothing,
    steps_told,
)
from bufferstand.cli.campaign.preparation import PreparedCampaign, prepare
from bufferstand.daq.campaign_folder import (
    INPUTS_NAME,
    CampaignFolder,
    CampaignRecord,
    FileEdit,
    Inputs,
    edits_between,
    file_changes,
    keep_before,
    read_inputs,
    restore_inputs,
    take_edits,
)
from bufferstand.foundation import BadInput

Choice = Literal["take", "keep"]


@dataclass(frozen=True)
class ResumedCampaign:
    """What a campaign goes on with: the plan of its files, and how edited ones came to be taken."""

    prepared: PreparedCampaign
    edits: dict[str, Any] = field(default_factory=dict)


def going_on(folder: Path, record: CampaignRecord, choice: Choice | None) -> ResumedCampaign:
    """Return what a campaign goes on with; ask if its files were edited since they were taken.

    Parameters
    ----------
    folder : Path
        The campaign's folder.
    record : CampaignRecord
        How far it came.
    choice : str or None
        What the options say; None: it is asked for.

    Raises
    ------
    BadInput
        If a file cannot be used, nobody can be asked, both the files and their copies were edited, or an
        edit cannot be left out.
    """
    devices_from = Path(record.stand_folder) if record.stand_folder else None
    copy, over = folder / record.campaign_file, _over(record)
    if record.inputs and not copy.exists():
        restore_inputs(record.inputs, folder)
    if not record.inputs:
        return ResumedCampaign(
            prepare(copy, devices_from=devices_from, over=over, rounds=record.rounds)
        )  # begun by an earlier version
    copies = read_inputs(copy, (folder / INPUTS_NAME).resolve())
    originals = _originals(record, folder)
    by_copies = edits_between(record.inputs, copies.texts)
    by_originals = () if originals is None else edits_between(record.inputs, originals.texts)
    if not by_copies and not by_originals:
        return ResumedCampaign(prepare(copy, devices_from=devices_from, over=over, rounds=record.rounds))
    _check_one_side(record, folder, by_copies, by_originals, choice)
    if originals is not None and by_originals:
        edits, prepared = (
            by_originals,
            prepare(originals.root / originals.campaign, over=over, rounds=record.rounds),
        )
    else:
        edits, prepared = by_copies, prepare(copy, devices_from=devices_from, over=over, rounds=record.rounds)
    _check_specimen(record, folder, prepared)
    limits = limits_edited(record, copies, prepared)
    which = f"the campaign's files in {record.originals}"
    if edits is by_copies:
        which = f"the campaign's copies in {folder / INPUTS_NAME}"
    shown = edits_shown(edits, record, prepared)
    click.echo(_told(which, shown, steps_told(record, prepared.plan, folder), limits), err=True)
    if means_nothing(edits):
        click.echo("only comments or layout were edited: nothing changes, and nothing is asked", err=True)
        return ResumedCampaign(prepared, _taken("no change in meaning"))
    if choice is None and record.recorded_nothing(folder):
        click.echo("nothing was recorded yet: it begins with the files as they are now", err=True)
        return ResumedCampaign(prepared, _taken("nothing was recorded"))
    if choice != "keep" and not record.recorded_nothing(folder):
        _check_taken(which, edits, limits)
    how = _asked(which, edits, limits) if choice is None else choice
    if how == "take":
        return ResumedCampaign(prepared, _taken("typed" if choice is None else "--take-edits"))
    _check_kept(edits, limits)
    if any(not Path(edit.place).is_absolute() for edit in by_copies):
        keep_before(copies.texts, folder, datetime.now(UTC).isoformat())
        restore_inputs(record.inputs, folder)
    click.echo("going on with the files as they were taken", err=True)
    return ResumedCampaign(prepare(copy, devices_from=devices_from, over=over, rounds=record.rounds))


def taken_without_a_start(going: ResumedCampaign, folder: Path) -> CampaignRecord | None:
    """Take edits of a campaign of which nothing is left to do; return its record, None if there are none.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    if not going.edits:
        return None
    try:
        record = take_edits(going.prepared.plan, CampaignFolder(folder), going.edits)
    except OSError as error:
        raise BadInput(f"the folder cannot be written: {error.strerror}", file=folder) from None
    click.echo("the edited files are taken", err=True)
    return record


def _over(record: CampaignRecord) -> list[dict[str, Any]]:
    """Return the steps that are complete, as the plan had them."""
    done = {step.plan_hash for step in record.steps if step.over}
    return [step for step in record.plan.get("steps", ()) if step["plan_hash"] in done]


def _originals(record: CampaignRecord, folder: Path) -> Inputs | None:
    """Return the files that the copies were made of, as they are now; None, said, where they have gone."""
    root = Path(record.originals)
    place = Path(record.campaign_file).relative_to(INPUTS_NAME)
    now = read_inputs(root / place, None) if record.originals and (root / place).is_file() else None
    if now is not None:
        now = read_inputs(root / place, root)
        unchanged = now.texts[now.campaign] == record.inputs.get(now.campaign)
        lost = [p for p in record.inputs if not Path(p).is_absolute() and not (root / p).is_file()]
        if not (unchanged and lost):
            return now
    click.echo(
        f"the files that this campaign was made of are no longer all in {root}: "
        f"it goes by their copies in {folder / INPUTS_NAME}",
        err=True,
    )
    return None


def _check_one_side(
    record: CampaignRecord,
    folder: Path,
    by_copies: tuple[FileEdit, ...],
    by_originals: tuple[FileEdit, ...],
    choice: Choice | None,
) -> None:
    def own(edits: tuple[FileEdit, ...]) -> set[FileEdit]:
        return {edit for edit in edits if not Path(edit.place).is_absolute()}

    if own(by_copies) and own(by_originals) and own(by_copies) != own(by_originals) and choice != "keep":
        raise BadInput(
            f"both the campaign's files in {record.originals} and their copies in {INPUTS_NAME} were edited, "
            "differently",
            file=folder,
            remedy="edit only the former and put the copies back, or drop all edits with --keep",
        )


def _check_specimen(record: CampaignRecord, folder: Path, prepared: PreparedCampaign) -> None:
    before, now = record.plan.get("specimen", {}).get("id"), prepared.plan.specimen.id
    if before in (None, now) or record.recorded_nothing(folder):
        return
    raise BadInput(
        f"the files name specimen “{now}” now, and what is recorded here is of “{before}”",
        file=folder,
        remedy="begin a campaign of its own with bufferstand run … --out another folder",
    )


def _check_taken(which: str, edits: tuple[FileEdit, ...], limits: tuple[LimitEdit, ...]) -> None:
    looser = [limit.text() for limit in limits if limit.direction == "LOOSER"]
    if not looser:
        return
    keep = "" if _cannot_keep(edits, limits) else ", go on with the files as they were taken (--keep),"
    raise BadInput(
        f"nothing was moved: in {which} a limit was made looser, which never counts within a campaign: "
        f"{', '.join(looser)}",
        remedy=f"undo it (what was made stricter counts){keep} or begin a campaign of its own with "
        "bufferstand run … --out another folder",
    )


def _check_kept(edits: tuple[FileEdit, ...], limits: tuple[LimitEdit, ...]) -> None:
    if why := _cannot_keep(edits, limits):
        looser = any(limit.direction == "LOOSER" for limit in limits)
        raise BadInput(
            why,
            file="--keep",
            remedy="undo in the files what was made looser, and take the rest (--take-edits)"
            if looser
            else "take the edits (--take-edits), or undo them in the files",
        )


def _cannot_keep(edits: tuple[FileEdit, ...], limits: tuple[LimitEdit, ...]) -> str:
    """Return why a campaign cannot go on without the edits; empty if it can."""
    if stricter := [limit.text() for limit in limits if limit.direction == "stricter"]:
        return f"a limit that was made stricter is not left out: {', '.join(stricter)}"
    if outside := [edit.place for edit in edits if Path(edit.place).is_absolute()]:
        return f"{', '.join(outside)}: named by an absolute path, so the folder has no copy to go by"
    return ""


def _told(which: str, edits: Sequence[FileEdit], steps: list[str], limits: tuple[LimitEdit, ...]) -> str:
    lines = [f"{which} were edited since they were taken:"]
    lines += [edit.diff() for edit in edits]
    lines += [f"changed: {change.text()}" for change in file_changes(edits)]
    lines += steps
    lines += [f"limit: {limit.text()}" for limit in limits]
    return "\n".join(lines)


def _asked(which: str, edits: tuple[FileEdit, ...], limits: tuple[LimitEdit, ...]) -> Choice:
    """Ask whether to take or to keep, or which of them is left to be said yes to."""
    summary = ", ".join(edit.summary() for edit in edits)
    cannot_keep = _cannot_keep(edits, limits)
    if not (is_terminal(sys.stdin) and is_terminal(sys.stderr)):
        only = "" if cannot_keep else ", or --keep to go on with those that were taken"
        raise BadInput(
            f"nothing was moved: {which} were edited since they were taken: {summary}"
            + (f"; {cannot_keep}" if cannot_keep else ""),
            remedy=f"add --take-edits to go on with them{only}" + (", or undo them" if cannot_keep else ""),
        )
    if cannot_keep:
        click.echo(cannot_keep, err=True)
        question = "Type take to go on with the edits: "
    else:
        question = "Type take to go on with the edits, keep to go on without them: "
    answer = typed_line(question)
    if answer == "take":
        return "take"
    if answer == "keep" and not cannot_keep:
        return "keep"
    wanted = "take was not answered" if cannot_keep else "neither take nor keep was answered"
    raise BadInput(f"nothing was moved: {wanted}", remedy="resume again and say which")


def _taken(how: str) -> dict[str, Any]:
    return {"how": how, "by": user_name()}
