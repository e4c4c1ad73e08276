"""Extremes of a run are of all its samples, wherever they are and however the record was averaged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.archive.comparison import compare_evaluations
from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation
from bufferstand.evaluation.archive.run_queries import FIELDS, result_facts
from bufferstand.evaluation.archive.settings_and_software import EvaluationSettings, software
from bufferstand.evaluation.archive.stored_run import keep
from bufferstand.evaluation.archive.tables import runs_frame
from bufferstand.evaluation.document.build import evaluation_document, run_entry
from bufferstand.evaluation.facts.results import EXTREME_NAMES, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loading.long_runs import MemoryBounds
from bufferstand.evaluation.record.peaks import NEAR, peaks_of, stands_alone
from bufferstand.evaluation.record.record import Peak, Record, Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.run.extremes.errors import ExtremeReadings, channel_errors, rivals_of, stated
from bufferstand.evaluation.run.extremes.of_run import sample_extremes
from bufferstand.evaluation.uncertainty.error_model import draw_errors
from bufferstand.foundation.channels.channel import ChannelUncertainty
from bufferstand.recording.finding.query import parse_query
from tests.evaluation.signals import STATED, Ellipse, Floats, StaticTest
from tests.evaluation.test_load import csv_of

HARMONIC = RunFacts("h", "harmonic", **STATED)  # type: ignore[arg-type]
NO_DRAWS = Options(draws=0)


def value(run: RunEvaluation, name: str) -> float:
    found = run.extremes[name].value
    assert found is not None, name
    return found


def swelling(cycles: int = 12, rate_Hz: float = 400.0) -> tuple[Floats, Floats, Floats]:
    """Return a harmonic run whose sixth cycle is a tenth larger."""
    time = np.arange(round(cycles * rate_Hz) + 1) / rate_Hz
    amplitude = 20.0 * np.where((time >= 5.25) & (time < 6.25), 1.1, 1.0)
    stroke = 50.0 - amplitude * np.cos(2.0 * np.pi * (time - 0.25))
    return time, stroke, 100.0 + 4.0 * (stroke - 50.0)


def test_greatest_force_is_that_of_all_samples_and_the_summary_a_mean() -> None:
    time, stroke, force = swelling()
    run = evaluate_run(make_record(time, stroke, force), HARMONIC, NO_DRAWS)
    assert value(run, "force_max_kN") == force.max() == pytest.approx(188.0)
    assert value(run, "stroke_max_mm") == stroke.max()
    assert run.extremes["force_max_kN"].time_s == time[np.argmax(force)]
    mean = run.summary.values["force_max_kN"].value
    assert mean is not None
    assert mean < 182.0
    assert value(run, "force_min_kN") == force.min()
    assert value(run, "stroke_min_mm") == stroke.min()


@pytest.mark.parametrize("rate_Hz", [100.0, 1000.0, 20_000.0])
def test_averaging_takes_nothing_of_an_extreme(rate_Hz: float) -> None:
    """A peak of three samples: of a record that is averaged a hundredfold, nothing of it would be left."""
    time, stroke, force = Ellipse().columns(1.0, rate_Hz, 8.3, noise=1e-4)
    at = int(np.argmax(force[: force.size // 2]))
    force[at - 1 : at + 2] += (1.0, 3.0, 1.0)
    run = evaluate_run(make_record(time, stroke, force.copy()), HARMONIC, NO_DRAWS)
    if rate_Hz > 1000.0:
        assert run.record.averaged > 10
    assert value(run, "force_max_kN") == force[at]
    assert run.extremes["force_max_kN"].time_s == time[at]


def test_what_lies_outside_of_cycles_counts_and_has_no_cycle() -> None:
    time, stroke, force = Ellipse().columns(1.0, 500.0, 6.0, phase=-0.5 * np.pi)
    ramp_s = np.arange(1500) / 500.0
    up = np.interp(ramp_s, (0.0, 0.2, 1.0, 2.0, 3.0), (0.0, 80.0, 80.0, stroke[0], stroke[0]))
    columns = (
        np.concatenate((ramp_s, time + 3.0)),
        np.concatenate((up, stroke)),
        np.concatenate((4.0 * up, force)),
    )
    run = evaluate_run(make_record(*columns), HARMONIC, NO_DRAWS)
    greatest = run.extremes["force_max_kN"]
    assert greatest.value == pytest.approx(320.0)
    assert greatest.time_s == pytest.approx(0.2, abs=0.01)
    assert value(run, "stroke_max_mm") == 80.0
    # the ramp runs at 400 mm/s, the sine at 2 π · 20 = 126
    assert value(run, "speed_max_mm_per_s") == pytest.approx(400.0, rel=1e-3)
    assert value(run, "speed_loading_max_mm_per_s") == pytest.approx(400.0, rel=1e-3)
    assert value(run, "speed_unloading_max_mm_per_s") == pytest.approx(2.0 * np.pi * 20.0, rel=0.01)
    inside = run.extremes["speed_unloading_max_mm_per_s"]
    assert inside.cycle is not None
    cycle = next(c.cycle for c in run.cycles if c.cycle.index == inside.cycle)
    assert cycle.start_s <= (inside.time_s or 0.0) <= cycle.end_s


def test_speed_of_a_sine_is_where_it_is_steepest() -> None:
    run = evaluate_run(make_record(*Ellipse().columns(0.5, 300.0, 6.5, phase=0.0)), HARMONIC, NO_DRAWS)
    loading = run.extremes["speed_loading_max_mm_per_s"]
    assert loading.value == pytest.approx(np.pi * 20.0, rel=2e-3)
    assert ((loading.time_s or 0.0) / 2.0) % 1.0 == pytest.approx(0.0, abs=0.03) or (
        (loading.time_s or 0.0) / 2.0
    ) % 1.0 == pytest.approx(1.0, abs=0.03)


def test_a_measured_speed_is_taken_as_it_is() -> None:
    time, stroke, force = Ellipse().columns(1.0, 300.0, 6.5)
    speed = np.gradient(stroke, time)
    speed[700] = -500.0
    facts = replace(HARMONIC, speed_uncertainty=ChannelUncertainty(accuracy_percent=1.0, zero=0.1))
    run = evaluate_run(make_record(time, stroke, force, speed_mm_per_s=speed), facts, Options(draws=200))
    assert value(run, "speed_max_mm_per_s") == 500.0
    assert run.extremes["speed_max_mm_per_s"].channel == "speed"
    assert run.extremes["speed_max_mm_per_s"].expanded_uncertainty == pytest.approx(10.0 / 3**0.5, rel=0.2)
    assert "lone sample" in run.extremes["speed_max_mm_per_s"].doubt
    assert value(run, "speed_loading_max_mm_per_s") == speed.max()


def test_warmest_and_coldest_of_all_sensors_on_the_specimen() -> None:
    time, stroke, force = Ellipse().columns(1.0, 300.0, 6.5)
    at = np.arange(0.0, 60.0)
    warm = 22.0 + 0.3 * at
    warm[-1] = np.nan
    sensors = [
        Temperature("temperature_1", at, np.full(at.size, 22.5), accuracy_C=0.5),
        Temperature("temperature_2", at, warm, accuracy_C=0.5),
        Temperature("air", at, np.full(at.size, 60.0), role="ambient"),
    ]
    run = evaluate_run(make_record(time, stroke, force, temperatures=sensors), HARMONIC, Options(draws=400))
    warmest, coldest = run.extremes["temperature_max_C"], run.extremes["temperature_min_C"]
    assert (warmest.value, warmest.time_s, warmest.channel) == (pytest.approx(39.4), 58.0, "temperature_2")
    assert warmest.cycle is None, "it was reached after the last cycle"
    assert (coldest.value, coldest.channel) == (22.0, "temperature_2")
    assert warmest.expanded_uncertainty == pytest.approx(2.0 * 0.5 / 3**0.5, rel=0.05)
    assert warmest.half_width_95 == pytest.approx(0.475, rel=0.03)


def test_inertia_is_corrected_at_every_sample() -> None:
    """F = F_cell - m a: with a heavy mass the greatest force on the specimen is not where the cell's is."""
    time, stroke, cell = Ellipse(storage=0.05, loss=0.3).columns(2.0, 500.0, 6.5, phase=0.3)
    acceleration = -((4.0 * np.pi) ** 2) * (stroke - 50.0)
    truth = cell - 900.0e-6 * acceleration
    run = evaluate_run(make_record(time, stroke, cell), HARMONIC, Options(draws=0, moving_mass_kg=900.0))
    assert abs(truth[np.argmax(cell)] - truth.max()) > 0.1
    assert value(run, "force_max_kN") == pytest.approx(truth.max(), abs=0.02)


def test_a_wire_that_is_out_has_no_extremes() -> None:
    time, stroke, force = Ellipse().columns(1.0, 300.0, 8.5)
    stuck = np.where(time < 3.0, stroke, 25.0)
    mean, difference = 0.5 * (stroke + stuck), stroke - stuck
    record = make_record(time, mean, force, wire_difference_mm=difference)
    run = evaluate_run(record, HARMONIC, NO_DRAWS)
    assert run.extremes["stroke_max_mm"].channel == "stroke_1"
    assert value(run, "stroke_min_mm") == pytest.approx(stroke.min())


@pytest.mark.parametrize("points", [10**9, 300])
def test_pieces_have_the_extremes_of_the_whole(tmp_path: Path, points: int) -> None:
    time, stroke, force = Ellipse().columns(1.0, 1000.0, 5.3, noise=1e-3)
    force[1234] += 300.0
    force[2000] = np.nan
    warm = 20.0 + np.sin(time)
    path = csv_of(
        tmp_path / "r.csv",
        **{"time__s": time, "force__kN": force, "stroke__mm": stroke, "temperature_1__°C": warm},
    )
    whole = evaluate_run(*load_run(path), NO_DRAWS)
    bounds = MemoryBounds(whole_rows=100, piece_rows=257, points=points, readings=50)
    short = evaluate_run(*load_run(path, bounds), NO_DRAWS)
    for name in EXTREME_NAMES:
        if not name.startswith("speed") or points > 10**6:
            assert short.extremes[name].value == pytest.approx(whole.extremes[name].value, rel=1e-12), name
            assert short.extremes[name].time_s == pytest.approx(whole.extremes[name].time_s), name
            assert bool(short.extremes[name].doubt) == bool(whole.extremes[name].doubt), name
    assert "lone sample" in short.extremes["force_max_kN"].doubt


def test_a_lone_sample_counts_and_is_doubted() -> None:
    time, stroke, force = Ellipse().columns(1.0, 300.0, 8.5, noise=2e-4)
    at = int(np.argmax(force))
    force[at] += 10.0
    run = evaluate_run(make_record(time, stroke, force.copy()), HARMONIC, Options(draws=200))
    greatest = run.extremes["force_max_kN"]
    assert greatest.value == force[at]
    assert "from its neighbours" in greatest.doubt
    assert any("force_max_kN" in text and "lone sample" in text for text in run.warnings)
    assert not run.extremes["stroke_max_mm"].doubt
    assert run_entry(run)["extremes"]["force_max_kN"]["doubt"] == greatest.doubt


def test_steps_of_a_coarse_converter_are_no_lone_sample() -> None:
    near = np.zeros(33)
    near[[2, 22, 30]], near[16] = 1.83, -3.66
    assert stands_alone(Peak(-3.66, 0.0, near, 16), "force", 590.0) is None
    near[16] = -9.15
    assert stands_alone(Peak(-9.15, 0.0, near, 16), "force", 590.0) == 9.15


def test_what_is_far_in_time_is_no_neighbour() -> None:
    """A log by event has one sample of a rest of seconds, and then the motion."""
    time = np.concatenate(([0.0], 1.1 + 0.0003 * np.arange(200)))
    ends = peaks_of(time, np.concatenate(([-0.1], 9.0 + 1.4 * np.arange(200))))
    assert ends is not None
    assert stands_alone(ends[0], "force", 280.0) is None
    even = peaks_of(0.0003 * np.arange(201), np.concatenate(([-0.1], 9.0 + 1.4 * np.arange(200))))
    assert even is not None
    assert stands_alone(even[0], "force", 280.0)


def test_a_force_that_peaks_where_few_samples_turn_is_not_doubted() -> None:
    time, stroke, _ = Ellipse().columns(1.0, 13.0, 8.5)
    force = np.where(stroke >= np.max(stroke), 900.0, stroke)
    run = evaluate_run(make_record(time, stroke, force), HARMONIC, Options(draws=200))
    assert value(run, "force_max_kN") == 900.0
    assert not run.extremes["force_max_kN"].doubt


@settings(max_examples=200, deadline=None)
@given(
    samples=st.integers(16, 400),
    noise=st.sampled_from([0.0, 1e-4, 1e-3, 1e-2]),
    step=st.sampled_from([0.0, 0.02, 0.5]),
    form=st.sampled_from(["sine", "triangle", "trapezoid", "pulse"]),
    seed=st.integers(0, 10_000),
)
def test_nothing_of_an_ordinary_signal_is_doubted(
    samples: int, noise: float, step: float, form: str, seed: int
) -> None:
    """Sharp, smooth, flat and rare peaks; white noise; steps of a converter."""
    random = np.random.default_rng(seed)
    phase = (np.arange(4 * samples) + random.uniform()) / samples % 1.0
    tip = 1.0 - np.abs(2.0 * phase - 1.0)
    shapes = {
        "sine": 0.5 - 0.5 * np.cos(2.0 * np.pi * phase),
        "triangle": tip,
        "trapezoid": np.clip(2.0 * tip, 0.0, 1.0),
        "pulse": np.exp(-(((phase - 0.5) * samples / 2.0) ** 2)),
    }
    force = 500.0 * (shapes[form] + noise * random.standard_normal(phase.size))
    if step:
        force = step * np.round(force / step)
    ends = peaks_of(np.arange(force.size, dtype=float), force)
    assert ends is not None
    assert [stands_alone(peak, "force", float(np.ptp(force))) for peak in ends] == [None, None]


@settings(max_examples=100, deadline=None)
@given(
    values=st.lists(st.floats(-1e3, 1e3) | st.just(float("nan")), min_size=1, max_size=80),
    cuts=st.sets(st.integers(1, 79), max_size=5),
)
def test_peaks_are_least_and_greatest_and_look_over_no_break(values: list[float], cuts: set[int]) -> None:
    column, time = np.array(values), np.arange(float(len(values)))
    ends = peaks_of(time, column, sorted(cut for cut in cuts if cut < column.size))
    if np.isnan(column).all():
        assert ends is None
        return
    assert ends is not None
    assert (ends[0].value, ends[1].value) == (np.nanmin(column), np.nanmax(column))
    for peak in ends:
        assert column[int(peak.time_s)] == peak.value == peak.near[peak.at]
        assert peak.near.size <= 2 * NEAR + 1
        assert not np.isnan(peak.near).any()


@pytest.mark.parametrize("hidden", [None, 40_000])
def test_a_long_column_is_looked_at_in_parts(hidden: int | None) -> None:
    column = np.random.default_rng(5).standard_normal(100_001)
    column[[32_767, 32_768, 100_000]] = -9.0, 9.0, 9.0
    if hidden is not None:
        column[hidden] = np.nan
    ends = peaks_of(np.arange(column.size, dtype=float), column)
    assert ends is not None
    assert [peak.time_s for peak in ends] == [32_767.0, 32_768.0], "of equal ones the first"


def test_no_samples_have_no_extremes() -> None:
    empty = np.zeros(0)
    run = evaluate_run(Record(empty, empty, empty), RunFacts("e", "harmonic", status="stopped"))
    assert set(run.extremes) == set(EXTREME_NAMES)
    assert all(extreme.value is None for extreme in run.extremes.values())
    assert sample_extremes(Record(empty, empty, empty)) == {}


def test_extremes_are_never_inside_of_the_cycles_own() -> None:
    """What a cycle reached, the run reached."""
    run = StaticTest(noise_kN=0.0, noise_mm=0.0).evaluate(draws=0)
    for result in run.cycles:
        speeds = result.quantities.speed_loading_max_mm_per_s, result.quantities.speed_unloading_max_mm_per_s
        for speed in speeds:
            assert speed is None or speed <= value(run, "speed_max_mm_per_s")
        assert (result.quantities.temperature_max_C or 0.0) <= value(run, "temperature_max_C")


def test_an_impact_states_the_greatest_force_of_its_samples() -> None:
    time, stroke, force = StaticTest(cycles=1).columns()
    force[500:505] += 40.0
    run = evaluate_run(make_record(time, stroke, force), RunFacts("i", "impact"), NO_DRAWS)
    assert run_entry(run)["impact"]["force_max_kN"] == force.max()


def coverage(runs: int, noise: float) -> dict[str, float]:
    """Return how often the 95 % intervals hold the truth, in runs with errors of their own."""
    random = np.random.default_rng(7)
    ellipse = Ellipse()
    exact = ellipse.columns(1.0, 200.0, 6.3)
    truth = {
        "force_max_kN": 100.0 + float(np.hypot(4.0 * 20.0, 0.6 * 20.0)),
        "stroke_max_mm": 70.0,
        "speed_loading_max_mm_per_s": 2.0 * np.pi * 20.0,
    }
    held = dict.fromkeys(truth, 0)
    for seed in range(runs):
        time, stroke, force = ellipse.columns(1.0, 200.0, 6.3, noise=noise, seed=seed)
        force = force + exact[2] * random.uniform(-0.005, 0.005) + random.uniform(-0.3, 0.3)
        shape = 0.46 * 0.25 / 3**0.5 / 2**0.5 * random.standard_normal(6)
        for k in (1, 2, 3):
            angle = np.pi * k / 120.0 * exact[1]
            stroke = stroke + shape[2 * k - 2] * (np.cos(angle) - 1.0) + shape[2 * k - 1] * np.sin(angle)
        stroke = stroke + np.sum(random.uniform(-0.025, 0.025, 2))
        run = evaluate_run(make_record(time, stroke, force), HARMONIC, Options(draws=400, seed=seed))
        for name, true in truth.items():
            half = run.extremes[name].half_width_95
            assert half is not None
            held[name] += abs(value(run, name) - true) <= half
    return {name: count / runs for name, count in held.items()}


@pytest.mark.parametrize("noise", [2e-4])
def test_intervals_hold_the_truth(noise: float) -> None:
    """Of 30 runs, 95 % have a standard deviation of 4 %."""
    for name, share in coverage(30, noise).items():
        assert share >= 0.85, name


@pytest.mark.long
@pytest.mark.parametrize("noise", [0.0, 2e-4, 2e-3])
def test_intervals_hold_the_truth_in_many_runs(noise: float) -> None:
    for name, share in coverage(1500, noise).items():
        assert 0.93 <= share <= 1.0, name


def test_where_asks_for_extremes_and_the_means_keep_a_name() -> None:
    """The mean of the cycles' maxima stays below 35 °C, and the run reached 40.9."""
    time, stroke, force = swelling()
    at = np.arange(0.0, 13.0, 0.1)
    warm = Temperature("temperature_1", at, np.interp(at, (0.0, 11.0, 12.9), (25.0, 33.0, 40.9)))
    run = evaluate_run(make_record(time, stroke, force, temperatures=[warm]), HARMONIC, NO_DRAWS)
    kept = keep(run)
    (facts,) = result_facts(kept)
    for asked, answer in (
        ("temperature_max > 35", True),
        ("mean_temperature_max > 35", False),
        ("force_max_kN == 188.0 and mean_force_max < 182", True),
        ("speed_max > 130", True),
        ("stroke_max > 71 and stroke_min < 29", True),
    ):
        assert parse_query(asked, FIELDS).matches(facts) is answer, asked
    table = runs_frame(ArchiveEvaluation((kept,), (), EvaluationSettings(), software()))
    assert table["extreme_temperature_max_C"][0] == pytest.approx(40.9)
    assert table["time_s(extreme_temperature_max_C)"][0] == pytest.approx(12.9)
    assert table["temperature_max_C"][0] < 35.0, "a mean, as in the summary"


def test_each_step_has_extremes_and_the_run_those_between_them() -> None:
    """20 mm, a ramp up to 95 mm and back, 10 mm: the ramp belongs to no step."""
    one, other = (Ellipse(amplitude_mm=a).columns(1.0, 500.0, 6.0, phase=-0.5 * np.pi) for a in (20.0, 10.0))
    ramp = np.interp(np.arange(2000) / 500.0, (0.0, 1.0, 2.0, 3.0, 4.0), (30.0, 30.0, 95.0, 40.0, 40.0))
    columns = (
        np.arange(one[0].size + 2000 + other[0].size) / 500.0,
        np.concatenate((one[1], ramp, other[1])),
        np.concatenate((one[2], 4.0 * ramp, other[2])),
    )
    at = np.arange(0.0, 16.0, 0.1)
    warm = Temperature("temperature_1", at, np.where(np.abs(at - 8.0) < 0.5, 41.0, 30.0))
    run = evaluate_run(make_record(*columns, temperatures=[warm]), HARMONIC, NO_DRAWS)
    assert [step.extremes["stroke_max_mm"].value for step in run.steps] == pytest.approx(
        [70.0, 60.0], abs=0.1
    )
    assert value(run, "stroke_max_mm") == pytest.approx(95.0)
    facts = result_facts(keep(run))
    found = [each["part"] for each in facts if parse_query("temperature_max > 35", FIELDS).matches(each)]
    assert found == [None], "the run, and none of its steps"
    found = [each["part"] for each in facts if parse_query("stroke_max < 65", FIELDS).matches(each)]
    assert found == [2]


def test_a_comparison_of_evaluations_says_what_moved_among_extremes() -> None:
    time, stroke, force = swelling()
    one, two = (
        evaluate_run(make_record(time, stroke, factor * force), HARMONIC, NO_DRAWS) for factor in (1.0, 1.01)
    )
    old, new = ({**evaluation_document([run]), "settings": {}} for run in (one, two))
    moves = {move.quantity: move for move in compare_evaluations(old, new).moves}
    assert moves["extreme_force_max_kN"].relative == pytest.approx(0.01)
    del old["runs"][0]["extremes"]
    assert not any(m.quantity.startswith("extreme_") for m in compare_evaluations(old, new).moves)


def test_a_force_that_was_read_more_often_than_the_stroke_has_its_own_extremes(tmp_path: Path) -> None:
    """Blanks of the slower stroke: its instants are the record's, and the force's peak lies between two."""
    time, stroke, force = Ellipse().columns(1.0, 1000.0, 6.3)
    force[1994:1997] += (2.0, 40.0, 2.0)
    slow = np.where(np.arange(time.size) % 10 == 0, stroke, np.nan)
    path = csv_of(tmp_path / "r.csv", time__s=time, force__kN=force, stroke__mm=slow)
    run = evaluate_run(*load_run(path), NO_DRAWS)
    assert value(run, "force_max_kN") == pytest.approx(force.max(), abs=0.02)
    assert run.extremes["force_max_kN"].time_s == pytest.approx(time[np.argmax(force)], abs=1e-6)
    assert value(run, "stroke_max_mm") == pytest.approx(np.nanmax(slow), abs=0.01)


def test_readings_that_were_moved_have_the_noise_that_they_were_read_with() -> None:
    """Half way between two readings the mean of both has 0.7 of their noise; the extreme is one of them."""
    time, stroke, force = StaticTest(noise_kN=0.8).columns()
    moved = 0.5 * (force + np.append(force[1:], force[-1]))
    facts = RunFacts("m", "static", force_uncertainty=ChannelUncertainty(accuracy_percent=0.1, zero=0.01))
    facts = replace(facts, stroke_uncertainty=(ChannelUncertainty(accuracy_percent=0.1),))
    brought = replace(make_record(time, stroke, moved), as_recorded={"force": (time, force)})
    halves = []
    for record in (make_record(time, stroke, force), brought):
        least = evaluate_run(record, facts, Options(draws=1000)).extremes["force_min_kN"]
        assert least.half_width_95 is not None
        halves.append(least.half_width_95)
    assert halves[1] == pytest.approx(halves[0], rel=0.05)


LINEAR = np.linspace(-1.0, 1.0, 1001)


@pytest.mark.parametrize(
    ("levels", "least"),
    [(np.zeros(3000), 0.92), (np.zeros(30), 0.90), (-900.0 * LINEAR**2, 0.92), (-60.0 * abs(LINEAR), 0.93)],
    ids=["long rest", "short rest", "smooth top", "tip"],
)
def test_how_far_noise_overreaches_hangs_on_how_long_it_may(levels: Floats, least: float) -> None:
    """The largest of thousands of readings of a rest is 3.5 standard deviations too large."""
    draws = draw_errors(
        ChannelUncertainty(accuracy_percent=0.1), [ChannelUncertainty(accuracy_percent=0.1)], 1000, 1
    )
    assert draws is not None
    random = np.random.default_rng(3)
    held = []
    for _ in range(400):
        read = levels + random.standard_normal(levels.size)
        greatest = float(np.max(read))
        reading = ExtremeReadings(greatest, 1.0, rivals_of(read, greatest, 1.0))
        held.append(abs(greatest) <= stated(channel_errors(draws, reading, ChannelUncertainty()))[1])
    assert least - 0.03 <= np.mean(held) <= 0.99  # 95 % of 400 have a standard deviation of 1.1 %
