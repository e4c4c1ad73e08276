"""A campaign's own files, mistyped by hand or by a bad disk: one message with file and line, no traceback."""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path

import pytest

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.daq.campaign_folder import begin_record, load_record, read_as_run
from bufferstand.daq.campaign_folder.as_run import report_rows, totals
from bufferstand.daq.campaign_folder.start_records import changes_taken, doubts_before, edits_taken
from bufferstand.daq.monitor.campaign_view import campaign_section, steps_section
from bufferstand.daq.operator import add_note, read_notes
from bufferstand.daq.strokes import learned_in, read_strokes
from bufferstand.daq.zero.file import kept_zero
from bufferstand.foundation.errors import BadInput
from tests.hostile.attempts import attempt, bugs
from tests.hostile.documents import ODD, changed, places

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
CAMPAIGN = """
[campaign]
id = "c"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
[conditions]
ambient_C = 21.0
[[step]]
kind = "static"
force_limit_kN = 60.0
speed_mm_per_s = 20.0
"""
LINES = ("as-run.jsonl", "strokes.jsonl", "notes.jsonl")
FILES = ("campaign.json", "zero.json", *LINES)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a campaign that was run on the simulated stand."""
    samples = shutil.copytree(SAMPLES, tmp_path_factory.mktemp("campaign") / "samples")
    (samples / "c.toml").write_text(CAMPAIGN, "utf-8")
    folder = samples / "out"
    ended = attempt("run", samples / "c.toml", "--simulate", "--speed", 20, "--out", folder)
    assert ended.status == 0, ended
    add_note(folder, "a note")
    return folder


@pytest.fixture
def folder(run_folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(run_folder, tmp_path / "out"))


def read_everything(folder: Path, campaign: Path) -> None:
    """Read a campaign's folder as every command and the page do between them."""
    plan = prepare(campaign).plan
    record = load_record(folder)
    assert record is not None
    campaign_section(record, folder)
    steps_section(record)
    begun = begin_record(plan, record, "", folder)
    edits_taken(begun), doubts_before(begun), changes_taken(begun)
    rows = read_as_run(folder)
    report_rows(rows)
    totals(rows).sentence()
    [(row.sentence(), row.observation()) for row in rows]
    [note.text.upper() for note in read_notes(folder)]
    read_strokes(folder)
    learned_in(folder)
    kept_zero(folder)


def attempts(folder: Path, campaign: Path, seeds: range) -> list[str]:
    """Return every bug that odd values in the folder's files have led to."""
    found = []
    for seed in seeds:
        pick = random.Random(seed)
        path = folder / FILES[seed % len(FILES)]
        before = path.read_bytes()
        lines = before.decode("utf-8").splitlines() if path.name in LINES else [before.decode("utf-8")]
        at = pick.randrange(len(lines))
        content = json.loads(lines[at])
        where = pick.choice(list(places(content)))
        value = pick.choice(ODD)
        lines[at] = json.dumps(changed(content, where, value))
        path.write_text("\n".join(lines) + "\n", "utf-8")
        try:
            read_everything(folder, campaign)
        except BadInput as refused:
            if refused.file != str(path):
                found.append(f"{path.name} {where} = {value!r:.20}: told of another file: {refused}")
        except Exception as error:  # noqa: BLE001 - each bug is told
            found.append(f"{path.name} {where} = {value!r:.20}: {type(error).__name__}: {error}")
        path.write_bytes(before)
    return found


def test_odd_values_in_a_campaigns_files_are_refused_or_harmless(run_folder: Path, folder: Path) -> None:
    assert not attempts(folder, run_folder.parent / "c.toml", range(300))


@pytest.mark.long
def test_no_odd_value_in_a_campaigns_files_ends_in_a_bug(run_folder: Path, folder: Path) -> None:
    assert not attempts(folder, run_folder.parent / "c.toml", range(20_000))


def test_a_mistyped_value_is_named_with_its_line_and_what_to_do(run_folder: Path, folder: Path) -> None:
    path = folder / "as-run.jsonl"
    row = json.loads(path.read_text("utf-8"))
    path.write_text(f"{json.dumps(row)}\n{json.dumps(row | {'duration_s': '14 s'})}\n", "utf-8")
    ended = attempt("plan", run_folder.parent / "c.toml", "--against", folder)
    assert (ended.status, ended.bug) == (2, "")
    assert f'{path}: line 2: duration_s = "14 s": it should be a valid number' in ended.message
    assert "take the line out" in ended.message


def test_a_line_that_was_cut_off_is_left_out_as_ever(folder: Path) -> None:
    path = folder / "as-run.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole + whole[: len(whole) // 2] + b"\xff")
    assert len(read_as_run(folder)) == 1


@pytest.mark.dose(10)
@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "content", [b"[" * 100_000, b'{"a": ' + b"9" * 5000 + b"}", b"\xff\xfe", b"null", b"NaN", b""]
)
def test_hostile_json_is_no_traceback(name: str, content: bytes, run_folder: Path, folder: Path) -> None:
    (folder / name).write_bytes(content)
    ended = [
        ("plan", attempt("plan", run_folder.parent / "c.toml", "--against", folder)),
        ("resume", attempt("resume", folder)),
        ("report", attempt("report", folder, "--out", folder / "report")),
        ("runs", attempt("runs", folder)),
    ]
    assert not bugs(ended)
