"""Journals of whole frames with odd content: refused in words, or ended there; no traceback."""

from __future__ import annotations

import json
import random
import shutil
import struct
import zlib
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.monitor.journal_tail import JournalTail
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.journal.records import FRAME, MAGIC, FrameKind
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.sealing.seal_journal import seal
from bufferstand.recording.sealing.verification import verify, verify_journal
from tests.bounds.files import Files, guards_of
from tests.hostile.documents import ODD, changed, places
from tests.recording import samples
from tests.recording.test_writer import record


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[int, int, bytes]]:
    """Kind, stream and payload of each frame of a recording."""
    folder = tmp_path_factory.mktemp("journal")
    guards = guards_of(Files(folder).prepare()).as_dict()
    recorder = RunRecorder(folder, "run-1", {**samples.metadata(), "limits": {"guards": guards}})
    recorder.anchor(0, 0.25, "2026-03-01T10:00:00+00:00")
    recorder.event(0.5, "note", "a note", by="somebody")
    record(recorder, 3)  # once its samples are on the disk, what came before is
    journal = recorder.path
    while recorder.durable < 20 * 3:
        pass
    content = journal.read_bytes()
    recorder.close("complete")
    found, at = [], 0
    while content[at : at + 4] == MAGIC:
        _, _, length, kind, _, stream, _ = FRAME.unpack_from(content, at)
        found.append((kind, stream, content[at + FRAME.size : at + FRAME.size + length]))
        at += FRAME.size + length
    assert {kind for kind, _, _ in found} >= {1, 2, 3, 4, 5}
    return found


def chained(frames: list[tuple[int, int, bytes]]) -> bytes:
    """Return frames with right numbers and check sums."""
    content, crc = b"", 0
    for number, (kind, stream, payload) in enumerate(frames):
        head = FRAME.pack(MAGIC, 0, len(payload), kind, 0, stream, number)[8:]
        crc = zlib.crc32(payload, zlib.crc32(head, crc))
        content += MAGIC + struct.pack("<I", crc) + head + payload
    return content


def odd(frames: list[tuple[int, int, bytes]], pick: random.Random) -> tuple[str, bytes]:
    """Return a journal with one odd value in one of its documents, and what it is."""
    at = pick.choice([i for i, (kind, _, _) in enumerate(frames) if kind != FrameKind.DATA])
    kind, stream, payload = frames[at]
    document = json.loads(payload)
    where, value = pick.choice(list(places(document))), pick.choice(ODD)
    text = json.dumps(changed(document, where, value)).encode()
    if pick.random() < 0.1:
        text = pick.choice((b"[" * 100_000, b"9" * 5000, b"\xff", b"NaN", b""))
    name = f"{FrameKind(kind).name} {where} = {value!r:.20}"
    return name, chained([*frames[:at], (kind, stream, text), *frames[at + 1 :]])


def faults(frames: list[tuple[int, int, bytes]], folder: Path, seeds: range) -> list[str]:
    """Return what ended in something else than a message or a file that can be verified."""
    found = []
    for seed in seeds:
        name, content = odd(frames, random.Random(seed))
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        journal = folder / "run-1.journal"
        journal.write_bytes(content)
        for what in (verify_journal, follow, lambda path: verify(seal(path))):
            try:
                what(journal)
            except BadInput as refused:
                if str(folder) not in str(refused):
                    found.append(f"{seed} {name}: the file is not named: {refused}")
            except Exception as error:  # noqa: BLE001 - each is told
                found.append(f"{seed} {name}: {type(error).__name__}: {str(error)[:200]}")
    return found


def follow(journal: Path) -> Any:
    """Read it as the live page does."""
    tail = JournalTail(journal)
    try:
        return tail.poll()
    finally:
        tail.close()


def test_a_whole_journal_is_taken(frames: list[tuple[int, int, bytes]], tmp_path: Path) -> None:
    journal = tmp_path / "run-1.journal"
    journal.write_bytes(chained(frames))
    assert not [one for one in verify(seal(journal)) if one.level == "fault"]


def test_odd_documents_in_whole_frames_end_in_a_message(
    frames: list[tuple[int, int, bytes]], tmp_path: Path
) -> None:
    assert not faults(frames, tmp_path / "runs", range(60))


@pytest.mark.long
def test_no_odd_document_ends_in_a_bug(frames: list[tuple[int, int, bytes]], tmp_path: Path) -> None:
    assert not faults(frames, tmp_path / "runs", range(5000))
