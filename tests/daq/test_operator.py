"""The operator: keys, signals and the campaign's socket stop it or add notes; what was noted is kept."""

from __future__ import annotations

import os
import pty
import signal
import threading
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.campaign.note import command as note_command
from bufferstand.cli.commands.campaign.stop import command as stop_command
from bufferstand.daq.operator.control_socket import SOCKET_NAME, ask, listening
from bufferstand.daq.operator.keys import Keys, keys_from
from bufferstand.daq.operator.notes import add_note, clean_note, read_notes
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest, stop_on_signals
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import HARMONIC, STATIC
from tests.daq.test_runner import Case, assert_safe


class At:
    """Does something once, when a motion is under way."""

    def __init__(self, act: Any) -> None:
        self._act = act
        self.lines: list[str] = []

    def update(self, progress: Any) -> None:
        if progress.phase == "motion" and progress.cycle >= 1 and self._act is not None:
            act, self._act = self._act, None
            act()

    def message(self, text: str) -> None:
        self.lines.append(text)


def operator_case(folder: Path, act: Any, steps: str = HARMONIC + STATIC) -> tuple[Case, Any]:
    case = Case(folder, steps)
    case.shown = At(lambda: act(case))  # type: ignore[assignment]
    return case, case.run()


@pytest.mark.parametrize(("after", "cycles"), [(None, 1), ("cycle", 2), ("step", 3)])
def test_the_command_stop_ends_a_running_campaign(tmp_path: Path, after: str | None, cycles: int) -> None:
    def stop(case: Case) -> None:
        result = CliRunner().invoke(stop_command, [str(case.out), *(["--after", after] if after else [])])
        assert result.exit_code == 0, result.output
        assert result.output.startswith("stopping ")

    case, outcome = operator_case(tmp_path, stop)
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert outcome.reason == f"stopped by the operator: bufferstand stop ({after or 'now'})"
    assert_safe(case.controller, outcome)
    record = case.record()
    assert record["steps"][0]["cycles_done"] == cycles
    assert record["steps"][0]["status"] == ("complete" if after == "step" else "stopped")
    assert not (case.out / SOCKET_NAME).exists(), "the socket goes with the campaign"


def test_notes_before_during_and_after_are_kept_and_the_one_during_is_in_the_run(tmp_path: Path) -> None:
    out = tmp_path / "out"
    invoke = CliRunner().invoke
    assert invoke(note_command, [str(out), "greased the guide"]).output == "noted\n"

    def write(case: Case) -> None:
        assert invoke(note_command, [str(case.out), "a squeak\nfrom the left"]).output == "noted\n"

    _, outcome = operator_case(tmp_path, write)
    assert outcome.status == "complete"
    assert invoke(note_command, [str(out), "cracks in plate 3"]).exit_code == 0
    notes = read_notes(out)
    assert [(note.text, note.step, note.run) for note in notes] == [
        ("greased the guide", 0, ""),
        ("a squeak from the left", 1, "001-harmonic-10mm-5mm-1Hz"),
        ("cracks in plate 3", 0, ""),
    ]
    said = [event.text for event in open_run(outcome.runs[0]).events if event.kind == "operator"]
    assert said == ["a squeak from the left"]
    assert not [event for event in open_run(outcome.runs[1]).events if event.kind == "operator"]


def test_a_note_that_is_none_is_refused_and_a_torn_line_is_left_out(tmp_path: Path) -> None:
    for text in (" \n", "x" * 2001):
        with pytest.raises(BadInput):
            clean_note(text)
    add_note(tmp_path, "whole")
    with (tmp_path / "notes.jsonl").open("a") as stream:
        stream.write('{"utc": "2026')
    assert [note.text for note in read_notes(tmp_path)] == ["whole"]


def test_the_socket_is_private_and_a_second_campaign_in_the_folder_is_refused(tmp_path: Path) -> None:
    deep = tmp_path / ("d" * 120)  # longer than the address of a socket can be
    deep.mkdir()
    request = StopRequest()
    with listening(deep, request):
        assert (deep / SOCKET_NAME).stat().st_mode & 0o077 == 0
        with pytest.raises(BadInput, match="running in this folder already"), listening(deep, request):
            pass
        with pytest.raises(BadInput, match="this is no request"):
            ask(deep, {"dance": "now"})
        assert ask(deep, {"stop": "step"}) == "stopping after the step"
    assert request.level is StopLevel.AFTER_STEP
    assert ask(deep, {"stop": "now"}) is None, "nobody is there any more"
    (deep / SOCKET_NAME).touch()  # what a kill -9 leaves does not keep the next one out
    with listening(deep, StopRequest()):
        assert ask(deep, {"note": "here"}) == "noted"


def test_stop_says_where_no_campaign_runs(tmp_path: Path) -> None:
    result = CliRunner().invoke(stop_command, [str(tmp_path)])
    assert isinstance(result.exception, BadInput)


@pytest.mark.parametrize(
    ("number", "level"),
    [(signal.SIGUSR1, StopLevel.AFTER_CYCLE), (signal.SIGUSR2, StopLevel.AFTER_STEP)],
)
def test_signals_ask_for_a_later_stop_too(number: signal.Signals, level: StopLevel) -> None:
    before = signal.getsignal(number)
    with stop_on_signals(StopRequest()) as request:
        signal.raise_signal(number)
        assert request.level is level
        assert number.name in request.reason
    assert signal.getsignal(number) == before


def test_keys_stop_and_write_notes() -> None:
    request, said = StopRequest(), []
    keys = Keys(request, said.append)
    for key in "nit scks\x7f\x7feams\r":
        keys.press(key)
    assert request.take_notes() == ["it sceams"]
    assert request.level is StopLevel.NONE, "s and c in a note stop nothing"
    for key in "nforget\x1b":
        keys.press(key)
    assert request.take_notes() == []
    keys.press("s")
    assert request.level is StopLevel.AFTER_STEP
    keys.press("c")
    assert request.level is StopLevel.AFTER_CYCLE
    keys.press("?")
    assert said[-1].startswith("keys: Ctrl-C")


def test_a_terminal_in_the_background_or_a_pipe_is_left_alone() -> None:
    master, slave = pty.openpty()
    reading, writing = os.pipe()
    try:
        for descriptor in (slave, reading):
            with os.fdopen(os.dup(descriptor)) as stream:
                before = threading.active_count()
                with keys_from(stream, StopRequest(), lambda _: None):
                    assert threading.active_count() == before
    finally:
        for descriptor in (master, slave, reading, writing):
            os.close(descriptor)
