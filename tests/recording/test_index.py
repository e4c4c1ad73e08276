"""The index of run files: quick, never believed when it may be wrong, never needed."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding import cache_file as cachefile
from bufferstand.recording.finding import index
from bufferstand.recording.finding.index import FILE_NAME, RECORDED, indexed_runs, recorded_facts
from bufferstand.recording.finding.query import parse_query
from bufferstand.recording.finding.run_facts import list_runs
from bufferstand.recording.runfile import open_run
from tests.evaluation_report.make_runs import PAPER_LIKE, write_campaign
from tests.hostile_runs.crafting import with_document

CHANGES = {
    "no json": "'{'",
    "other keys": """'{"colour": "red"}'""",
    "other value": "replace(facts, '\"prestress_mm\": ', '\"prestress_mm\": 9')",
    "no text": "CAST(x'7bff' AS TEXT)",
}


@pytest.fixture
def campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(cachefile, "SETTLED_S", 0.0)
    folder = write_campaign(tmp_path / "campaign", PAPER_LIKE[4:6])
    for path in folder.rglob("*.h5"):
        path.chmod(0o644)
    return folder


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the files that were opened."""
    names: list[str] = []
    real = index.facts_of

    def facts_of(path: Path) -> object:
        names.append(path.name)
        return real(path)

    monkeypatch.setattr(index, "facts_of", facts_of)
    return names


def test_the_same_without_opening(campaign: Path, tmp_path: Path, opened: list[str]) -> None:
    truth = list_runs(campaign)
    assert indexed_runs(campaign, tmp_path) == truth
    assert len(opened) == 2
    assert indexed_runs(campaign, tmp_path) == truth
    assert len(opened) == 2
    assert set(recorded_facts(truth[0])) == {field.fact for field in RECORDED.values()}
    assert recorded_facts(truth[0])["specimen"] == "KX-0815"


def test_what_changed_is_opened(campaign: Path, tmp_path: Path, opened: list[str]) -> None:
    indexed_runs(campaign, tmp_path)
    one, two = sorted(campaign.rglob("*.h5"))
    facts = one.stat()
    one.write_bytes(two.read_bytes())
    os.utime(one, ns=(facts.st_atime_ns, facts.st_mtime_ns))
    opened.clear()
    assert indexed_runs(campaign, tmp_path) == list_runs(campaign)
    assert opened == [one.name]
    two.unlink()
    assert [run.path for run in indexed_runs(campaign, tmp_path)] == [one]


def test_a_file_that_cannot_be_read_is_named_each_time(campaign: Path, tmp_path: Path) -> None:
    (campaign / "bad.h5").write_text("nothing")
    for _ in range(2):
        problems = [run.problem for run in indexed_runs(campaign, tmp_path) if run.problem]
        assert problems == ["no HDF5 file"]


@pytest.mark.parametrize("damage", ["no database", *CHANGES, "no folder", "read-only"])
def test_done_without(campaign: Path, tmp_path: Path, damage: str) -> None:
    truth = indexed_runs(campaign, tmp_path)
    file = tmp_path / FILE_NAME
    folder = tmp_path
    if damage == "no database":
        file.write_bytes(b"x" * 10_000)
    elif damage in CHANGES:
        with sqlite3.connect(file) as connection:
            connection.execute(f"UPDATE runs SET facts = {CHANGES[damage]}")
        connection.close()
    elif damage == "no folder":
        folder = file / "below"
    else:
        file.unlink()
        file.mkdir()
    assert indexed_runs(campaign, folder) == truth


def test_no_runs(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no run files"):
        indexed_runs(tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("stated", "shown"),
    [
        ("0001-01-01T00:30:00+01:00", "0001-01-01T00:30:00+01:00"),
        (20260305, None),
        ("2026-03-05T00:30:00+01:00", "2026-03-04T23:30:00+00:00"),  # imports of before 2026-11-22
        ("2026-03-05T00:30:00Z", "2026-03-05T00:30:00Z"),
        (None, None),
    ],
)
def test_a_start_in_another_zone_is_listed_in_utc(tmp_path: Path, stated: object, shown: str | None) -> None:
    with_document(tmp_path, lambda document: document["run"].update(started_utc=stated))
    assert list_runs(tmp_path)[0].started_utc == shown


def test_facts_of_other_types_are_listed_and_found(tmp_path: Path) -> None:
    """The list is of the documents alone; whoever evaluates such a run is told what is wrong with it."""

    def foreign(document: dict[str, Any]) -> None:
        document["run"] |= {"operator": 5, "campaign": ["a"], "started_utc": "yesterday"}
        document["specimen"] = {"id": 815}
        document["step"] = {"prestress_mm": "20", "amplitude_mm": None, "frequency_Hz": True}

    path = with_document(tmp_path, foreign)
    with pytest.raises(BadInput, match=r"run\.campaign: is no name"):
        open_run(path)
    (run,) = list_runs(tmp_path)
    assert (run.specimen_id, run.operator, run.campaign) == ("815", "5", None)
    assert (run.prestress_mm, run.amplitude_mm, run.frequency_Hz) == (None, None, None)
    for text in ("'81' in specimen", "date is not None and not prestress_mm == 20 or operator == '5'"):
        assert parse_query(text, RECORDED).matches(recorded_facts(run))
    assert not parse_query("date > '2026'", RECORDED).matches(recorded_facts(run))
