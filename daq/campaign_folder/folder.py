"""The campaign's folder: what was planned, how far it came, and copies of the files it was made of."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from bufferstand.daq.campaign_folder.inputs import (
    INPUTS_NAME,
    FileEdit,
    Inputs,
    copy_inputs,
    edits_between,
    keep_before,
    read_inputs,
)
from bufferstand.daq.campaign_folder.step_matching import same_steps
from bufferstand.daq.campaign_folder.stored_forms import StoredPlan, StoredStart
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import json_object, make_folder, typed, write_whole
from bufferstand.foundation.settings import read_text
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.steps import PlannedStep
from bufferstand.recording.runfile import KEY, read_metadata

SCHEMA = "bufferstand/campaign/1"
RECORD_NAME = "campaign.json"
RUNS_NAME = "runs"

StepStatus = Literal["pending", "running", "complete", "stopped", "failed", "skipped"]
CampaignStatus = Literal["running", "complete", "stopped", "failed", "refused"]


@dataclass(frozen=True)
class StepRecord:
    """How far a step came.

    Parameters
    ----------
    index, name, plan_hash
        As in the plan; a step is the same if the hash is.
    status : StepStatus
        ``skipped`` ended early by the temperature stop under the policy ``skip``.
    cycles_done : int
        Full cycles recorded so far, over all parts of the step.
    runs : tuple of str
        Run files, relative to the campaign's folder.
    reason : str
        Why it did not complete.
    stopped_by : str
        Name of the guard that stopped it.
    too_warm : bool
        The specimen's temperature stopped it: it goes on with the cycles that are left, once cool.
    earlier : tuple of str
        Plan hashes that it had before limits or data were edited: what was noted of it then has these.
    """

    index: int
    name: str
    plan_hash: str
    status: StepStatus = "pending"
    cycles_done: int = 0
    runs: tuple[str, ...] = ()
    reason: str = ""
    stopped_by: str = ""
    too_warm: bool = False
    earlier: tuple[str, ...] = ()

    @property
    def hashes(self) -> tuple[str, ...]:
        """Return its plan hash, and those that it had before."""
        return (self.plan_hash, *self.earlier)

    @property
    def over(self) -> bool:
        """Return whether it need not be done again."""
        return self.status in ("complete", "skipped")


@dataclass(frozen=True)
class CampaignRecord:
    """``campaign.json``: the plan and the state of every step; replaced as a whole, never half written.

    ``campaign_file`` is the copy to resume from, relative to the folder; ``stand_folder`` is where the stand
    file lay at the first start: its devices' relative paths start there, not at the copy. ``starts`` has an
    entry for each start, oldest first: when, on whose consent, and what was edited before it. ``inputs`` has
    the text of each file as the last start took it, by its place; ``originals`` is the folder that they were
    copied from.
    """

    plan: StoredPlan
    steps: tuple[StepRecord, ...]
    campaign_file: str
    stand_folder: str = ""
    status: CampaignStatus = "running"
    reason: str = ""
    stopped_by: str = ""
    trip: dict[str, Any] = field(default_factory=dict)
    """What stopped it, as data (:meth:`bufferstand.daq.guards.trips.Trip.facts`); empty where nothing did."""
    started_utc: str = ""
    updated_utc: str = field(default="")
    starts: tuple[StoredStart, ...] = ()
    originals: str = ""
    inputs: dict[str, str] = field(default_factory=dict)
    until: dict[str, Any] = field(default_factory=dict)
    """What is to be known, in how many rounds, and how each was judged; empty for a campaign that is run once
    (:mod:`bufferstand.daq.campaign.until_known`)."""

    @property
    def rounds(self) -> int:
        """Return how many times over its steps were planned."""
        return int(self.until.get("most_rounds", 1))

    def recorded_nothing(self, folder: Path) -> bool:
        """Return whether no start came to record a run or to complete a cycle: it can be begun anew."""
        runs = folder / RUNS_NAME
        files = any(runs.iterdir()) if runs.is_dir() else False
        return not files and not any(step.cycles_done or step.over for step in self.steps)

    @property
    def hashes(self) -> frozenset[str]:
        """Return the plan hashes that its steps have, or had before limits or data were edited."""
        return frozenset(one for step in self.steps for one in step.hashes)

    def step(self, step: PlannedStep) -> StepRecord:
        """Return the record of a planned step.

        Raises
        ------
        KeyError
            If the plan it was made of has no such step.
        """
        for record in self.steps:
            if record.plan_hash == step.plan_hash:
                return record
        raise KeyError(step.plan_hash)

    @property
    def must_cool(self) -> bool:
        """Return whether a step waits for the specimen to be at its resume threshold."""
        return any(step.too_warm and not step.over for step in self.steps)

    def last(self, key: str) -> Any:
        """Return what the newest start says under a key, None if none of them says it."""
        return next((start[key] for start in reversed(self.starts) if start.get(key) is not None), None)

    @property
    def simulated(self) -> bool | None:
        """Return whether its newest start was on a simulated stand; None where that is not on record."""
        found = self.last(KEY)
        return found if isinstance(found, bool) else None

    def with_start(self, start: Mapping[str, Any]) -> CampaignRecord:
        """Return the record with one start more."""
        return replace(self, starts=(*self.starts, dict(start)))

    def with_step(self, changed: StepRecord) -> CampaignRecord:
        """Return the record with one step replaced."""
        steps = tuple(changed if record.plan_hash == changed.plan_hash else record for record in self.steps)
        return replace(self, steps=steps)


class CampaignFolder:
    """The folder of one campaign.

    Parameters
    ----------
    path : Path
        Made if it is not there.

    Raises
    ------
    BadInput
        If it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.runs = path / RUNS_NAME
        try:
            for one in (
                self.path,
                self.runs,
            ):  # also where a start that was killed has left it unsynchronised
                make_folder(one)
        except OSError as error:
            raise BadInput(f"the folder cannot be made: {error.strerror}", file=path) from None

    def load(self) -> CampaignRecord | None:
        """Return the record of an earlier start, None if there was none.

        Raises
        ------
        BadInput
            If ``campaign.json`` is there but is none.
        """
        return load_record(self.path)

    def save(self, record: CampaignRecord) -> None:
        """Replace ``campaign.json`` as a whole and bring it to the disk.

        Raises
        ------
        OSError
            If the disk does not take it; the old one stays.
        """
        content = {"schema": SCHEMA} | asdict(replace(record, updated_utc=datetime.now(UTC).isoformat()))
        if not record.until:
            del content["until"]
        write_whole(self.path / RECORD_NAME, json.dumps(content, indent=1, ensure_ascii=False).encode())

    def run_id(self, step: PlannedStep) -> str:
        """Return a name for the step's next run that no run or journal in the folder has."""
        base = run_name(step)
        taken = {path.name.partition(".h5")[0].partition(".journal")[0] for path in self.runs.iterdir()}
        part, name = 1, base
        while name in taken:
            part += 1
            name = f"{base}_part-{part}"
        return name

    def take_inputs(self, campaign_file: Path, before: CampaignRecord | None, stamp: str) -> TakenInputs:
        """Take the campaign file and every TOML file that it leads to, so that the folder stands by itself.

        The copies keep their bytes and their places relative to each other, under ``inputs``; a file that
        is named by an absolute path is not copied. A campaign file in ``inputs`` is a copy already. What
        differs from what an earlier start took is told, and what it took is kept under ``inputs-before``.

        Parameters
        ----------
        campaign_file : Path
            The campaign file that was planned.
        before : CampaignRecord or None
            Of an earlier start.
        stamp : str
            Now, as ISO 8601.

        Raises
        ------
        BadInput
            If a file cannot be read.
        OSError
            If the disk does not take a copy.
        """
        copies = self.path.resolve() / INPUTS_NAME
        own = campaign_file.resolve().is_relative_to(copies)
        now = read_inputs(campaign_file, copies if own else None)
        edits: tuple[FileEdit, ...] = ()
        if before is not None and before.inputs:  # by the same places, though a file may lie elsewhere now
            root = copies if own else Path(before.originals)
            edits = edits_between(before.inputs, read_inputs(campaign_file, root).texts)
        kept = keep_before(before.inputs, self.path, stamp) if edits and before is not None else ""
        if not own:
            copy_inputs(now, self.path)
        return TakenInputs(now, edits, kept, own)


@dataclass(frozen=True)
class TakenInputs:
    """The files that a start took.

    Parameters
    ----------
    inputs : Inputs
        As they are now.
    edits : tuple of FileEdit
        What differs from those of the start before.
    kept : str
        Where those were kept, relative to the folder; empty if they are the same.
    own : bool
        Whether they are the folder's own copies.
    """

    inputs: Inputs
    edits: tuple[FileEdit, ...]
    kept: str
    own: bool

    def into(self, record: CampaignRecord, plan: Plan, before: CampaignRecord | None) -> CampaignRecord:
        """Return the record with where the files are from, and what they say."""
        campaign_file = f"{INPUTS_NAME}/{self.inputs.campaign}"
        texts = dict(self.inputs.texts)
        if self.own and before is not None:
            return replace(record, campaign_file=campaign_file, inputs=texts, originals=before.originals)
        stand_folder = str(plan.campaign.stand_path.parent.resolve())
        return replace(
            record,
            campaign_file=campaign_file,
            inputs=texts,
            originals=str(self.inputs.root),
            stand_folder=stand_folder,
        )


def load_record(folder: Path) -> CampaignRecord | None:
    """Return the record of a campaign's folder, None if there is no ``campaign.json``.

    Raises
    ------
    BadInput
        If it is there but cannot be understood.
    """
    path = folder / RECORD_NAME
    if not path.exists():
        return None
    remedy = "mend it, or choose another folder with --out"
    content = json_object(read_text(path), path, remedy=remedy)
    if (schema := content.pop("schema", None)) != SCHEMA:
        raise BadInput(f"not a record of a campaign (its schema is {schema!r:.60})", file=path, remedy=remedy)
    if strange := content.keys() - {one.name for one in fields(CampaignRecord)}:
        raise BadInput(f"unknown key “{min(strange)}”", file=path, remedy="use the newer bufferstand")
    return typed(CampaignRecord, content, path, remedy=remedy)


def begin_record(
    plan: Plan, before: CampaignRecord | None, campaign_file: str, folder: Path
) -> CampaignRecord:
    """Return the record with which a campaign begins or goes on: steps that are over stay over.

    A program that was killed may not have come to note that a step was over: its run file says it then.

    Parameters
    ----------
    plan : Plan
        What is to be done now.
    before : CampaignRecord or None
        How far an earlier start came; steps are recognised by their plan hash, or where limits or data of the
        same specimen were edited by what they ask for (:mod:`bufferstand.daq.campaign_folder.step_matching`).
    campaign_file : str
        The copy of the campaign file, relative to the folder.
    folder : Path
        The campaign's folder: a step whose run files are gone is done again.
    """
    known = {} if before is None else _known_steps(plan, before)
    steps = []
    for step in plan.steps:
        if step.pause:
            continue  # it belongs to the order, not to the test, and is set anew
        record = known.get(step.plan_hash, StepRecord(step.index, step.name, step.plan_hash))
        earlier = tuple(one for one in record.hashes if one != step.plan_hash)
        record = replace(record, index=step.index, name=step.name, plan_hash=step.plan_hash, earlier=earlier)
        there = tuple(dict.fromkeys(run for run in record.runs if (folder / run).exists()))
        if record.status == "running" and there and _ran_to_its_end(folder / there[-1]):
            cycles = record.cycles_done if step.ends_early else step.cycles or 0
            record = replace(
                record, status="complete", runs=there, cycles_done=cycles, reason="", stopped_by="",
                too_warm=False,
            )  # fmt: skip
        kept = record.over and there == record.runs
        steps.append(record if kept else replace(record, status="pending", runs=there))
    started = datetime.now(UTC).isoformat() if before is None else before.started_utc
    stand_folder = str(plan.campaign.stand_path.parent.resolve()) if before is None else before.stand_folder
    starts = () if before is None else before.starts
    return CampaignRecord(
        plan.as_dict(), tuple(steps), campaign_file, stand_folder, started_utc=started, starts=starts,
        until={} if before is None else before.until,
    )  # fmt: skip


def _known_steps(plan: Plan, before: CampaignRecord) -> dict[str, StepRecord]:
    """Return what is known of the plan's steps, by their present hash."""
    known = {record.plan_hash: record for record in before.steps}
    same = {now: known[was] for was, now in same_steps(plan, before.plan).items() if was in known}
    return known | same


def _ran_to_its_end(run_file: Path) -> bool:
    """Return whether the run that was the last of a step ended as planned, and so the step did."""
    try:
        return bool(read_metadata(run_file)["run"]["status"] == "complete")
    except BadInput:
        return False


def run_name(step: PlannedStep) -> str:
    """Return e.g. ``001-static-5mm_s`` or ``012-harmonic-48.5mm-10mm-1.27Hz``: sortable, readable."""
    parts = [f"{step.index:03d}", step.kind]
    if step.frequency_Hz is not None and step.prestress_mm is not None and step.amplitude_mm is not None:
        parts += [f"{step.prestress_mm:g}mm", f"{step.amplitude_mm:g}mm", f"{step.frequency_Hz:.3g}Hz"]
    elif step.peak_speed_mm_per_s is not None:
        parts.append(f"{step.peak_speed_mm_per_s:.4g}mm_s")
    return "-".join(parts)
