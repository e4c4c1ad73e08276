"""What cutting the power has found, each as a test of its own."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from random import Random

import pytest

from bufferstand.daq.campaign_folder.folder import CampaignFolder
from bufferstand.daq.campaign_folder.inputs import copy_inputs, read_inputs
from bufferstand.daq.operator.notes import add_note, read_notes
from bufferstand.daq.zero.file import keep_zero, store_zero
from bufferstand.evaluation.report.source.number_range import number_of_range
from bufferstand.foundation.channels.zero import ChannelZero, Zero
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files import append_line, make_folder, write_whole
from bufferstand.recording.recorder import RunRecorder
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.seal_journal import seal_orphans
from tests.power_cut.disk import MANNERS, after_cut
from tests.power_cut.tape import ROOT, Tape, taped
from tests.recording import samples

NOTHING = MANNERS[0]


def left_at_end(tape: Tape) -> dict[str, bytes]:
    """Return the files that are left where nothing is that was not synchronised."""
    nodes = after_cut(tape, len(tape.entries), NOTHING, Random(0))
    found: dict[str, bytes] = {}

    def look(number: int, place: str) -> None:
        node = nodes[number]
        if not node.is_folder:
            found[place] = bytes(node.content[: node.size])
        for name, other in node.names.items():
            look(other, f"{place}/{name}" if place else name)

    look(ROOT, "")
    return found


def zero() -> Zero:
    found = ChannelZero(name="force", unit="kN", value=0.25, u=0.01)
    return Zero(how="tare", found="2026-03-01T08:00:00+00:00", channel=(found,))  # type: ignore[arg-type]


def test_the_folder_of_a_campaign_is_on_the_disk_before_anything_is_in_it(tmp_path: Path) -> None:
    with taped(tmp_path) as tape:
        folder = CampaignFolder(tmp_path / "a" / "b" / "out")
        write_whole(folder.runs / "file", b"content")
    assert left_at_end(tape) == {"a/b/out/runs/file": b"content"}


def test_a_folder_that_a_killed_start_has_made_is_brought_to_the_disk_by_the_next(tmp_path: Path) -> None:
    with taped(tmp_path) as tape:
        (tmp_path / "out" / "runs").mkdir(parents=True)  # and killed before it was synchronised
        write_whole(CampaignFolder(tmp_path / "out").runs / "file", b"content")
    assert left_at_end(tape) == {"out/runs/file": b"content"}


def test_the_copies_of_a_campaigns_files_are_on_the_disk_with_their_folders(tmp_path: Path) -> None:
    lab, root = tmp_path / "lab", tmp_path / "disk"
    (lab / "deep" / "deeper").mkdir(parents=True)
    root.mkdir()
    (lab / "campaign.toml").write_text('stand = "deep/deeper/stand.toml"\n')
    (lab / "deep" / "deeper" / "stand.toml").write_text("# a stand\n")
    with taped(root) as tape:
        copy_inputs(read_inputs(lab / "campaign.toml"), root)
    assert set(left_at_end(tape)) == {"inputs/campaign.toml", "inputs/deep/deeper/stand.toml"}


def test_the_first_line_of_a_file_is_on_the_disk_with_its_name(tmp_path: Path) -> None:
    with taped(tmp_path) as tape:
        add_note(tmp_path, "a note")
    (line,) = left_at_end(tape)["notes.jsonl"].splitlines()
    assert json.loads(line)["text"] == "a note"


@pytest.mark.parametrize("torn", [b'{"utc": "2026-03-01T08:0', bytes(700), b'{"utc": "' + bytes(80)])
def test_a_line_behind_one_that_was_torn_stands_by_itself(tmp_path: Path, torn: bytes) -> None:
    add_note(tmp_path, "before")
    with (tmp_path / "notes.jsonl").open("ab") as stream:
        stream.write(torn)
    add_note(tmp_path, "after")
    add_note(tmp_path, "later")
    assert [note.text for note in read_notes(tmp_path)] == ["before", "after", "later"]


def test_a_line_is_added_whole_where_the_system_takes_it_in_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.write
    monkeypatch.setattr(os, "write", lambda handle, data: real(handle, data[:7]))
    append_line(tmp_path / "file", "a line of more than seven bytes")
    assert (tmp_path / "file").read_text() == "a line of more than seven bytes\n"


def test_a_zero_is_on_the_disk_when_it_is_kept_and_when_it_is_stored(tmp_path: Path) -> None:
    with taped(tmp_path) as tape:
        keep_zero(tmp_path, zero())
        store_zero(tmp_path / "stand.toml", zero())
    left = left_at_end(tape)
    assert json.loads(left["zero.json"])["channel"][0]["value"] == 0.25
    assert b"0.25" in left["stand.zero.toml"]


def test_a_report_number_is_on_the_disk_with_the_name_of_its_register(tmp_path: Path) -> None:
    with taped(tmp_path) as tape:
        number_of_range("{running:04}", tmp_path / "numbers.csv", year=2026, evaluation="a", report="c")
    assert b"0001," in left_at_end(tape)["numbers.csv"]


def test_a_folder_in_one_that_may_not_be_read_can_be_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from bufferstand.foundation.files import durable

    def refuse(folder: Path) -> None:
        raise PermissionError(13, "Permission denied", str(folder))

    monkeypatch.setattr(durable, "sync_folder", refuse)
    make_folder(tmp_path)
    with pytest.raises(PermissionError):
        make_folder(tmp_path / "new")


def sealed_beside_its_journals(folder: Path, kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Record a run over two segments, seal it, and keep its journals apart."""
    from bufferstand.recording.sealing import seal_journal

    monkeypatch.setattr(seal_journal, "remove_journal", lambda path: shutil.move(path, kept / path.name))
    with RunRecorder(folder, "run-1", samples.metadata(), segment_bytes=4000) as recorder:
        for first in range(0, 400, 20):
            recorder.append(*samples.block(first))
            while recorder.written < first + 20:
                pass
    monkeypatch.undo()


def test_a_journal_that_has_lost_what_its_sealed_run_has_is_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that was given up after a failed sync is never synchronised: its last records may be gone."""
    kept = tmp_path / "kept"
    kept.mkdir()
    sealed_beside_its_journals(tmp_path, kept, monkeypatch)
    run_file = tmp_path / "run-1.h5"
    content = run_file.read_bytes()
    first = kept / "run-1.journal"
    (tmp_path / first.name).write_bytes(first.read_bytes()[:2500])
    shutil.copy(kept / "run-1.journal.1", tmp_path)
    assert seal_orphans(tmp_path) == [run_file]
    assert run_file.read_bytes() == content
    assert open_run(run_file).status == "complete"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kept", "run-1.h5"]


def test_a_journal_of_another_run_of_the_same_name_is_refused_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    sealed_beside_its_journals(tmp_path, kept, monkeypatch)
    content = (tmp_path / "run-1.h5").read_bytes()
    (tmp_path / "other").mkdir()
    with RunRecorder(tmp_path / "other", "run-1", samples.metadata(operator="another")) as recorder:
        recorder.append(*samples.block(0))
        shutil.copy(recorder.path, tmp_path)
    with pytest.raises(BadInput, match="another run has this name"):
        seal_orphans(tmp_path)
    assert (tmp_path / "run-1.h5").read_bytes() == content
    assert (tmp_path / "run-1.journal").exists()
