"""Recordings: journals, run files, foreign records, and what else lies in a campaign's folder."""

from __future__ import annotations

import gc
import json
import shutil
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np

from bufferstand.daq.campaign_folder import load_record, read_as_run
from bufferstand.daq.campaign_folder.as_run import report_rows, totals
from bufferstand.daq.monitor.campaign_view import campaign_section, steps_section
from bufferstand.daq.monitor.journal_tail import JournalTail
from bufferstand.daq.operator import read_notes
from bufferstand.daq.strokes import learned_in, read_strokes
from bufferstand.daq.zero.file import kept_zero
from bufferstand.drivers.certificates import read_certificate
from bufferstand.evaluation.archive.comparison import load_evaluation
from bufferstand.evaluation.document.build import evaluate_file
from bufferstand.recording.content import Anchor, Event
from bufferstand.recording.foreign import import_file
from bufferstand.recording.journal.records import FRAME, MAGIC, DataRecord
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile import open_run, write_run
from bufferstand.recording.sealing import verify, verify_journal
from bufferstand.recording.sealing.seal_journal import seal
from tests.bounds.files import Files, guards_of
from tests.drivers.made_certificate import CHAIN, TRANSDUCER, certificate
from tests.fuzz.mutators import change_one, either, of_json, of_json_lines, of_text
from tests.fuzz.target import Altered, Case, Mutate, Target
from tests.fuzz.targets.from_files import SAMPLES, contents, of_file
from tests.hostile.documents import ODD, changed, places
from tests.hostile.mutations import mutated
from tests.hostile_runs.crafting import put_document
from tests.hostile_runs.crafting import seal as seal_file
from tests.hostile_runs.damage import structure_of
from tests.recording import samples
from tests.recording.foreign import makers

FOLDER = Path(__file__).parent.parent / "samples" / "campaign"
BLOCKS, ROWS = 6, 20


# --- journals --------------------------------------------------------------------------------------


def frames_of(content: bytes) -> list[tuple[bytes, bytes]]:
    """Return head (behind the check sum) and payload of each frame, as far as they can be told."""
    found, at = [], 0
    while content[at : at + 4] == MAGIC and at + FRAME.size <= len(content):
        length = int.from_bytes(content[at + 8 : at + 12], "little")
        found.append((content[at + 8 : at + FRAME.size], content[at + FRAME.size : at + FRAME.size + length]))
        at += FRAME.size + length
    return found


def chained(content: bytes) -> bytes:
    """Return a journal whose frames have right lengths, numbers and check sums, whatever is in them."""
    made, crc = b"", 0
    for number, (head, payload) in enumerate(frames_of(content)):
        fitting = len(payload).to_bytes(4, "little") + head[4:-8] + number.to_bytes(8, "little")
        crc = zlib.crc32(payload, zlib.crc32(fitting, crc))
        made += MAGIC + crc.to_bytes(4, "little") + fitting + payload
    return made


def _of_frames(content: bytes, pick: Random) -> bytes:
    """Swap, double, drop or change whole frames; their check sums are made anew behind."""

    def of_frame(frame: tuple[bytes, bytes], pick: Random) -> tuple[bytes, bytes]:
        head, payload = frame
        mutate = of_json if payload[:1] == b"{" else mutated
        return head, mutate(payload, pick)

    frames = frames_of(content)
    change_one(frames, of_frame, pick, kinds=6)
    made = b"".join(MAGIC + bytes(4) + head + payload for head, payload in frames)
    return chained(made)


@contextmanager
def journals(folder: Path) -> Iterator[Case]:
    """Give journals: what is read is a beginning of what was written, unless the chain was made anew."""
    (folder / "made").mkdir()
    (folder / "files").mkdir()
    guards = guards_of(Files(folder / "files").prepare()).as_dict()
    recorder = RunRecorder(folder / "made", "run-1", {**samples.metadata(), "limits": {"guards": guards}})
    recorder.anchor(0, 0.25, "2026-03-01T10:00:00+00:00")
    recorder.event(0.5, "note", "a note", by="somebody")
    for number in range(BLOCKS):
        recorder.append(*samples.block(ROWS * number))
    recorder.append("temperature_1", 0, np.array([7_000_000]), {"temperature_1": np.array([21.5])})
    while recorder.durable < ROWS * BLOCKS:
        pass
    whole = recorder.path.read_bytes().rstrip(b"\0")
    recorder.close("complete")
    path = folder / "read" / "run-1.journal"

    def read(content: bytes) -> object:
        shutil.rmtree(path.parent, ignore_errors=True)
        path.parent.mkdir()
        path.write_bytes(content)
        verify_journal(path)
        tail = JournalTail(path)
        try:
            tail.poll()
        finally:
            tail.close()
        if not _is_chain(content):
            _demand_beginning(samples.scan(path).records)
        run_file = seal(path)
        found = verify(run_file)
        run_file.chmod(0o644)
        return found

    yield Case([whole], read, either(mutated, _of_frames))


def _is_chain(content: bytes) -> bool:
    return chained(content) == content[: len(chained(content))]


def _demand_beginning(records: list[Any]) -> None:
    rows = 0
    for record in records:
        if isinstance(record, (Anchor, Event)) or not isinstance(record, DataRecord):
            continue
        if record.stream != "controller":
            continue
        sequence = np.arange(record.sequence, record.sequence + len(record.time_us))
        true = samples.counts(sequence)
        same = all(np.array_equal(true[name], column) for name, column in record.counts.items())
        if (
            record.sequence != rows
            or not same
            or not np.array_equal(record.time_us, samples.time_us(sequence))
        ):
            raise Altered(f"samples from {record.sequence} on are not those that were recorded")
        rows += len(sequence)


# --- run files -------------------------------------------------------------------------------------


@contextmanager
def run_files(folder: Path) -> Iterator[Case]:
    """Give run files with damaged bytes, mostly with a seal that fits them: figures are true, or refused."""
    path = folder / "run-1.h5"
    write_run(
        path, samples.metadata("run-1", status="complete"), samples.content(), samples.EVENTS, samples.ANCHORS
    )
    path.chmod(0o644)
    good, structure = path.read_bytes(), structure_of(path)
    true = _figures(path)

    def mutate(content: bytes, pick: Random) -> bytes:
        damaged = bytearray(content)
        kind = pick.randrange(3)
        if kind == 0:
            return _sealed(mutated(content, pick), pick)
        for _ in range(pick.randint(1, 3)):
            at = pick.choice(structure) if kind == 1 else pick.randrange(512, len(damaged))
            damaged[at] ^= 1 << pick.randrange(8)
        return _sealed(bytes(damaged), pick)

    def _sealed(content: bytes, pick: Random) -> bytes:
        if pick.random() < 0.2 or len(content) < 1024:
            return content
        path.write_bytes(content)
        seal_file(path)
        return path.read_bytes()

    def read(content: bytes) -> object:
        path.write_bytes(content)
        found = _figures(path)
        if found != true:
            raise Altered("series of an opened file are not those that were written")
        return verify(path)

    yield Case([good], read, mutate)


def _figures(path: Path) -> dict[str, bytes]:
    run = open_run(path)
    found = {
        one: run.series(one).value.tobytes() for one in ("force", "stroke_1", "stroke_2", "temperature_1")
    }
    return found | {"time": run.series("force").time_s.tobytes()}


@contextmanager
def run_documents(folder: Path) -> Iterator[Case]:
    """Give documents of a run file whose hashes and seal fit: whoever can write a file can do that."""
    path, good = folder / "run.h5", SAMPLES / "runs" / "001-static-5mm_s.h5"
    with h5py.File(good) as tree:
        document = str(tree.attrs["metadata"]).encode()

    def mutate(content: bytes, pick: Random) -> bytes:
        changed_document = json.loads(content)
        for _ in range(pick.randint(1, 2)):
            where = pick.choice(list(places(changed_document)))
            changed_document = changed(changed_document, where, pick.choice(ODD))
        return json.dumps(changed_document).encode()

    def read(content: bytes) -> object:
        document = json.loads(content)
        shutil.copyfile(good, path)
        path.chmod(0o644)
        with h5py.File(path, "r+", locking=False) as tree:
            if isinstance(document, dict):
                put_document(tree, document)
            else:
                tree.attrs["metadata"] = json.dumps(document)
        seal_file(path)
        verify(path)
        return evaluate_file(path)

    yield Case([document], read, mutate)


# --- records of others -----------------------------------------------------------------------------


MDF = (".mf4", ".mdf")


def _foreign(suffix: str, make: Callable[[Path], Path], mutate: Mutate = mutated) -> Target:
    """Return the target of a kind of foreign record."""
    out = "imported"

    def corpus(folder: Path) -> list[bytes]:
        made = make(folder / f"sample{suffix}")
        return [made.read_bytes()]

    def read(path: Path) -> object:
        shutil.rmtree(path.parent / out, ignore_errors=True)
        try:
            return import_file(path, path.parent / out)
        finally:
            gc.collect(0)

    name = f"import-{make.__name__.strip('_').replace('_', '-')}"
    begin = of_file(f"r{suffix}", corpus, read, mutate)
    dose = 1 if suffix in MDF else 6  # each is tried in a process of its own first
    return Target(name, f"foreign records ({suffix[1:]})", begin, dose=dose)


def _head_or_all(content: bytes, pick: Random) -> bytes:
    """Damage mostly the beginning: what stands there says where all the rest is."""
    head = 4096 if pick.random() < 0.6 else len(content)
    return mutated(content[:head], pick) + content[head:]


def _some_rows(content: bytes, pick: Random) -> bytes:
    """Change the text's first rows, and keep some of the others: short inputs are read sooner."""
    lines = content.split(b"\n")
    kept = pick.choice((20, 200, len(lines)))
    return of_text(b"\n".join(lines[:12]), pick) + b"\n" + b"\n".join(lines[12:kept])


def mdf_plain(path: Path) -> Path:
    """Write one that is not packed."""
    return makers.mdf(path, compression=0)


def mdf_3(path: Path) -> Path:
    """Write one of version 3."""
    return makers.mdf(path, version="3.30")


FOREIGN = (
    _foreign(".csv", makers.csv_comma, _some_rows),
    _foreign(".csv", makers.csv_units_row, _some_rows),
    _foreign(".csv", makers.csv_decimal_comma, _some_rows),
    _foreign(".txt", makers.csv_utf_16),
    _foreign(".xlsx", makers.excel, _head_or_all),
    _foreign(".tdms", makers.tdms, _head_or_all),
    _foreign(".mf4", mdf_plain, _head_or_all),
    _foreign(".mf4", makers.mdf, _head_or_all),
    _foreign(".mdf", mdf_3, _head_or_all),
)


# --- a campaign's folder ---------------------------------------------------------------------------


def _in_folder(name: str, read: Callable[[Path], object], mutate: Mutate) -> Target:
    begin = of_file(name, contents(FOLDER / name), read, mutate)
    return Target(f"campaign-{name.partition('.')[0]}", f"a campaign's {name}", begin)


def _record(path: Path) -> object:
    record = load_record(path.parent)
    assert record is not None
    return campaign_section(record, path.parent), steps_section(record)


def _as_run(path: Path) -> object:
    rows = read_as_run(path.parent)
    return report_rows(rows), totals(rows).sentence(), [(row.sentence(), row.observation()) for row in rows]


def _strokes(path: Path) -> object:
    return read_strokes(path.parent), learned_in(path.parent)


CAMPAIGN = (
    _in_folder("campaign.json", _record, of_json),
    _in_folder("as-run.jsonl", _as_run, of_json_lines),
    _in_folder("strokes.jsonl", _strokes, of_json_lines),
    _in_folder("notes.jsonl", lambda path: read_notes(path.parent), of_json_lines),
    _in_folder("zero.json", lambda path: kept_zero(path.parent), of_json),
)


# --- certificates, evaluations, reports ------------------------------------------------------------


def _certificates(_: Path) -> list[bytes]:
    return [certificate(result).encode() for result in (TRANSDUCER, CHAIN)]


def _evaluations(_: Path) -> list[bytes]:
    return [(FOLDER.parent / "evaluation.json").read_bytes()]


RECORDS = (
    Target("journal", "journals of a recording", journals, dose=12),
    Target("run-file", "run files, with and without a seal made anew", run_files, dose=25),
    Target(
        "run-document", "documents of run files, hashes and seal made anew", run_documents, dose=3, cpu_s=60.0
    ),
    *FOREIGN,
    *CAMPAIGN,
    Target(
        "certificate",
        "calibration certificates (DCC)",
        of_file("c.xml", _certificates, read_certificate, either(mutated, of_text)),
    ),
    Target("evaluation", "evaluation documents", of_file("e.json", _evaluations, load_evaluation, of_json)),
)
"""What was recorded, and what is made of it."""
