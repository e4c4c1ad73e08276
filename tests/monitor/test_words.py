"""What the page says: in the laboratory's time, and in words of a page."""

from __future__ import annotations

import datetime
from importlib.resources import files
from pathlib import Path

import pytest

from bufferstand.daq.desk.shell import SHARED
from bufferstand.daq.monitor import static_files, time_zone
from bufferstand.daq.monitor.campaign_view import (
    event_line,
    line_words,
    note_words,
    page_words,
    windows_section,
)
from bufferstand.daq.monitor.time_zone import laboratory_zone
from bufferstand.daq.operator.control_socket import ask, listening
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        (
            "stopped by the operator: monitor: Ada at this computer (now)",
            "stopped by the operator: Ada at this computer",
        ),
        (
            "asked to stop after the cycle: monitor: Bob at 192.168.1.7 (cycle)",
            "asked to stop after the cycle: Bob at 192.168.1.7",
        ),
        (
            "stopped by the operator: bufferstand stop (now)",
            "stopped by the operator: somebody in a terminal or at the desk",
        ),
        (
            "stopped by the operator: monitor: Ada (night shift: 2) at fe80::1%eth0 (cycle)",
            "stopped by the operator: Ada (night shift: 2) at fe80::1%eth0",
        ),
        ("asked to stop after the step: key s", "asked to stop after the step: a key in its terminal"),
        (
            "temperature_1 (plate 3) 40.00 °C has reached the stop threshold of 40 °C",
            "temperature_1 (plate 3) 40.00 °C has reached the stop threshold of 40 °C",
        ),
    ],
)
def test_who_asked_is_said_and_not_by_which_command(said: str, shown: str) -> None:
    assert page_words(said) == shown


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        (
            "operator: asked to stop after the cycle: monitor: Ada at this computer (cycle)",
            "operator: asked to stop after the cycle: Ada at this computer",
        ),
        ("operator: monitor: Ada at this computer: it hums", "operator: Ada at this computer: it hums"),
        ("operator: sent SIGTERM to my monitor: no use", "operator: sent SIGTERM to my monitor: no use"),
        ("stop: operator: monitor: Ada at this computer (cycle)", "stop: operator: Ada at this computer"),
        ("campaign stopped: monitor: Ada at ::1 (now)", "campaign stopped: Ada at ::1"),
        ("trip: force 601 kN", "trip: force 601 kN"),
        ("a line", "a line"),
    ],
)
def test_events_name_who_asked_and_leave_notes_as_they_are(said: str, shown: str) -> None:
    assert line_words(said) == shown
    assert note_words("bufferstand stop (now) did it") == "bufferstand stop (now) did it"


def test_the_zone_is_that_of_the_reports_and_else_this_computers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TZ", "Europe/Prague")
    own = laboratory_zone([tmp_path])
    assert own["name"] == "Europe/Prague"
    (tmp_path / "report.toml").write_text('time_zone = "Asia/Kolkata"\n')
    assert laboratory_zone([tmp_path / "no", tmp_path]) == {"name": "Asia/Kolkata", "offset_min": 330}
    for wrong in (
        'time_zone = "Mars/Olympus"\n',
        "time_zone = 3\n",
        "time_zone = ",
        'time_zone = "../etc"\n',
    ):
        (tmp_path / "report.toml").write_text(wrong)
        assert laboratory_zone([tmp_path]) == own, "what is wrong with it, the report says"


def test_a_computer_that_does_not_name_its_zone_tells_its_offset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(time_zone, "_LINK", tmp_path / "localtime")
    monkeypatch.delenv("TZ", raising=False)
    found = laboratory_zone([])
    ahead = datetime.datetime.now().astimezone().utcoffset()
    assert ahead is not None
    assert found == {"name": "", "offset_min": round(ahead.total_seconds() / 60.0)}


def test_a_weaker_wish_is_answered_with_the_stop_that_is_in_force(tmp_path: Path) -> None:
    request = StopRequest()
    with listening(tmp_path, request):
        assert ask(tmp_path, {"stop": "step", "by": "Ada"}) == "stopping after the step"
        assert ask(tmp_path, {"stop": "now", "by": "Bob"}) == "stopping now"
        assert ask(tmp_path, {"stop": "cycle", "by": "Eve"}) == "stopping now already: Bob (now)"
    assert request.level is StopLevel.NOW


def test_a_static_test_of_such_a_buffer_has_the_windows_of_its_limit_set() -> None:
    class Record:
        plan = {  # noqa: RUF012
            "specimen": {"kind": "buffer", "max_stroke_mm": 105.0},
            "steps": [{"index": 1, "run_kind": "static"}, {"index": 2, "run_kind": "harmonic"}],
        }

    found = windows_section(Record())  # type: ignore[arg-type]
    at_60 = next(one for one in found if one["stroke_mm"] == 60.0)
    assert (at_60["lower_kN"], at_60["upper_kN"], at_60["steps"]) == (100.0, 400.0, [1])
    Record.plan["specimen"] = {"kind": "draw-gear"}  # type: ignore[assignment]
    assert windows_section(Record()) == []  # type: ignore[arg-type]


def test_an_event_says_its_kind_once() -> None:
    assert event_line("safe stop", "safe stop: force 0.0 kN") == "safe stop: force 0.0 kN"
    assert (
        event_line("trip", "stopped by the operator: key s")
        == "trip: stopped by the operator: a key in its terminal"
    )


def test_live_page_and_desk_count_by_one_function() -> None:
    """Each file of a page that imports it is served beside it: the live page's, and at the desk."""
    ours = {name: text.decode() for name, text in static_files().items() if name.endswith(".js")}
    desk = {
        path.name: path.read_text(encoding="utf-8")
        for path in Path(str(files("bufferstand.daq.desk"))).rglob("static/*.js")
    }
    told = [name for name, text in [*ours.items(), *desk.items()] if "function counted(" in text]
    assert told == ["counted.js"]
    using = [name for name, text in desk.items() if 'from "./counted.js"' in text]
    assert using == ["results.js"]
    assert "counted.js" in SHARED
    assert [name for name, text in ours.items() if 'from "./counted.js"' in text] == [
        "monitor.js",
        "results.js",
    ]
