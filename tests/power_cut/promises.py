"""What a program that was cut off had promised, and whether the disk still has it when all was recovered."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.daq.campaign_folder.as_run import AS_RUN_NAME, read_as_run
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.notes import NOTES_NAME, read_notes
from bufferstand.daq.strokes.stroke_rows import STROKES_NAME, read_strokes
from bufferstand.evaluation.report.source.number_range import COLUMNS
from bufferstand.recording.content import Anchor, Event, main_stream
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run
from bufferstand.recording.sealing.verification import verify
from tests.power_cut.tape import Tape, Told
from tests.power_cut.workloads import Given

READERS = {AS_RUN_NAME: read_as_run, NOTES_NAME: read_notes, STROKES_NAME: read_strokes}


@dataclass
class Promised:
    """What had been said to be safe before a moment of the tape, and what was under way at it.

    Parameters
    ----------
    recording : set of str
        Journals that were said to be recording.
    samples : mapping of str to int
        Acknowledged samples of the leading stream, by run.
    closed : mapping of str to str
        Status of runs that were sealed.
    whole : mapping of str to list of bytes
        States of files that are replaced as a whole: the last one promised, and the one that may be there.
    lines : mapping of str to (list of bytes, list of bytes)
        Lines promised, and those that may be there behind them.
    kept : list of (str, mapping)
        Texts that were kept, by their folder.
    files : list of str
        Run files that were imported.
    """

    recording: set[str] = field(default_factory=set)
    samples: dict[str, int] = field(default_factory=dict)
    closed: dict[str, str] = field(default_factory=dict)
    whole: dict[str, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    lines: dict[str, tuple[list[bytes], list[bytes]]] = field(
        default_factory=lambda: defaultdict(lambda: ([], []))
    )
    kept: list[tuple[str, Mapping[str, str]]] = field(default_factory=list)
    files: list[str] = field(default_factory=list)


def promised(tape: Tape, moment: int) -> Promised:
    """Return what had been told before a moment; of files, also what was told next."""
    found = Promised()
    for at, entry in enumerate(tape.entries):
        if not isinstance(entry, Told):
            continue
        safe = at < moment
        if entry.what == "whole":
            place, content = entry.content
            states = found.whole[place]
            if safe:
                states[:] = [content]
            elif len(states) < 2 or not states[0]:
                states.append(content)
        elif entry.what == "line":
            place, content = entry.content
            found.lines[place][0 if safe else 1].append(content)
        elif not safe:
            continue
        elif entry.what == "recording":
            found.recording.add(entry.content)
        elif entry.what == "samples":
            run, count = entry.content
            found.samples[run] = count
        elif entry.what == "closed":
            run, status = entry.content
            found.closed[run] = status
        elif entry.what == "kept":
            found.kept.append(entry.content)
        elif entry.what == "imported":
            found.files.append(entry.content)
    told = {
        entry.content[0]
        for entry in tape.entries[:moment]
        if isinstance(entry, Told) and entry.what == "whole"
    }
    found.whole = {place: states for place, states in found.whole.items() if place in told}
    return found


def broken(root: Path, promise: Promised, evidence: Mapping[str, Given]) -> Iterator[str]:
    """Yield every promise that a recovered folder does not keep, and everything false that is read there."""
    yield from _broken_runs(root, promise, evidence)
    for place, states in promise.whole.items():
        yield from _broken_whole(root / place, states)
    for place, (must, may) in promise.lines.items():
        yield from _broken_lines(root / place, must, may)
    for place, texts in promise.kept:
        for name, text in texts.items():
            if not (root / place / name).is_file() or (root / place / name).read_bytes() != text.encode():
                yield f"{place}/{name}: what was kept is lost or altered"
    for place in promise.files:
        if not (root / place).is_file():
            yield f"{place}: an imported run is lost"
        elif faults := [one for one in verify(root / place) if one.level == "fault"]:
            yield f"{place}: {faults[0].text}"


def _broken_runs(root: Path, promise: Promised, evidence: Mapping[str, Given]) -> Iterator[str]:
    for journal in sorted(promise.recording):
        path = (root / journal).with_suffix(".h5")
        if not path.is_file():
            yield f"{path.name}: a run that was recording is lost"
    for path in sorted(root.rglob("runs/*")):
        if path.name.endswith((".h5.tmp", ".journal.tmp", ".journal")) or ".journal." in path.name:
            yield f"{path.name}: left behind"
    for run_id, given in evidence.items():
        for path in root.rglob(f"{run_id}.h5"):
            faults = [one for one in verify(path) if one.level == "fault"]
            if faults:
                yield f"{path.name}: {faults[0].place}: {faults[0].text}"
            else:
                yield from _broken_run(open_run(path), given, promise)


def _broken_run(run: Run, given: Given, promise: Promised) -> Iterator[str]:
    leading = main_stream(run.metadata["streams"])
    safe = promise.samples.get(run.id, 0)
    rows = run.streams[leading].rows if leading in run.streams else 0
    if rows < safe:
        yield f"{run.id}: {safe} samples were acknowledged, {rows} are there"
    status = promise.closed.get(run.id)
    if status is not None and run.status != status:
        yield f"{run.id}: was closed as {status}, reads as {run.status} ({run.reason})"
    for name, stream in run.streams.items():
        if not stream.rows:
            continue
        sequence, stamps, counts = given.samples.of(name)
        whole = len(stamps) if status is not None else stream.rows
        same = stream.rows == whole and np.array_equal(stream.sequence, sequence[:whole])
        same = same and np.array_equal(stream.time, stamps[:whole])
        if not (same and all(np.array_equal(stream.counts[one], counts[one][:whole]) for one in counts)):
            yield f"{run.id}: {name}: samples are missing or are not those that were given"
    for kind, there in ((Event, run.recorded_events), (Anchor, run.anchors)):
        items = [one for one in given.items if isinstance(one, kind)]
        if [vars(one) for one in there] != [vars(one) for one in items[: len(there)]] or (
            status is not None and len(there) != len(items)
        ):
            yield f"{run.id}: {kind.__name__.lower()}s are missing or are not those that were given"


def _broken_whole(path: Path, states: list[bytes]) -> Iterator[str]:
    there = path.read_bytes() if path.is_file() else None
    if there is None:
        yield f"{path.name}: is lost"
    elif path.name == "campaign.json":
        yield from _broken_record(path, states)
    elif there not in states:
        yield f"{path.name}: reads as neither what was promised nor what was being written"


def _broken_record(path: Path, states: list[bytes]) -> Iterator[str]:
    """Compare what the recovery made of the record: what it says of starts and complete steps must stay."""
    record = load_record(path.parent)
    assert record is not None
    was = json.loads(states[0])
    over = {one["plan_hash"] for one in was["steps"] if one["status"] in ("complete", "skipped")}
    if lost := over - {step.plan_hash for step in record.steps if step.over}:
        yield f"campaign.json: {len(lost)} steps that were complete are not"
    if json.loads(json.dumps(record.starts[: len(was["starts"])])) != was["starts"] and not _goes_on_from(
        states[1:], record.starts
    ):
        yield "campaign.json: its starts are not those that were promised"
    for place, text in record.inputs.items():
        copy = path.parent / "inputs" / place
        if not Path(place).is_absolute() and (
            not copy.is_file() or copy.read_bytes().replace(b"\r\n", b"\n") != text.encode()
        ):
            yield f"inputs/{place}: the copy is lost or altered"


def _goes_on_from(states: list[bytes], starts: Any) -> bool:
    """Return whether the record is one that was being written when the power was cut."""
    last = [json.loads(one)["starts"] for one in states]
    return any(json.loads(json.dumps(starts[: len(one)])) == one for one in last)


def _broken_lines(path: Path, must: list[bytes], may: list[bytes]) -> Iterator[str]:
    if path.suffix == ".csv":
        there = path.read_bytes().splitlines()[1:] if path.is_file() else []
        head = path.read_bytes().splitlines()[:1] if path.is_file() else []
        if there and head != [",".join(COLUMNS).encode()]:
            yield f"{path.name}: its first line is no head"
    else:
        reader = READERS[path.name]
        read = reader(path.parent)
        there = _whole_json(path)
        if len(read) != len(there):
            yield f"{path.name}: {len(there)} whole lines, {len(read)} are read"
    if there[: len(must)] != must:
        yield f"{path.name}: {len(must)} lines were promised, these are there: {there}"[:400]
    elif path.suffix != ".csv" and there[len(must) :] != may[: len(there) - len(must)]:
        yield f"{path.name}: reads what nobody wrote: {there[len(must) :]}"[:400]


def _whole_json(path: Path) -> list[bytes]:
    found: list[bytes] = []
    for line in path.read_bytes().split(b"\n") if path.is_file() else []:
        try:
            content: Any = json.loads(line)
        except ValueError:
            continue
        if isinstance(content, dict):
            found.append(line)
    return found
