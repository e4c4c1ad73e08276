"""What pages are told: every change once; the journal's tail; the files in the wheel."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from bufferstand.daq.monitor.app import CONTENT_TYPES, static_files
from bufferstand.daq.monitor.journal_tail import JournalTail, newest_journal
from bufferstand.daq.monitor.view import KEPT_PACKETS, Cursor, View
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import HARMONIC, Lines
from tests.daq.test_runner import Case

ROOT = Path(__file__).parents[2]


def test_a_page_is_told_what_has_changed_and_only_that() -> None:
    now = [0.0]
    view, cursor = View(lambda: now[0]), Cursor()
    view.put("steps", [1])
    view.add_rows({"t": [0], "s": [1], "f": [2]})
    now[0] = 2.0
    first = json.loads(view.news(cursor) or "")
    assert first == {
        "rows": [{"t": [0], "s": [1], "f": [2]}],
        "sections": {"steps": [1]},
        "age_s": 2.0,
        "skipped": 0,
    }
    assert view.news(cursor) is None
    view.put("steps", [1])
    assert view.news(cursor) is None, "the same again is no news"
    view.put("steps", [2])
    assert json.loads(view.news(cursor) or "")["sections"] == {"steps": [2]}
    assert json.loads(view.news(Cursor()) or "")["rows"], "a page that comes later begins with what is kept"
    assert json.loads(view.sign_of_life()) == {"age_s": 2.0}


def test_a_page_that_is_far_behind_skips_and_is_told_how_much() -> None:
    view, cursor = View(), Cursor()
    view.add_rows({"t": [0]})
    view.news(cursor)
    for number in range(KEPT_PACKETS + 7):
        view.add_rows({"t": [number]})
    message = json.loads(view.news(cursor) or "")
    assert len(message["rows"]) == KEPT_PACKETS
    assert message["skipped"] == 7
    view.add_rows({"t": [1]})
    assert json.loads(view.news(cursor) or "")["skipped"] == 7


def test_no_age_without_a_sample_and_no_nan_ever() -> None:
    view = View()
    assert json.loads(view.sign_of_life()) == {"age_s": None}
    with pytest.raises(ValueError, match="JSON"):
        view.put("now", {"force_kN": float("nan")})


# --- the journal's tail ------------------------------------------------------------------------------


class Tailing(Lines):
    """Follows the journal while the campaign runs."""

    def __init__(self, runs: Path) -> None:
        super().__init__()
        self.runs, self.tail, self.news = runs, None, []

    def update(self, progress: object) -> None:  # noqa: ARG002 - a sink's signature
        path = newest_journal(self.runs)
        if self.tail is None and path is not None:
            self.tail = JournalTail(path)
        if self.tail is not None and not any(news.ended for news in self.news):
            self.news.append(self.tail.poll())


def test_the_journals_tail_says_what_the_run_file_will_say(tmp_path: Path) -> None:
    case = Case(tmp_path, HARMONIC)
    tailing = Tailing(case.out / "runs")
    case.shown = tailing
    (path,) = case.run().runs
    tailing.news.append(tailing.tail.poll())
    tailing.tail.close()
    run, news = open_run(path), tailing.news
    assert sum(one.samples for one in news) == run.streams["controller"].rows
    tops = [one.extremes["stroke"][1] for one in news if one.extremes]
    assert max(tops) == pytest.approx(run.series("stroke").value.max(), abs=1e-3)
    readings = [value for one in news for _, value in one.readings.get("temperature_1", [])]
    assert len(readings) == run.streams["temperature_1"].rows
    lines = [line["text"] for one in news for line in one.lines]
    assert lines == [f"{event.kind}: {event.text}" for event in run.events]
    assert [bool(one.guards) for one in news].count(True) == 1
    stroke = next(one for one in news[-1].margins if one["name"] == "stroke")
    top_mm = max(tops)
    assert stroke["share"] == pytest.approx(top_mm / 252.0, rel=1e-3), "the run's own guards see the journal"
    assert "lag" not in {one["name"] for one in news[-1].margins}, "what a journal does not hold is not shown"


# --- what is shipped ---------------------------------------------------------------------------------


def test_every_file_of_the_page_is_there_and_nothing_else() -> None:
    folder = ROOT / "daq" / "monitor" / "static"
    assert {path.name for path in folder.iterdir()} == set(CONTENT_TYPES)
    assert all(static_files().values())
    assert b"Permission is hereby granted" in static_files()["uplot.LICENSE"]


def test_the_files_of_the_page_are_in_the_wheel() -> None:
    from hatchling.builders.wheel import WheelBuilder

    shipped = {file.distribution_path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    assert {f"bufferstand/daq/monitor/static/{name}" for name in CONTENT_TYPES} <= shipped


def test_the_page_names_no_other_address_and_sets_no_markup() -> None:
    for name, content in static_files().items():
        text = content.decode()
        if name.startswith("uplot."):
            continue
        assert "innerHTML" not in text, name
        assert "insertAdjacentHTML" not in text
        assert "document.write" not in text
        addresses = set(re.findall(r"(?:https?:|wss?:|(?<=[\"'(]))//[^\"'`\s)]+", text))
        assert addresses <= {"http://www.w3.org/2000/svg", "ws://${location.host}/live"}, name
