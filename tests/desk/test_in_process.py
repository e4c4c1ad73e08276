"""Every page of the desk, and what it does, without server and browser."""

from __future__ import annotations

import re
import shutil
import socket
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bufferstand.cli.beginning.answers import Answers
from bufferstand.daq.desk.beginning import AS_PROPOSED, in_page_words
from tests.desk.in_process import DeskInProcess
from tests.desk.served import HACK, SAMPLES, laboratory

RUN = "runs/005-harmonic-20mm-20mm-1.27Hz.h5"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("desk") / "laboratory"
    shutil.copytree(SAMPLES, folder, ignore=shutil.ignore_patterns("*.md", "wires"))
    return folder


@pytest.fixture(scope="module")
def desk(root: Path) -> Iterator[DeskInProcess]:
    it = DeskInProcess(root)
    with it.jobs.ending():
        yield it


@pytest.mark.parametrize(
    ("path", "query", "shown"),
    [
        ("/", "", "demo.toml"),
        ("/new", "", "specimen"),
        ("/prepare", "", "en15551.toml"),
        ("/prepare", {"campaign": "demo.toml"}, "prestress"),
        ("/check", "", "stand.toml"),
        ("/check", {"stand": "stand.toml"}, "simulate-stand stand.toml"),
        ("/check", {"campaign": "demo.toml"}, "Check"),
        ("/start", "", "demo.toml"),
        ("/start", {"campaign": "demo.toml"}, "--yes-move SPECIMEN"),
        ("/campaign", "", "Campaigns"),
        ("/results", "", "Results"),
        ("/results", {"folder": "runs"}, "Requirements"),
        ("/results", {"run": RUN}, "Requirements"),
        ("/archive", "", "Find runs"),
        ("/archive/run", {"path": RUN}, "A-105-E-01"),
    ],
)
def test_each_page_is_shown(desk: DeskInProcess, path: str, query: object, shown: str) -> None:
    answer = desk.look(path, query)
    assert answer.status == 200, answer.text[-2000:]
    assert shown in answer.text
    assert (
        "default-src 'none'" in answer.headers["content-security-policy"]
        or "default-src 'self'" in (answer.headers["content-security-policy"])
    )


@pytest.mark.parametrize(
    ("path", "query"),
    [
        ("/prepare", {"campaign": "../outside.toml"}),
        ("/prepare", {"campaign": "nothing.toml"}),
        ("/check", {"stand": "demo.toml"}),
        ("/start", {"campaign": "stand.toml"}),
        ("/campaign", {"folder": "runs"}),
        ("/report/file", {"path": "demo.toml"}),
        ("/report/made", {"folder": "../outside"}),
        ("/results", {"folder": "/etc"}),
        ("/results", {"run": "demo.toml"}),
        ("/archive/run", {"path": "demo.toml"}),
        ("/prepare/picture/none", ""),
    ],
)
def test_what_is_not_there_or_lies_elsewhere_is_said_in_one_page(
    desk: DeskInProcess, path: str, query: object
) -> None:
    answer = desk.look(path, query)
    assert answer.status == 404
    assert "Traceback" not in answer.text


def test_the_form_changes_one_value_of_the_text_and_saves_it_unless_somebody_else_did(
    desk: DeskInProcess, root: Path
) -> None:
    shutil.copy(root / "demo.toml", root / "mine.toml")
    text = (root / "mine.toml").read_text()
    said = {
        "name": "mine.toml",
        "text": text,
        "what": "set",
        "path": ["limits", "temperature_stop_C"],
        "value": "38",
    }
    changed = desk.act("/prepare/edit", said).json["text"]
    assert tomllib.loads(changed) == {
        **(was := tomllib.loads(text)), "limits": {**was["limits"], "temperature_stop_C": 38.0}
    }  # fmt: skip
    assert desk.act("/prepare/edit", {**said, "value": "warm"}).status == 409
    assert desk.act("/prepare/edit", {**said, "path": ["limits", "nothing"]}).status == 409
    more = desk.act(
        "/prepare/edit", {"name": "mine.toml", "text": text, "what": "add", "kind": "static"}
    ).json
    assert len(tomllib.loads(more["text"])["step"]) == len(was["step"]) + 1
    less = desk.act(
        "/prepare/edit", {"name": "mine.toml", "text": more["text"], "what": "remove", "index": 0}
    ).json
    assert len(tomllib.loads(less["text"])["step"]) == len(was["step"])
    saved = {"name": "mine.toml", "text": changed, "base": "another"}
    refused = desk.act("/prepare/save", saved)
    assert refused.status == 409
    assert "by somebody else" in refused.json["problem"]
    assert (root / "mine.toml").read_text() == text
    assert desk.act("/prepare/save", {**saved, "as": "of-mine"}).json["name"] == "of-mine.toml"
    assert (root / "of-mine.toml").read_text() == changed
    assert desk.act("/prepare/save", {**saved, "as": "of-mine"}).status == 409, "it is there already"
    assert desk.act("/prepare/save", {**saved, "as": "../of-mine"}).status == 409


def test_a_plan_that_breaks_a_limit_is_said_at_its_line(desk: DeskInProcess, root: Path) -> None:
    text = (root / "demo.toml").read_text()
    wrong = text.replace("temperature_stop_C = 40.0", "temperature_stop_C = 4000.0", 1)
    assert wrong != text
    answer = desk.act("/prepare/plan", {"name": "demo.toml", "text": wrong, "page": "p"}).json
    assert "temperature_stop_C" in answer["wrong"]
    assert wrong.splitlines()[answer["line"] - 1].startswith("temperature_stop_C")
    assert not list(root.glob(".*.toml")), "the draft is gone"


def test_the_start_is_of_this_computer_with_the_specimen_typed(desk: DeskInProcess, root: Path) -> None:
    asked = {"campaign": "demo.toml", "specimen": "A-105-E-01", "out": "campaigns/one", "simulate": True}
    elsewhere = desk.act("/start", asked, client="192.168.1.7")
    assert elsewhere.status == 403
    assert "this is done at the stand" in elsewhere.json["problem"]
    assert desk.act("/start", asked, session="none").status == 403
    assert desk.act("/start", {**asked, "specimen": ""}).status == 409
    assert desk.act("/start", {**asked, "speed": "1000"}).status == 409
    assert desk.act("/start", asked, origin="http://elsewhere.example").status == 403
    assert desk.act("/start", asked, **{"content-type": "text/plain"}).status == 415
    assert not (root / "campaigns").exists()


@pytest.mark.parametrize("text", ["a\0b", "\ud800", "x\udfff"], ids=ascii)
@pytest.mark.parametrize(
    ("path", "form", "key"),
    [
        ("/check/record", {"stand": "stand.toml", "lasting": "1s"}, "operator"),
        ("/check/zero", {"stand": "stand.toml", "id": "simulated-630kN"}, "specimen"),
        ("/start/command", {"campaign": "demo.toml"}, "out"),
        ("/new/command", {"where": "first"}, "stand"),
    ],
)
def test_what_no_command_can_be_given_is_refused_in_one_line(
    desk: DeskInProcess, path: str, form: dict[str, str], key: str, text: str
) -> None:
    answer = desk.act(path, {**form, key: text})
    assert answer.status == 409
    assert "\n" not in answer.json["problem"]


@pytest.mark.parametrize(
    ("form", "command"),
    [
        ({}, "run demo.toml --out campaigns/one --yes-move SPECIMEN"),
        ({"specimen": "B 7", "speed": "5"}, "run demo.toml --out campaigns/one --yes-move 'B 7'"),
        (
            {"specimen": "B-7", "simulate": True, "speed": "5", "out": "-x"},
            "run demo.toml --out ./-x --yes-move B-7 --simulate --speed 5",
        ),
    ],
    ids=str,
)
def test_the_start_shows_the_command_that_does_what_its_form_says(
    desk: DeskInProcess, form: dict[str, Any], command: str
) -> None:
    """Else whoever copies the command while a rehearsal is ticked moves the stand."""
    answer = desk.act("/start/command", {"campaign": "demo.toml", "out": "campaigns/one", **form})
    assert answer.json["command"].endswith(f"bufferstand {command}")


def test_the_archive_finds_by_words_and_conditions_and_hands_on_a_table(desk: DeskInProcess) -> None:
    assert desk.look("/archive/runs").json["all"] == 6
    found = desk.look("/archive/runs", {"where": "frequency_Hz > 1", "words": "160"}).json
    assert [row["path"] for row in found["rows"]] == [RUN]
    assert desk.look("/archive/runs", {"where": "frequency_Hz >"}).status == 409
    assert desk.look("/archive/runs", {"first": "many"}).status == 400
    hints = desk.look("/archive/hints").json
    assert hints["specimen"] == ["A-105-E-01"]
    for words in (hints["kind"][-1], hints["step"][0]):
        assert desk.look("/archive/runs", {"words": words}).json["found"] > 0
    table = desk.look("/archive/table", {"words": "static"})
    assert table.headers["content-type"].startswith("text/csv")
    assert len(table.text.splitlines()) == 2


@pytest.mark.parametrize(
    ("path", "content"),
    [
        ("/campaign/stop", {"folder": "runs", "after": "now"}),
        ("/campaign/note", {"folder": HACK, "text": HACK}),
        ("/campaign/resume", {"folder": "runs", "specimen": "A"}),
        ("/campaign/live", {"folder": "nowhere"}),
        ("/results/again", {"folder": ["runs"]}),
        ("/prepare/edit", {"name": "demo.toml", "text": 5}),
        ("/prepare/edit", {"name": "demo.toml", "text": "a = [", "what": "add", "kind": "static"}),
    ],
)
def test_what_cannot_be_done_is_answered_with_one_message(
    desk: DeskInProcess, path: str, content: dict[str, object]
) -> None:
    answer = desk.act(path, content)
    assert answer.status == 409, answer.text
    assert answer.json["problem"]
    assert "Traceback" not in answer.text


def test_an_evaluation_is_given_with_the_command_that_makes_it(desk: DeskInProcess) -> None:
    found = desk.look("/results/evaluation", {"run": RUN}).json
    assert found["command"].endswith(f"evaluate {RUN}")
    (run,) = found["runs"]
    damping, u = run["values"]["damping"]
    assert damping == pytest.approx(0.222, abs=0.002)
    assert 0.001 < u < 0.01


@pytest.mark.parametrize(
    ("content", "field", "said"),
    [
        ({"port": "99999"}, "port", "99999 is not from 1 to 65535"),
        ({"port": "abc"}, "port", "“abc” is no number"),
        ({"stroke-max": "abc"}, "stroke-max", "“abc” is no number"),
        ({"draw-wires": "9"}, "draw-wires", "9 is not from 1 to 4"),
        ({"zero-force": "0,1", "slope-force": "x"}, "slope-force", "“x” is no number; write e.g. 9.54e-05"),
        ({"zero-force": "0,1"}, "slope-force", "is missing: a zero alone makes no measure of a reading"),
    ],
    ids=str,
)
def test_a_wrong_value_of_the_first_files_is_said_at_its_field_in_the_pages_words(
    desk: DeskInProcess, root: Path, content: dict[str, str], field: str, said: str
) -> None:
    answer = desk.act("/new", {"where": "first", **content})
    assert (answer.status, answer.json["field"]) == (409, field)
    assert answer.json["problem"].startswith(said)
    assert "range" not in answer.json["problem"]
    assert "--" not in answer.json["problem"]
    assert not (root / "first").exists()


@pytest.mark.parametrize(
    ("content", "command"),
    [
        ({}, "init FOLDER --yes"),
        ({"where": "two", "controller": "ring", "model": True, "second-force": True}, "init two --yes"),
        (
            {"where": "two", "stand": "hall 2", "force-max": "1,5", "zero-force": "0,1", "slope-force": "2"},
            "init two --yes '--stand=hall 2' --force-max=1.5 --coefficients=force=0.1,2",
        ),
        (
            {"where": "two", "controller": "rmc", "second-force": False, "further-pressure": True},
            "init two --yes --controller=rmc --no-second-force --further=pressure",
        ),
    ],
    ids=str,
)
def test_the_shown_command_is_that_of_what_is_typed(
    desk: DeskInProcess, content: dict[str, object], command: str
) -> None:
    assert desk.act("/new/command", content).json["command"].endswith(command)
    assert desk.act("/new/command", {"where": "../other"}).status == 409


def test_a_touch_off_is_of_the_campaigns_specimen(desk: DeskInProcess) -> None:
    typed = {"stand": "stand.toml", "campaign": "demo.toml", "id": "simulated-630kN"}
    for specimen, said in (("", "the specimen's id was not typed"), ("A-1", "“A-1” was given")):
        answer = desk.act("/check/zero", {**typed, "specimen": specimen})
        assert answer.status == 409
        assert said in answer.json["problem"]
        assert "nothing was moved" in answer.json["problem"]


def test_what_is_about_no_field_keeps_its_words() -> None:
    assert in_page_words("neu: cannot be written: Permission denied")[0] == ""
    assert in_page_words("--certificate: “x” is no day; write it as 2027-01-31")[0] == ""


@pytest.mark.slow
def test_a_twin_that_runs_faster_is_said_beside_what_is_found_of_it(tmp_path: Path) -> None:
    laboratory(tmp_path)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    stand = tmp_path / "stand.toml"
    text, number = re.subn(r"(?m)^port = \d+", f"port = {port}", stand.read_text())
    assert number == 1
    stand.write_text(text)
    it = DeskInProcess(tmp_path)
    with it.jobs.ending():
        assert it.act("/check/twin", {"stand": "stand.toml", "what": "end"}).json["was"] is False
        assert it.act("/check/twin", {"stand": "stand.toml", "what": "serve", "speed": "5"}).status == 200
        assert '<option value="5" selected' in it.look("/check", {"stand": "stand.toml"}).text
        found = it.act("/check/run", {"stand": "stand.toml"})
        assert "The simulated twin runs at 5 times real time" in found.json["html"]
        assert it.act("/check/twin", {"stand": "stand.toml", "what": "end"}).json["was"] is True
        assert "selected" not in it.look("/check", {"stand": "stand.toml"}).text.split('value="5"')[1][:10]


def test_the_words_left_out_of_a_shown_command_are_what_init_takes_without_them() -> None:
    proposed = Answers()
    for word in AS_PROPOSED:
        option, _, value = word.removeprefix("--").partition("=")
        assert str(getattr(proposed, option.replace("-", "_"))) == (value or "True"), word
