"""Warming a specimen up on the simulated stand, in virtual time."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign_folder.as_run import AsRun, read_as_run
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.warm_up.sensor_trend import SensorLag, SensorTrends
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.curve_predictor import CurvePredictor
from bufferstand.protocols.prediction.predictor import Predictor
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of
from tests.daq.test_start_band import PACE, PREDICTOR, run, sine

WARM_UP = """
[[step]]
kind = "warm-up"
temperature_C = {to}
band_K = {band}
prestress_mm = 60.0
amplitude_mm = 20.0
frequency_Hz = 1.2
record = true
{more}
"""


def warm_up(to: float, more: str = "", band: float = 2.0) -> str:
    return WARM_UP.format(to=to, more=more, band=band)


def test_it_cycles_until_the_sensors_are_warm_and_what_follows_begins_so(tmp_path: Path) -> None:
    after = sine(more="start_temperature_C = [22.5, 27.5]")
    ended = run(tmp_path, warm_up(25.0, "soak_s = 10.0") + after)
    assert ended.outcome.status == "complete", ended.outcome.reason
    found = open_run(ended.outcome.runs[0])
    (said,) = [event for event in found.events if event.kind == "temperature"]
    assert said.text.startswith("warmed up: ")
    for name in ("temperature_1", "temperature_2"):
        assert 23.0 <= found.series(name).value[-1] <= 27.0
        assert found.series(name).value[0] < 22.0
    row, _ = ended.rows
    assert row.planned is not None
    assert row.cycles > 5
    assert row.duration_s == pytest.approx(row.planned.duration_s, rel=0.4)
    record = load_record(tmp_path / "out")
    assert record is not None
    assert record.steps[0].cycles_done == row.cycles, "as many as were needed, not the most"
    assert abs(found.series("force").value[-1]) < 2.0, "it ends at zero force"


def test_warm_already_moves_nothing(tmp_path: Path) -> None:
    ended = run(tmp_path, warm_up(25.0), initial_C=25.0)
    assert ended.outcome.status == "complete", ended.outcome.reason
    assert ended.rows[0].cycles == 0
    assert ended.rows[0].duration_s < 20.0, "only its slope is looked at"


def test_a_specimen_above_the_band_rests_into_it(tmp_path: Path) -> None:
    ended = run(tmp_path, warm_up(25.0, band=1.0), initial_C=26.6)
    assert ended.outcome.status == "complete", ended.outcome.reason
    assert ended.rows[0].cycles == 0
    assert ended.rows[0].end_C == pytest.approx(26.0, abs=0.15)


@dataclass
class Trial:
    """A warm-up, and the spring by the stand's own truth [°C]."""

    outcome: CampaignOutcome
    plan: Plan
    row: AsRun
    spring_C: NDArray[np.float64]
    lines: list[str]


def trial(
    folder: Path,
    to_C: float,
    band_K: float,
    *,
    modelled: bool,
    lag_s: float,
    capacity_share: float = 1.0,
    more: str = "",
) -> Trial:
    """Warm a specimen up whose sensors lag by ``lag_s``, where its model, if it has one, says 20 s."""
    text = (SAMPLES / "models" / "category-a-elastomer.toml").read_text("utf-8")
    assert "sensor_lag_s = 20.0" in text
    assert CAPACITY in text
    true = text.replace("sensor_lag_s = 20.0", f"sensor_lag_s = {lag_s}")
    true = true.replace(
        CAPACITY, f"capacity_J_per_K = {capacity_share * float(CAPACITY.rsplit(maxsplit=1)[-1])}"
    )
    (folder / "true.toml").write_text(true)
    stand = (SAMPLES / "stand.toml").read_text("utf-8")
    (folder / "stand.toml").write_text(stand.replace("models/category-a-elastomer.toml", "true.toml"))
    known = CATALOGUE
    if modelled:
        known = f'model = "{SAMPLES / "models" / "category-a-elastomer.toml"}"\n'
    (folder / "specimen.toml").write_text(f'[specimen]\nid = "X"\nmax_stroke_mm = 105.0\n{known}')
    path = folder / "campaign.toml"
    head = '[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "specimen.toml"\n'
    path.write_text(head + warm_up(to_C, more, band_K).replace("record = true", "record = false"))
    campaign, specimen = load_campaign(path), load_specimen(folder / "specimen.toml")
    stand_file = load_stand(folder / "stand.toml")
    if specimen.catalogue is not None:
        predictor: Predictor = CurvePredictor.of_catalogue(specimen.catalogue)
    else:
        predictor = PREDICTOR
    limits = StandLimits(**stand_file.limits.model_dump())
    plan = make_plan(campaign, limits, predictor, specimen.specimen)
    opened, shown = open_in_process(stand_file), Lines()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file), progress=shown,
        settings=PACE, predictor=predictor,
    )  # fmt: skip
    opened.stand.close()
    (row,) = read_as_run(folder / "out")
    return Trial(outcome, plan, row, opened.truth.arrays()["temperature_C"], shown.lines)


CAPACITY = "capacity_J_per_K = 15000.0"
CATALOGUE = """
[catalogue]
points = [[0.0, 15.0], [25.0, 67.0], [60.0, 195.0], [80.0, 365.0], [96.0, 600.0]]
"""


@pytest.mark.parametrize(
    ("to_C", "band_K", "modelled", "lag_s"),
    [
        pytest.param(30.5, 0.5, True, 60.0, marks=pytest.mark.long),
        pytest.param(30.5, 0.5, True, 20.0, marks=pytest.mark.long),
        pytest.param(30.5, 0.5, False, 20.0, marks=pytest.mark.long),
        (25.0, 1.0, False, 60.0),
        (24.0, 0.25, True, 20.0),
    ],
)
def test_a_narrow_band_is_met_without_overshooting(
    tmp_path: Path, to_C: float, band_K: float, modelled: bool, lag_s: float
) -> None:
    """0.2 K a second: a sensor that lags by 20 s shows 4 K too little, whether that is known or not."""
    found = trial(tmp_path, to_C, band_K, modelled=modelled, lag_s=lag_s)
    assert found.outcome.status == "complete", found.outcome.reason
    warmed = found.row.warmed
    assert warmed is not None
    # Readings are within the band; the sensors' own errors and what they lag come on top of the spring's.
    assert abs(found.spring_C[-1] - to_C) <= band_K + 0.1, "the spring itself, when it ends"
    assert found.spring_C.max() <= to_C + band_K + 0.3, "and it was hardly warmer before"
    assert warmed.above_K <= 0.1
    assert warmed.spring_C == pytest.approx(found.spring_C[-1], abs=0.3)
    assert any(warmed.sentence() in line for line in found.lines)
    if modelled:
        assert found.row.cycles == pytest.approx(found.plan.steps[0].expected_cycles, rel=0.35)
        last = (tmp_path / "out" / "strokes.jsonl").read_text(encoding="utf-8").splitlines()[-1]
        _, upper = json.loads(last)["learned"]["force_factors"]
        assert upper == pytest.approx(1.0, abs=0.02), "a warm spring is not taken for a softer one"
    else:
        assert any("is not known; at most 500" in note for note in found.plan.notes)


def test_a_rest_tells_lag_and_cooling() -> None:
    """T falls by 0.03 K/s from 75 °C, θ follows from 71 °C with 25 s; read once a second to 1/16 K."""
    random = np.random.default_rng(5)
    time_s = np.arange(0.0, 90.0)
    spring = 75.0 - 0.03 * time_s
    true_C = spring + 0.03 * 25.0 + (71.0 - 75.0 - 0.03 * 25.0) * np.exp(-time_s / 25.0)
    readings = np.round((true_C + 0.03 * random.standard_normal(90)) * 16.0) / 16.0
    last: dict[str, float] = {}
    drift = SensorTrends(lambda: last, frozenset({"t"}))
    believed = SensorLag(60.0, 60.0)
    for at_s, value_C in zip(time_s, readings, strict=True):
        last["t"] = float(value_C)
        stamp = np.array([round(at_s * 1e6)])
        drift.take(ScaledBlock("t", 0, stamp, {"t": np.array([value_C])}, 0, at_s))
        if at_s == 0.0:
            drift.begin_rest()
    found = drift.learn(believed)
    assert found.lag_s == pytest.approx(25.0, rel=0.2)
    assert found.doubt_s < 10.0
    assert found.cooling_K_per_s == pytest.approx(0.03, abs=0.012)
    (line,) = drift.drifts() or ()
    assert line.spring_C(25.0) == pytest.approx(spring[-1], abs=0.3)


def test_readings_that_only_rise_are_the_lag_and_no_cooling() -> None:
    last: dict[str, float] = {}
    drift = SensorTrends(lambda: last, frozenset({"t"}))
    for at_s in np.arange(0.0, 40.0):
        last["t"] = 30.0 - 2.0 * float(np.exp(-at_s / 60.0))
        drift.take(ScaledBlock("t", 0, np.array([round(at_s * 1e6)]), {"t": np.array([0.0])}, 0, at_s))
        if at_s == 0.0:
            drift.begin_rest()
    found = drift.learn(SensorLag(20.0, 20.0))
    assert found.cooling_K_per_s == 0.0
    assert found.most_s > 20.0


@pytest.mark.parametrize(
    ("to_C", "band_K", "more", "said"),
    [(22.5, 0.5, "max_cycles = 3", "3 cycles (max_cycles)"), (35.0, 1.0, "timeout_s = 80.0", "80 s")],
)
def test_what_does_not_become_warm_stops_the_campaign(
    tmp_path: Path, to_C: float, band_K: float, more: str, said: str
) -> None:
    """By the model it is near enough not to be refused before."""
    ended = run(tmp_path, warm_up(to_C, more, band=band_K))
    assert (ended.outcome.status, ended.outcome.exit_status) == ("stopped", 3)
    assert said in ended.outcome.reason
    assert f"wanted {to_C - band_K:g} … {to_C + band_K:g} °C" in ended.outcome.reason
    assert ended.outcome.safe_stop is not None
    assert ended.outcome.safe_stop.safe
    assert not ended.opened.device.controller.valve_on


def test_the_stop_ends_it_whatever_the_campaign_does_at_one(tmp_path: Path) -> None:
    """The specimen heats four times as fast as its model says."""
    more = (
        "temperature_stop_C = 31.2\ntemperature_resume_C = 28.0\n"
        '[limits]\non_temperature_stop = "wait-and-continue"\n'
    )
    found = trial(tmp_path, 30.5, 0.5, modelled=True, lag_s=60.0, more=more, capacity_share=0.25)
    assert (found.outcome.status, found.outcome.exit_status) == ("stopped", 3), found.lines
    assert "has reached the stop threshold of 31.2 °C" in found.outcome.reason
    assert not any("going on" in line for line in found.lines), "it is no controller"
    assert found.row.warmed is None
