"""Before a real stand moves, a person says so: the question, its answers, what is not touched before."""

from __future__ import annotations

import json
import os
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.cli.arming import LOOK_S, Movement, ask_to_move, check_given, typed_line
from bufferstand.cli.campaign.movement import campaign_movement, motion_text
from bufferstand.cli.campaign.preparation import prepare
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic, RampTo, StaticCycles
from tests.cli.processes import bufferstand
from tests.terminals import in_terminal

SAMPLES = Path(__file__).parents[2] / "sample_runs"
SPECIMEN = "A-105-E-01"
COOLS = '[[step]]\nkind = "cool-down"\ntemperature_C = 30.0\n'
CAMPAIGN = f"""
[campaign]
id = "armed"
stand = "stand.toml"
specimen = "{SAMPLES}/specimens/category-a-elastomer.toml"
[[step]]
kind = "cool-down"
temperature_C = 30.0
[[step]]
kind = "harmonic"
name = "a sine"
prestress_mm = 20.0
amplitude_mm = 10.0
frequency_Hz = 1.0
cycles = 3
"""
MOVEMENT = Movement("specimen", SPECIMEN, (("stand", "here"), ("first motion", "a ramp")))


class Onlooker:
    """Stands where the controller should be, and counts who comes; it answers nobody."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.settimeout(0.1)
        self.port = self._server.getsockname()[1]
        self.visits = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        while not self._ending.is_set():
            try:
                wire, _ = self._server.accept()
            except TimeoutError:
                continue
            self.visits += 1
            wire.close()

    def end(self) -> None:
        self._ending.set()
        self._thread.join()
        self._server.close()


@contextmanager
def armed_campaign(folder: Path) -> Iterator[tuple[Path, Path, Onlooker]]:
    """Write a campaign on a stand whose controller is an onlooker."""
    onlooker = Onlooker()
    try:
        text = (SAMPLES / "stand.toml").read_text().replace("port = 15020", f"port = {onlooker.port}")
        (folder / "stand.toml").write_text(text)
        (folder / "armed.toml").write_text(CAMPAIGN)
        yield folder / "armed.toml", folder / "out", onlooker
    finally:
        onlooker.end()


def test_without_a_terminal_and_without_the_option_it_is_refused_and_touches_nothing(tmp_path: Path) -> None:
    with armed_campaign(tmp_path) as (campaign, out, onlooker):
        done = bufferstand("run", campaign, "--out", out)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "nothing was moved, and no device was touched" in line
    assert "no terminal to ask for it" in line
    assert f"add --yes-move {SPECIMEN}" in line
    assert not out.exists()
    assert onlooker.visits == 0


@pytest.mark.parametrize(
    ("cut", "role", "told"),
    [
        ("", "", "40 °C"),
        ("", "ambient", "none for heat: no thermometer on the specimen"),
        ("[temperature]", "", "none for heat: no thermometer on the specimen"),
    ],
)
def test_a_limit_of_heat_is_announced_only_where_a_thermometer_can_keep_it(
    tmp_path: Path, cut: str, role: str, told: str
) -> None:
    text = (SAMPLES / "stand.toml").read_text()
    if cut:
        text = text[: text.index(f"\n{cut}")] + text[text.index("\n[simulation]") :]
    if role:
        text = text.replace('role = "specimen"', f'role = "{role}"')
    (tmp_path / "stand.toml").write_text(text)
    consent = '\n[limits]\nno_temperature_stop = "two slow strokes"\n' if cut or role else ""
    campaign = CAMPAIGN.replace(COOLS, "") if consent else CAMPAIGN
    (tmp_path / "armed.toml").write_text(campaign.replace("\n[[step]]", f"{consent}\n[[step]]", 1))
    shown = campaign_movement(prepare(tmp_path / "armed.toml"), ()).facts
    assert dict(shown)["limits"].endswith(f" mm, {told}")
    without = [text for name, text in shown if name == "not guarded" and "no temperature stop" in text]
    assert [text.endswith("stated reason: two slow strokes") for text in without] == [True] * bool(consent)


@pytest.mark.parametrize("simulate", [(), ("--simulate",)])
def test_a_wrong_id_of_the_option_is_refused_with_both(tmp_path: Path, simulate: tuple[str, ...]) -> None:
    with armed_campaign(tmp_path) as (campaign, out, onlooker):
        done = bufferstand("run", campaign, "--out", out, "--yes-move", "B-7", *simulate)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert f"“B-7” was given, and the specimen is “{SPECIMEN}”" in line
    assert not out.exists()
    assert onlooker.visits == 0


@pytest.mark.parametrize(
    ("keys", "status", "told"),
    [
        ("A-105-E-02\r", 2, f"“A-105-E-02” was given, and the specimen is “{SPECIMEN}”"),
        pytest.param("y\r", 2, "“y” was given", marks=pytest.mark.long),
        pytest.param("\r", 2, "the specimen's id was not given", marks=pytest.mark.long),
        ("\x04", 2, "the specimen's id was not given"),
        ("\x03", 3, "stopped by the operator: nothing was moved, and no device was touched"),
    ],
)
def test_another_answer_at_the_terminal_moves_nothing(
    tmp_path: Path, keys: str, status: int, told: str
) -> None:
    with armed_campaign(tmp_path) as (campaign, out, onlooker):
        with in_terminal("run", campaign, "--out", out) as terminal:
            shown = terminal.wait_for(r"id of the specimen that is to be moved: ")
            assert onlooker.visits == 0, "nothing is asked of a device before the answer"
            terminal.press(keys)
            assert terminal.end() == status
        for part in (
            "THIS MOVES A REAL STAND", f"127.0.0.1:{onlooker.port}", SPECIMEN, "600 kN, 105 mm",
            "step 2 of 2 “a sine”: ramp (target 20 mm, speed 20 mm/s), then harmonic (mean 20 mm",
        ):  # fmt: skip
            assert part in shown, part
        assert told in terminal.text
        assert "Traceback" not in terminal.text
        assert onlooker.visits == 0
        assert not out.exists()


def test_what_is_typed_before_the_question_is_no_answer(tmp_path: Path) -> None:
    with (
        armed_campaign(tmp_path) as (campaign, out, onlooker),
        in_terminal("run", campaign, "--out", out) as it,
    ):
        it.press(f"{SPECIMEN}\r")
        it.wait_for(r"id of the specimen that is to be moved: ")
        it.press("\r")
        assert it.end() == 2
        assert onlooker.visits == 0


@pytest.mark.parametrize("typed", [True, False])
def test_the_right_answer_lets_it_begin_and_is_kept(tmp_path: Path, typed: bool) -> None:
    with armed_campaign(tmp_path) as (campaign, out, onlooker):
        words = ("run", campaign, "--out", out, *(() if typed else ("--yes-move", SPECIMEN)))
        with in_terminal(*words) as terminal:
            if typed:
                terminal.wait_for(r"id of the specimen that is to be moved: ")
                terminal.press(f" {SPECIMEN} \r")
            terminal.wait_for("THIS MOVES A REAL STAND")
            assert terminal.end() == 4, "the onlooker is no controller"
        assert onlooker.visits > 0
        (start,) = json.loads((out / "campaign.json").read_text())["starts"]
        assert start["arming"]["subject_id"] == SPECIMEN
        assert start["arming"]["how"] == ("typed" if typed else "--yes-move")
        assert start["arming"]["by"]
        assert start["arming"]["at_utc"].endswith("+00:00")


@given(st.text(max_size=12))
def test_only_the_id_is_the_id(answer: str) -> None:
    if answer.strip() == SPECIMEN:
        check_given(MOVEMENT, answer)
        return
    with pytest.raises(BadInput, match="nothing was moved"):
        check_given(MOVEMENT, answer)


def test_an_accent_may_be_written_in_either_way() -> None:
    check_given(replace(MOVEMENT, subject_id="Prüfling é"), "Pru\u0308fling e\u0301")


class _Keyboard:
    """Standard input that is read only once there is something: a read that waits does not see a Ctrl-C."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def fileno(self) -> int:
        return self._descriptor

    def readline(self) -> str:
        assert select.select([self._descriptor], [], [], 0.0)[0], "a Ctrl-C just before this is not seen"
        return os.read(self._descriptor, 100).decode()


def test_a_question_waits_where_an_interrupt_just_before_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    keyboard, keys = os.pipe()
    monkeypatch.setattr("sys.stdin", _Keyboard(keyboard))
    presses = threading.Timer(3.0 * LOOK_S, os.write, (keys, b"A-105\n"))
    presses.start()
    assert typed_line("which one? ") == "A-105"
    presses.join()
    for end in (keyboard, keys):
        os.close(end)


def test_consent_names_who_and_how(capsys: pytest.CaptureFixture[str]) -> None:
    consent = ask_to_move(replace(MOVEMENT, subject="stand", subject_id="S1"), "S1")
    assert (consent.subject, consent.subject_id, consent.how) == ("stand", "S1", "--yes-move")
    shown = capsys.readouterr()
    assert shown.out == "", "standard output is for results"
    assert "  stand         here\n  first motion  a ramp\n" in shown.err


@pytest.mark.parametrize(
    ("motion", "text"),
    [
        (RampTo(12.5, 20.0), "ramp (target 12.5 mm, speed 20 mm/s)"),
        (
            Harmonic(50.0, 15.0, 1.25, 5),
            "harmonic (mean 50 mm, amplitude 15 mm, frequency 1.25 Hz, cycles 5)",
        ),
        (
            StaticCycles(5.0, 600.0, 105.0, 3, 2.0),
            "static (speed 5 mm/s, force limit 600 kN, stroke limit 105 mm, cycles 3, pause 2 s)",
        ),
    ],
)
def test_motions_are_announced_with_their_units(motion: RampTo | Harmonic | StaticCycles, text: str) -> None:
    assert motion_text(motion) == text
