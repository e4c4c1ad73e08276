"""Channels read at different instants, through import and evaluation: the figures of the closed form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nptdms import ChannelObject, TdmsWriter

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loading.long_runs import MemoryBounds
from bufferstand.evaluation.loading.resample import bring, too_coarse, usable
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from tests.evaluation.signals import Ellipse, Floats, StaticTest
from tests.recording.foreign.test_instants import every, written

ELLIPSE = Ellipse()
FREQUENCY_HZ = 1.0
CYCLES = 5.0
STATED = """
[columns.stroke]
header = "stroke"
uncertainty = { linearity = 0.1, zero = 0.1, u_delay_s = 1e-5 }
[columns.force]
header = "force"
uncertainty = { accuracy_percent = 0.2, reversibility_percent = 0.2, zero = 0.2, u_delay_s = 1e-5 }
"""


@dataclass(frozen=True)
class Columns:
    """Time, stroke and force of the ellipse with noise, and the truth at other instants."""

    time_s: Floats
    stroke_mm: Floats
    force_kN: Floats


def columns(rate_Hz: float = 1000.0, *, off_s: float = 0.0, seed: int = 1) -> Columns:
    time_s = off_s + np.arange(round(CYCLES * rate_Hz / FREQUENCY_HZ) + 1) / rate_Hz
    angle = 2.0 * np.pi * FREQUENCY_HZ * time_s - np.pi / 2.0
    random = np.random.default_rng(seed)
    stroke = ELLIPSE.mean_mm + ELLIPSE.amplitude_mm * np.sin(angle)
    force = ELLIPSE.mean_kN + ELLIPSE.storage * (stroke - ELLIPSE.mean_mm)
    force = force + ELLIPSE.loss * ELLIPSE.amplitude_mm * np.cos(angle)
    return Columns(
        time_s,
        stroke + 0.005 * random.standard_normal(time_s.size),
        force + 0.05 * random.standard_normal(time_s.size),
    )


def evaluated(path: Path, options: ImportOptions | None = None) -> RunEvaluation:
    mapping = path.with_name("mapping.toml")
    mapping.write_text(STATED, encoding="utf-8")
    made = import_file(path, path.parent / "out", options or ImportOptions(kind="harmonic", mapping=mapping))
    return evaluate_run(*load_run(made.path), Options(draws=200))


def assert_true(run: RunEvaluation, cycles: int = 4) -> None:
    """Check the figures: within half a per cent of the closed form, and within U of it."""
    assert len(run.summary.cycles_used) >= cycles
    truth = {
        "absorbed_energy_J": ELLIPSE.absorbed,
        "stored_energy_J": ELLIPSE.stored,
        "damping": ELLIPSE.absorbed / ELLIPSE.stored,
        "loss_factor": ELLIPSE.loss / ELLIPSE.storage,
        "stroke_max_mm": ELLIPSE.mean_mm + ELLIPSE.amplitude_mm,
        "frequency_Hz": FREQUENCY_HZ,
    }
    for name, true in truth.items():
        figure = run.summary.values[name]
        assert figure.value == pytest.approx(true, rel=5e-3), name
        assert figure.value is not None
        assert figure.expanded_uncertainty is not None
        assert abs(figure.value - true) <= figure.expanded_uncertainty, name


@pytest.mark.parametrize(("stroke_rows", "force_rows"), [(5, 1), (1, 5), (2, 1), (1, 20), (20, 1), (4, 10)])
def test_blanks_of_a_slower_channel_cost_nothing(tmp_path: Path, stroke_rows: int, force_rows: int) -> None:
    made = columns()
    stroke, force = every(made.stroke_mm, stroke_rows), every(made.force_kN, force_rows)
    run = evaluated(written(tmp_path / "r.csv", made.time_s, stroke, force))
    assert run.record.breaks == ()
    assert_true(run)


def test_rows_of_either_channel_in_turn(tmp_path: Path) -> None:
    fast, slow = columns(1000.0), columns(300.0, off_s=0.00037)
    time_s = np.concatenate((fast.time_s, slow.time_s))
    order = np.argsort(time_s)
    none = np.full(time_s.size, np.nan)
    stroke, force = none.copy(), none.copy()
    force[: fast.time_s.size], stroke[fast.time_s.size :] = fast.force_kN, slow.stroke_mm
    assert_true(evaluated(written(tmp_path / "r.csv", time_s[order], stroke[order], force[order])))


@pytest.mark.parametrize(("stroke_Hz", "force_Hz"), [(1000.0, 4000.0), (1000.0, 100.0), (100.0, 2000.0)])
def test_groups_of_different_rates(tmp_path: Path, stroke_Hz: float, force_Hz: float) -> None:
    made = {
        "stroke": (columns(stroke_Hz).stroke_mm, stroke_Hz, "mm"),
        "force": (columns(force_Hz, off_s=0.0002).force_kN, force_Hz, "kN"),
    }
    path = tmp_path / "r.tdms"
    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject(
                    name, name, values,
                    {
                        "wf_increment": 1.0 / rate, "unit_string": unit,
                        "wf_start_offset": 0.0002 if name == "force" else 0.0,
                    },
                )
                for name, (values, rate, unit) in made.items()
            ]
        )  # fmt: skip
    assert_true(evaluated(path, ImportOptions(kind="harmonic", mapping=stated(tmp_path))))


def stated(folder: Path) -> Path:
    path = folder / "mapping.toml"
    path.write_text(STATED, encoding="utf-8")
    return path


def test_doubled_rows_and_a_coarse_clock_cost_nothing(tmp_path: Path) -> None:
    """The same figures, to the last digit, as of each row once; as of full stamps but for rounding."""
    made = columns()
    plain = evaluated(written(tmp_path / "plain.csv", made.time_s, made.stroke_mm, made.force_kN))
    rows = np.sort(np.concatenate((np.arange(made.time_s.size), np.arange(3, made.time_s.size, 37))))
    twice = (column[rows] for column in (made.time_s, made.stroke_mm, made.force_kN))
    doubled = evaluated(written(tmp_path / "doubled.csv", *twice))
    coarse_s = np.floor(made.time_s * 100.0 + 1e-9) / 100.0
    coarse = evaluated(written(tmp_path / "coarse.csv", coarse_s, made.stroke_mm, made.force_kN))
    assert_true(plain)
    assert doubled.record.breaks == coarse.record.breaks == ()
    for name, figure in plain.summary.values.items():
        assert doubled.summary.values[name].value == figure.value, name
        if figure.value is not None:
            assert coarse.summary.values[name].value == pytest.approx(figure.value, rel=1e-6), name


@pytest.mark.parametrize("slow", ["stroke", "force"])
def test_a_channel_too_slow_for_the_motion_is_refused_or_leaves_no_figure(tmp_path: Path, slow: str) -> None:
    """Three readings a cycle close to a loop of some shape: none may come out."""
    made = columns()
    stroke = every(made.stroke_mm, 333) if slow == "stroke" else made.stroke_mm
    force = every(made.force_kN, 333) if slow == "force" else made.force_kN
    path = written(tmp_path / "r.csv", made.time_s, stroke, force)
    try:
        run = evaluated(path)
    except BadInput as error:
        text = error.message()
        assert f"channel {slow}" in text
    else:
        assert not run.summary.cycles_used
        text = " ".join(run.warnings)
    assert f"{slow} is read every 0.333 s only" in text or "it has fewer than 8 samples" in text


def test_a_stroke_that_is_sampled_at_almost_the_frequency_of_its_motion_is_found_out(tmp_path: Path) -> None:
    """0.95 readings a cycle show a slow motion that never was, and the force shows that."""
    made = columns()
    tiled = np.tile(made.stroke_mm[:-1], 12), np.tile(made.force_kN[:-1], 12)
    time_s = np.arange(tiled[0].size) / 1000.0
    path = written(tmp_path / "r.csv", time_s, every(tiled[0], 950), tiled[1])
    with pytest.raises(BadInput, match=r"stroke is read every 0.95 s only, and in 63 of 63 intervals"):
        evaluated(path)


def test_what_only_one_channel_has_at_the_ends_is_left_out_and_said(tmp_path: Path) -> None:
    made = columns()
    force = every(made.force_kN, 5)
    force[made.time_s < 1.0] = np.nan
    run = evaluated(written(tmp_path / "r.csv", made.time_s, made.stroke_mm, force))
    assert run.record.time_s[0] == pytest.approx(1.0, abs=0.01)
    assert any("both on record from" in text for text in run.warnings)


# --- bringing one channel to the instants of another --------------------------------------------------


@given(st.floats(0.0, 1.0), st.integers(12, 60))
def test_a_sine_is_brought_and_halving_bounds_what_is_off(phase: float, a_cycle: int) -> None:
    at_s = np.arange(6 * a_cycle) / a_cycle
    wanted_s = np.linspace(1.0, 5.0, 997)
    found = bring(at_s, np.sin(2.0 * np.pi * at_s + phase), wanted_s)
    off = np.abs(found.value - np.sin(2.0 * np.pi * wanted_s + phase))
    assert np.max(off) < 5.0 / a_cycle**4 * 10.0
    assert np.max(off) <= np.max(np.abs(found.halved[0]))


def test_nothing_is_brought_across_a_hole_or_beyond_the_ends() -> None:
    at_s = np.delete(np.arange(1000) / 100.0, slice(400, 500))
    wanted_s = np.arange(-1000, 11000) / 1000.0
    value = bring(at_s, at_s, wanted_s).value
    inside = np.isfinite(value)
    assert not inside[(wanted_s > 4.0) & (wanted_s < 4.99)].any()
    assert not inside[(wanted_s < -0.002) | (wanted_s > 9.992)].any()
    assert inside[(wanted_s > 0.0) & (wanted_s < 3.99)].all()
    np.testing.assert_allclose(value[inside], wanted_s[inside], atol=1e-9)


def test_usable_readings_are_numbers_at_rising_instants() -> None:
    at_s, value = usable(
        np.array([0.0, 1.0, 1.0, 0.5, 2.0, np.nan, 3.0]), np.array([1, 2, 9, 9, np.nan, 9, 4.0])
    )
    assert at_s.tolist() == [0.0, 1.0, 3.0]
    assert value.tolist() == [1.0, 2.0, 4.0]


@pytest.mark.parametrize(("a_cycle", "coarse"), [(20, False), (8, False), (5, True), (2, True)])
def test_the_faster_channel_says_whether_the_slower_one_can_follow(a_cycle: int, coarse: bool) -> None:
    fast_s = np.linspace(0.0, 5.0, 5001)
    slow_s = np.arange(0.0, 5.0, 1.0 / a_cycle)
    assert too_coarse(slow_s, fast_s, np.cos(2.0 * np.pi * fast_s), 0.05 * 2.0).any() == coarse


# --- runs too long to be held at once -----------------------------------------------------------------


@pytest.mark.parametrize(("stroke_Hz", "force_Hz"), [(1000.0, 2000.0), (1000.0, 200.0), (100.0, 1000.0)])
@pytest.mark.parametrize("piece", [500, 997])
def test_pieces_of_streams_give_what_the_whole_gives(
    tmp_path: Path, stroke_Hz: float, force_Hz: float, piece: int
) -> None:
    path = tmp_path / "r.tdms"
    slow, fast = columns(stroke_Hz, off_s=0.25), columns(force_Hz)
    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject(
                    "A", "stroke", slow.stroke_mm,
                    {"wf_increment": 1.0 / stroke_Hz, "wf_start_offset": 0.25, "unit_string": "mm"},
                ),
                ChannelObject(
                    "B", "force", fast.force_kN,
                    {"wf_increment": 1.0 / force_Hz, "wf_start_offset": 0.0, "unit_string": "kN"},
                ),
            ]
        )  # fmt: skip
    made = import_file(path, tmp_path / "out", ImportOptions(kind="harmonic")).path
    whole, _ = load_run(made)
    parts, _ = load_run(made, MemoryBounds(whole_rows=100, piece_rows=piece))
    np.testing.assert_array_equal(parts.time_s, whole.time_s)
    np.testing.assert_allclose(parts.stroke_mm, whole.stroke_mm, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(parts.force_kN, whole.force_kN, rtol=0.0, atol=1e-9)
    assert parts.breaks == whole.breaks == ()


def test_a_long_run_of_too_few_readings_is_refused_like_a_short_one(tmp_path: Path) -> None:
    made = columns()
    path = written(tmp_path / "r.csv", made.time_s, made.stroke_mm, every(made.force_kN, 333))
    file = import_file(path, tmp_path / "out", ImportOptions(kind="harmonic")).path
    texts = []
    for bounds in (None, MemoryBounds(whole_rows=100, piece_rows=500)):
        with pytest.raises(BadInput, match="force is read every") as caught:
            load_run(file, bounds)
        texts.append(caught.value.message())
    assert texts[0] == texts[1]


# --- what lies between the readings of a slower force -------------------------------------------------


@pytest.mark.parametrize("rows", [20, 50])
def test_what_interpolation_may_change_is_part_of_u_and_said(tmp_path: Path, rows: int) -> None:
    made = columns()
    run = evaluated(written(tmp_path / "r.csv", made.time_s, made.stroke_mm, every(made.force_kN, rows)))
    assert_true(run, cycles=3)
    assert any("the force is interpolated between readings" in text for text in run.warnings)
    bounds = [c.gap_limits["absorbed_energy_J"] for c in run.cycles if c.cycle.complete]
    assert all(abs(bound) > 0.0 for bound in bounds)


def test_a_force_of_few_readings_a_cycle_has_no_figures_and_says_why(tmp_path: Path) -> None:
    """Eight readings a cycle could be told from the truth; every second one of them could not."""
    made = columns()
    corners = made.force_kN + 20.0 * np.sign(np.sin(2.0 * np.pi * FREQUENCY_HZ * made.time_s))
    run = evaluated(written(tmp_path / "r.csv", made.time_s, made.stroke_mm, every(corners, 125)))
    assert not run.summary.cycles_used
    assert any("what lies between the readings of the force, 0.125 s apart" in text for text in run.warnings)


def test_noise_of_a_slow_force_is_no_reason_to_leave_a_cycle_out(tmp_path: Path) -> None:
    made = columns()
    noisy = made.force_kN + 1.0 * np.random.default_rng(4).standard_normal(made.time_s.size)
    run = evaluated(written(tmp_path / "r.csv", made.time_s, made.stroke_mm, every(noisy, 20)))
    assert len(run.summary.cycles_used) == 5


def test_a_static_test_with_a_slower_force_is_judged(tmp_path: Path) -> None:
    """Its force has corners where the stroke turns: the figures of the full record are within U."""
    time_s, stroke, force = StaticTest(rate_Hz=100.0).columns()
    mapping = stated(tmp_path)
    runs = []
    for name, rows in (("full", 1), ("slow", 10)):
        path = written(tmp_path / f"{name}.csv", time_s, stroke, every(force, rows))
        runs.append(evaluated(path, ImportOptions(kind="static", mapping=mapping)))
    full, slow = runs
    assert len(slow.cycles) == len(full.cycles) == 3
    for one, other in zip(full.cycles, slow.cycles, strict=True):
        assert other.cycle.complete
        for name in ("absorbed_energy_J", "stored_energy_J", "damping"):
            true, value = getattr(one.quantities, name), getattr(other.quantities, name)
            assert abs(value - true) <= (other.expanded_uncertainty[name] or 0.0), name
            assert value == pytest.approx(true, rel=5e-3), name
