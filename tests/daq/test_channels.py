"""Stands with as many channels as they have: run in virtual time, recorded, checked and evaluated."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.guards.missing_guards import unguarded
from bufferstand.daq.scaling import scale
from bufferstand.drivers.check.devices import check_devices
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.interfaces import SampleBlock, StreamFacts
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.plausibility.signal_comparison.draw_wires import check_wires
from bufferstand.evaluation.record.by_quantity import channels_of_quantity
from bufferstand.evaluation.record.record import make_record
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.foundation.channels.strokes import mean_of_strokes, tilt_of_strokes
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.runfile.data_frames import to_frame
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run, Series, mean_stroke
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.many_channels import stand_with

STEPS = """
[zero]
touch = true

[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 5
"""


FORCE_2 = """
[[controller.channel]]
name = "force_2"
quantity = "force"
unit = "kN"
place = "second bridge"
calibration = { id = "F-2", coefficients = [0.0, 9.5367431640625e-05], certificate = "simulated" }
"""


def recorded(folder: Path, *, wires: int, further: bool) -> tuple[Run, Path]:
    """Run a short campaign on a stand with such channels; return its harmonic run and its file."""
    stand_with(folder, wires=wires, further=further)
    campaign, specimen = folder / "campaign.toml", SAMPLES / "specimens" / "category-a-elastomer.toml"
    content = f'[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "{specimen}"\n{STEPS}'
    campaign.write_text(content, encoding="utf-8")
    plan, stand_file = sample_plan(campaign)
    opened, shown = open_in_process(stand_file), Lines()
    out = folder / "out"
    outcome = run_campaign(plan, opened.stand, opened.clock, out, facts_of(stand_file), progress=shown)
    opened.stand.close()
    assert outcome.exit_status == 0, shown.lines
    (path,) = (out / "runs").glob("*harmonic*.h5")
    return open_run(path), path


@pytest.mark.slow
def test_one_wire_is_the_stroke_and_shows_no_tilt(tmp_path: Path) -> None:
    run, path = recorded(tmp_path, wires=1, further=False)
    assert tuple(run.streams["controller"].channels) == ("force", "stroke_1", "position", "command")
    assert run.stroke() is run.series("stroke_1")
    guards = [one["name"] for one in run.metadata["limits"]["guards"]["channels"]]
    assert "stroke" in guards
    assert "tilt" not in guards
    entry = evaluate_paths([path], Options(draws=100))["runs"][0]
    assert entry["draw_wires"] is None
    assert entry["summary"]["amplitude_mm"]["value"] == pytest.approx(5.0, abs=0.1)
    campaign, stand_file = sample_plan(tmp_path / "campaign.toml")
    assert "one draw wire: tilt is not watched" in unguarded(campaign, stand_file)


@pytest.mark.slow
def test_four_wires_pressure_and_acceleration_are_recorded_checked_and_evaluated(tmp_path: Path) -> None:
    run, path = recorded(tmp_path, wires=4, further=True)
    strokes = [run.series(f"stroke_{number}").value for number in range(1, 5)]
    np.testing.assert_allclose(run.stroke().value, np.mean(strokes, axis=0), rtol=0.0, atol=1e-12)
    (tilt,) = [one for one in run.metadata["limits"]["guards"]["channels"] if one["name"] == "tilt"]
    assert tilt["signal"] == "tilt"
    (pressure,) = channels_of_quantity(run, "pressure")
    assert (pressure.name, pressure.unit, pressure.place) == ("pressure_1", "bar", "cylinder")
    force = run.series("force")
    kN = np.interp(pressure.time_s, force.time_s, force.value)  # p = F / A, A = 30 000 mm²
    assert np.max(np.abs(pressure.value - kN / 3.0)) < 2.0
    assert np.corrcoef(pressure.value, kN)[0, 1] > 0.999
    (acceleration,) = channels_of_quantity(run, "acceleration")
    steady = acceleration.value[np.abs(acceleration.time_s - 3.0) < 1.0]
    amplitude = 0.005 * (2.0 * np.pi) ** 2  # m/s² of 5 mm at 1 Hz
    assert np.max(steady) == pytest.approx(amplitude, rel=0.3)
    evaluated = evaluate_paths([path], Options(draws=100))["runs"][0]
    assert evaluated["summary"]["amplitude_mm"]["value"] == pytest.approx(5.0, abs=0.1)
    assert evaluated["summary"]["damping"]["expanded_uncertainty"] > 0.0
    assert evaluated["draw_wires"]["largest_difference_mm"] < evaluated["draw_wires"]["limit_mm"]
    assert "pressure_1_bar" in signals_as_columns(path)
    assert "acceleration_1_m_per_s2" in signals_as_columns(path)

    stand_file = load_stand(tmp_path / "stand.toml")
    opened = open_in_process(stand_file)
    found = check_devices(stand_file, opened.stand.controller, (), opened.clock, watch_s=0.0)
    rows = {row.item: row for row in found}
    assert rows["pressure_1"].value.endswith("bar (cylinder)")
    assert rows["pressure_1"].verdict is Verdict.OK
    assert "value_m_per_s2" in rows["acceleration_1"].figures
    assert {"stroke_1", "stroke_2", "stroke_3", "stroke_4"} <= rows.keys()


def signals_as_columns(path: Path) -> list[str]:
    return list(to_frame(open_run(path)).columns)


@pytest.mark.parametrize(("off_kN", "verdict"), [(0.0, Verdict.OK), (40.0, Verdict.FAULT)])
def test_a_second_force_of_the_controller_is_held_against_the_first(
    tmp_path: Path, off_kN: float, verdict: Verdict
) -> None:
    path = stand_with(tmp_path, wires=2)
    profile = tmp_path / "ring.toml"
    text = profile.read_text(encoding="utf-8")
    assert '"command:i16"' in text
    profile.write_text(text.replace('"command:i16"', '"command:i16", "force_2:i32"'), encoding="utf-8")
    before, _, after = path.read_text(encoding="utf-8").partition("\n[amplifier]")
    wrong = f"\n[simulation.miswired.force]\nzero = {off_kN}\ncontroller_too = false\n"
    further = "\n[temperature]" + after.partition("\n[temperature]")[2]
    path.write_text(before + FORCE_2 + further + wrong, encoding="utf-8")
    stand_file = load_stand(path)
    opened = open_in_process(stand_file)
    found = check_devices(stand_file, opened.stand.controller, (), opened.clock, watch_s=0.0)
    (row,) = [row for row in found if row.item == "force − force_2"]
    assert (row.device, row.verdict) == ("controller", verdict)
    assert abs(float(row.value.removesuffix(" kN")) - off_kN) < 1.0
    assert ("disagree" in row.remark) == (verdict is Verdict.FAULT)


WAYS = st.lists(st.floats(-50.0, 300.0), min_size=3, max_size=3)


@given(wires=st.lists(WAYS, min_size=1, max_size=4))
def test_the_stroke_is_the_mean_whatever_the_number_of_wires(wires: list[list[float]]) -> None:
    channels = tuple(
        Channel(name=f"stroke_{n}", quantity="stroke", unit="mm") for n in range(1, len(wires) + 1)
    )
    counts = {channel.name: np.array(own) for channel, own in zip(channels, wires, strict=True)}
    facts = StreamFacts("controller", "device", channels, 1000.0, "test")
    block = SampleBlock("controller", 0, np.arange(3, dtype=np.int64) * 1000, counts, 0, 0.0)
    values = scale(block, facts).values
    np.testing.assert_allclose(values["stroke"], np.mean(wires, axis=0), rtol=1e-12, atol=1e-12)
    if len(wires) == 1:
        assert "tilt" not in values
    elif len(wires) == 2:
        np.testing.assert_array_equal(values["tilt"], np.subtract(*wires))
        np.testing.assert_array_equal(values["stroke"], 0.5 * np.add(*wires))
    else:
        apart = [abs(np.subtract(one, two)) for one, two in combinations(wires, 2)]
        np.testing.assert_array_equal(values["tilt"], np.max(apart, axis=0))
    series = [Series(np.arange(3.0), np.array(own), "mm") for own in wires]
    np.testing.assert_array_equal(mean_stroke(series).value, values["stroke"])


def test_one_of_four_wires_that_stands_still_is_left_out() -> None:
    time_s = np.arange(4000) / 1000.0
    stroke = 20.0 - 10.0 * np.cos(2.0 * np.pi * time_s)
    wires = {f"stroke_{n}": (time_s, stroke + 0.01 * n) for n in range(1, 5)}
    wires["stroke_3"] = (time_s, np.full(time_s.size, 10.0))
    record = make_record(
        time_s,
        mean_of_strokes([value for _, value in wires.values()]),
        10.0 * stroke,
        wire_difference_mm=tilt_of_strokes([value for _, value in wires.values()]),
    )
    stated = tuple(ChannelUncertainty(linearity=0.1 * n) for n in range(1, 5))
    facts = RunFacts(id="x", kind="harmonic", stroke_uncertainty=stated)
    found, left, seen = check_wires(replace(record, as_recorded=wires), facts)
    assert seen is not None
    assert [one.wire for one in seen.out] == ["stroke_3"]
    (text,) = seen.warnings
    assert text.startswith(
        "draw wire stroke_3 stands still from 0.06 s on while others move: broken or stuck"
    )
    assert text.endswith("the stroke is the mean of stroke_1, stroke_2, stroke_4")
    np.testing.assert_allclose(found.stroke_mm, stroke + 0.07 / 3.0, atol=1e-9)
    assert [one.linearity for one in left.stroke_uncertainty] == [0.1, 0.2, 0.4]


def test_a_quantity_that_nothing_measures_is_refused() -> None:
    run = open_run(SAMPLES / "runs" / "001-static-5mm_s.h5")
    assert channels_of_quantity(run, "pressure") == ()
    assert [one.name for one in channels_of_quantity(run, "force")] == ["force", "force_2"]
    with pytest.raises(BadInput, match="no channel measures “pressur”"):
        channels_of_quantity(run, "pressur")


def test_a_channel_that_the_stand_has_not_cannot_fail_nor_be_miswired(tmp_path: Path) -> None:
    stand_file = load_stand(stand_with(tmp_path, wires=1))
    with pytest.raises(BadInput, match="the stand has no stroke_2"):
        open_in_process(stand_file, faults=[ScheduledFault("stroke_2", "stuck", 1.0)])
    wrong = {**(stand_file.simulation or {}), "miswired": {"stroke_2": {"zero": 5.0}}}
    with pytest.raises(BadInput, match="the stand has no channel “stroke_2”"):
        open_in_process(stand_file.model_copy(update={"simulation": wrong}))
