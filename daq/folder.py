"""The campaign's folder: what was planned, how far it came, and copies of the files it was made of."""

from __future__ import annotations

import json
import os
import tomllib
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from foundation.errors import BadInput
from foundation.settings import read_text
from protocols.plan import Plan
from protocols.steps import PlannedStep
from recording.runfile import read_metadata

SCHEMA = "bufferstand/campaign/1"
RECORD_NAME = "campaign.json"
INPUTS_NAME = "inputs"
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

    @property
    def over(self) -> bool:
        """Return whether it need not be done again."""
        return self.status in ("complete", "skipped")


@dataclass(frozen=True)
class CampaignRecord:
    """``campaign.json``: the plan and the state of every step; replaced as a whole, never half written.

    ``campaign_file`` is the copy to resume from, relative to the folder; ``stand_folder`` is where the stand
    file lay at the first start: its devices' relative paths start there, not at the copy.
    """

    plan: dict[str, Any]
    steps: tuple[StepRecord, ...]
    campaign_file: str
    stand_folder: str = ""
    status: CampaignStatus = "running"
    reason: str = ""
    stopped_by: str = ""
    started_utc: str = ""
    updated_utc: str = field(default="")

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
            self.runs.mkdir(parents=True, exist_ok=True)
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
        _write_whole(self.path / RECORD_NAME, json.dumps(content, indent=1, ensure_ascii=False).encode())

    def run_id(self, step: PlannedStep) -> str:
        """Return a name for the step's next run that no run or journal in the folder has."""
        base = run_name(step)
        taken = {path.name.partition(".h5")[0].partition(".journal")[0] for path in self.runs.iterdir()}
        part, name = 1, base
        while name in taken:
            part += 1
            name = f"{base}_part-{part}"
        return name

    def copy_inputs(self, campaign_file: Path) -> str:
        """Copy the campaign and every TOML file it leads to, so that the folder can be resumed by itself.

        The copies keep their bytes and their places relative to each other, under ``inputs``; files named
        by an absolute path are not copied. A campaign file in ``inputs`` is a copy already.

        Returns
        -------
        str
            The campaign file's copy, relative to the campaign's folder.

        Raises
        ------
        BadInput
            If a file cannot be read.
        OSError
            If the disk does not take a copy.
        """
        inputs = self.path.resolve() / INPUTS_NAME
        campaign_file = campaign_file.resolve()
        if campaign_file.is_relative_to(inputs):
            return str(campaign_file.relative_to(self.path.resolve()))
        files = _inputs(campaign_file, [])
        root = Path(os.path.commonpath([file.parent for file in files]))
        for file in files:
            copy = inputs / file.relative_to(root)
            copy.parent.mkdir(parents=True, exist_ok=True)
            _write_whole(copy, file.read_bytes())
        return str(Path(INPUTS_NAME) / campaign_file.relative_to(root))


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
    try:
        content = json.loads(read_text(path))
        if content.pop("schema") != SCHEMA:
            raise ValueError("another schema")
        steps = tuple(StepRecord(**(step | {"runs": tuple(step["runs"])})) for step in content.pop("steps"))
        return CampaignRecord(steps=steps, **content)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadInput(
            f"not a record of a campaign ({error})", file=path, remedy="choose another folder with --out"
        ) from None


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
        How far an earlier start came; steps are recognised by their plan hash.
    campaign_file : str
        The copy of the campaign file, relative to the folder.
    folder : Path
        The campaign's folder: a step whose run files are gone is done again.
    """
    known = {} if before is None else {record.plan_hash: record for record in before.steps}
    steps = []
    for step in plan.steps:
        if step.pause:
            continue  # it belongs to the order, not to the test, and is set anew
        record = known.get(step.plan_hash, StepRecord(step.index, step.name, step.plan_hash))
        record = replace(record, index=step.index, name=step.name)
        there = tuple(dict.fromkeys(run for run in record.runs if (folder / run).exists()))
        if record.status == "running" and there and _ran_to_its_end(folder / there[-1]):
            cycles = record.cycles_done if step.steady is not None else step.cycles or 0
            record = replace(
                record, status="complete", runs=there, cycles_done=cycles, reason="", stopped_by="",
                too_warm=False,
            )  # fmt: skip
        kept = record.over and there == record.runs
        steps.append(record if kept else replace(record, status="pending", runs=there))
    started = datetime.now(UTC).isoformat() if before is None else before.started_utc
    stand_folder = str(plan.campaign.stand_path.parent.resolve()) if before is None else before.stand_folder
    return CampaignRecord(plan.as_dict(), tuple(steps), campaign_file, stand_folder, started_utc=started)


def _ran_to_its_end(run_file: Path) -> bool:
    """Return whether the run that was the last of a step ended as planned, and so the step did."""
    try:
        return bool(read_metadata(run_file)["run"]["status"] == "complete")
    except BadInput:
        return False


def run_name(step: PlannedStep) -> str:
    """Return e.g. ``001-static-5mm_s`` or ``012-harmonic-48.5mm-10mm-1.27Hz``: sortable, readable."""
    parts = [f"{step.index:03d}", step.kind]
    if step.kind == "harmonic":
        parts += [f"{step.prestress_mm:g}mm", f"{step.amplitude_mm:g}mm", f"{step.frequency_Hz:.3g}Hz"]
    elif step.peak_speed_mm_per_s is not None:
        parts.append(f"{step.peak_speed_mm_per_s:g}mm_s")
    return "-".join(parts)


def _write_whole(path: Path, content: bytes) -> None:
    """Write beside, bring to the disk, rename: a reader sees the old or the new, never half."""
    beside = path.with_name(f".{path.name}.new")
    with beside.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    beside.replace(path)
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _inputs(file: Path, found: list[Path]) -> list[Path]:
    """Return a TOML file and every other that its texts lead to by a relative path, each once."""
    if file in found:
        return found
    found.append(file)
    try:
        content = tomllib.loads(read_text(file))
    except tomllib.TOMLDecodeError:
        return found  # no longer what was loaded: kept as it is, resume will say what is wrong
    for text in sorted(_texts(content)):
        if not text.endswith(".toml") or Path(text).is_absolute():
            continue
        target = Path(os.path.normpath(file.parent / text))
        if target.is_file():
            _inputs(target, found)
    return found


def _texts(content: Any) -> set[str]:
    """Return every text value in a TOML document."""
    if isinstance(content, str):
        return {content}
    if isinstance(content, dict):
        return set().union(*(_texts(value) for value in content.values()), set())
    if isinstance(content, list):
        return set().union(*(_texts(value) for value in content), set())
    return set()
