"""The question about edited files in a real terminal: take, keep, neither, and Ctrl-C."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.recording.runfile.file import read_metadata
from tests.cli.test_edits import Lab
from tests.terminals import in_terminal

QUESTION = r"Type take to go on with the edits, keep to go on without them: "


@pytest.mark.parametrize(
    ("answer", "steps"),
    [("take", ["one", "two", "three"]), pytest.param("keep", ["one", "two"], marks=pytest.mark.long)],
)
def test_what_is_typed_is_what_it_goes_on_with(tmp_path: Path, answer: str, steps: list[str]) -> None:
    lab = Lab(tmp_path)
    lab.add_step()
    with in_terminal("resume", lab.out, "--simulate", "--speed", "100") as terminal:
        shown = terminal.wait_for(QUESTION)
        assert '+name = "three"' in shown
        assert "new: “three”" in shown
        assert lab.record.status != "complete", "nothing has moved"
        terminal.press(f"{answer}\r")
        assert terminal.end() == 0, terminal.text[-2000:]
    record = lab.record
    assert [step.name for step in record.steps] == steps
    assert all(step.status == "complete" for step in record.steps)
    assert record.steps[0].runs == ("runs/one.h5",), "what was complete was not repeated"
    edits = record.starts[-1].get("edits")
    run = read_metadata(lab.out / record.steps[-1].runs[0])
    if answer == "keep":
        assert edits is None
        assert run["edits"] == []
        assert (lab.out / "inputs/edited.toml").read_text() != lab.campaign.read_text()
        return
    assert edits is not None
    assert edits["how"] == "typed"
    assert edits["by"]
    assert (lab.out / "inputs/edited.toml").read_text() == lab.campaign.read_text()
    (taken,) = run["edits"]
    assert (taken["how"], taken["at_utc"]) == ("typed", record.starts[-1]["at_utc"])
    assert '+name = "three"' in taken["files"][0]["diff"]


@pytest.mark.parametrize(
    ("keys", "said"), [("perhaps\r", "neither take nor keep"), ("\x04", ""), ("\x03", "")]
)
def test_anything_else_moves_nothing(tmp_path: Path, keys: str, said: str) -> None:
    """A word, Ctrl-D and Ctrl-C."""
    lab = Lab(tmp_path)
    lab.add_step()
    before = (lab.out / "campaign.json").read_bytes()
    with in_terminal("resume", lab.out, "--simulate", "--speed", "100") as terminal:
        terminal.wait_for(QUESTION)
        terminal.press(keys)
        assert terminal.end() not in (0, 1), terminal.text[-2000:]
        assert said in terminal.text
        assert "Traceback" not in terminal.text
    assert (lab.out / "campaign.json").read_bytes() == before
    assert not list((lab.out / "runs").glob("0*"))
