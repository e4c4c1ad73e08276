"""What pages are told: every change once; margins; the journal's tail; the files in the wheel."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.monitor.app import CONTENT_TYPES, static_files
from bufferstand.daq.monitor.margins import Recent, margins, top_speed
from bufferstand.daq.monitor.tail import JournalTail, newest_journal
from bufferstand.daq.monitor.view import KEPT_PACKETS, Cursor, View
from bufferstand.recording.runfile import open_run
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


# --- margins -----------------------------------------------------------------------------------------


def recent(**extremes: tuple[float, float]) -> Recent:
    seen = Recent()
    seen.add(1.0, {name: list(span) for name, span in extremes.items()})
    return seen


GUARDS = {
    "channels": [
        {"name": "force", "signal": "force", "upper": 600.0, "lower": -50.0, "unit": "kN", "label": "force",
         "action": "stop", "hold_s": 0.0}
    ],
    "temperatures": [
        {"stream": "temperature_1", "place": "plate", "stop_C": 40.0, "resume_C": 30.0, "grace_s": 5.0,
         "action": "stop", "silence_action": "stop"},
        {"stream": "air", "place": "", "stop_C": None, "resume_C": None, "grace_s": 5.0,
         "action": "stop", "silence_action": "note"},
    ],
    "controller": {"silence_s": 2.0},
    "disk_stop_s": 10.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("span", "share", "text"),
    [
        ((0.0, 300.0), 0.5, "300.0 of 600 kN, 300.0 left"),
        ((-40.0, 300.0), 0.8, "-40.0 of -50 kN, 10.0 left"),
        ((0.0, 612.0), 1.02, "612.0 of 600 kN, 0.0 left"),
    ],
)
def test_the_nearer_side_counts(span: tuple[float, float], share: float, text: str) -> None:
    margin = margins(GUARDS, recent(force=span), 20.0)[0]
    assert (margin.share, margin.text) == (pytest.approx(share), text)


def test_margins_of_temperature_and_silence() -> None:
    seen = recent(force=(0.0, 1.0))
    seen.readings = {"temperature_1": [(0.0, 35.0)], "air": [(0.0, 20.0)]}
    seen.silent_s = {"temperature_1": 1.0, "air": 4.0, "controller": 0.5}
    seen.waiting_samples, seen.rate_Hz = 2000, 1000.0
    found = {margin.name: margin for margin in margins(GUARDS, seen, 20.0)}
    assert found["temperature_1"].share == pytest.approx(0.75), "15 K of 20 K above the air"
    assert "5.0 left" in found["temperature_1"].text
    assert found["air"].share == pytest.approx(0.8), "only its silence counts"
    assert found["silence controller"].share == pytest.approx(0.25)
    assert found["disk"].share == pytest.approx(0.2)


def test_a_peak_is_shown_for_ten_seconds_and_then_forgotten() -> None:
    seen = recent(force=(0.0, 500.0))
    seen.add(10.0, {"force": [0.0, 10.0]})
    assert seen.span("force") == (0.0, 500.0)
    seen.add(11.5, {"force": [0.0, 11.0]})
    assert seen.span("force") == (0.0, 11.0)
    assert seen.span("stroke") is None
    seen.add(1.0, {"force": [0.0, 3.0]})  # another session: its clock begins anew
    assert seen.span("force") == (0.0, 3.0)


def test_the_speed_of_a_sine_is_its_amplitude_times_its_circular_frequency() -> None:
    t = np.arange(0.0, 0.5, 0.005)
    stroke = 20.0 * np.sin(2.0 * np.pi * 2.0 * t)
    rows = {"t": np.rint(t * 1e4).astype(int).tolist(), "s": np.rint(stroke * 1000).astype(int).tolist()}
    assert top_speed(rows) == pytest.approx(2.0 * np.pi * 2.0 * 20.0, rel=0.02)
    assert top_speed({"t": [0], "s": [1]}) is None
    assert top_speed({}) is None


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
