"""What a newcomer does wrong first: each is one message that names the place and says what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.amplifiers.ascii_line.amplifier import _heard
from bufferstand.drivers.stand_file import has_controller, load_any_stand, load_recording_stand, load_stand
from bufferstand.foundation import BadInput
from tests.house.house_page import ROOT
from tests.record_only.bench import labjack, stand_text

WAGO = """
[[acquisition]]
kind = "modbus-io"
description = "wago-750-10v"
answers = { first_word = 0 }
host = "192.0.2.9"
rate_Hz = 50.0

[[acquisition.input]]
point = "AI1"

[acquisition.input.channel]
name = "force_3"
quantity = "force"
unit = "kN"
calibration = { id = "x", coefficients = [0.0, 63.0] }
"""
THERMOMETERS = """
[temperature]
kind = "w1"
root = "w1"

[[temperature.sensor]]
rom = "28-00000a3f91c2"
name = "temperature_1"
place = "spring plate 3"
role = "specimen"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_polled_inputs_beside_a_controller_are_refused_with_the_reason_and_a_way(tmp_path: Path) -> None:
    sample = (ROOT / "sample_runs" / "stand.toml").read_text(encoding="utf-8")
    with pytest.raises(BadInput) as caught:
        load_stand(written(tmp_path, sample + WAGO))
    said = str(caught.value)
    assert "acquisition.kind" in said
    assert "is polled" in said
    assert "record-only mode" in said
    assert "[[sensor]]" in said


def test_a_range_that_was_not_written_is_said_to_be_the_default(tmp_path: Path) -> None:
    text = stand_text(labjack()).replace('model = "T7"', 'model = "T8"')
    with pytest.raises(BadInput) as caught:
        load_recording_stand(written(tmp_path, text))
    assert "which is taken where none is stated" in str(caught.value)
    assert "write one of 11" in str(caught.value)


def test_what_is_no_text_is_never_shown() -> None:
    assert _heard("\x1b[2J,\x00\ufffd" * 100).startswith("it sends 700 bytes that are no text")
    assert _heard("ERROR") == "it answers “ERROR”"
    assert len(_heard("A" * 5000)) < 100


def test_one_device_of_thermometers_is_a_table_in_the_run_as_with_a_controller(tmp_path: Path) -> None:
    """The run file wants a table: a list of one was refused when the recording began."""
    stand = load_recording_stand(written(tmp_path, stand_text(labjack()) + THERMOMETERS))
    content = stand.model_dump(mode="json")
    assert content["temperature"]["kind"] == "w1"
    assert "simulation" not in content
    assert "amplifier" not in content


def test_any_stand_file_is_read_by_what_it_has(tmp_path: Path) -> None:
    recorded = written(tmp_path, stand_text(labjack()))
    assert not has_controller(recorded)
    assert load_any_stand(recorded).stand.id == "vendor"
    assert load_any_stand(ROOT / "sample_runs" / "stand.toml").stand.id != "vendor"
