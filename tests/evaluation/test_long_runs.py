"""A long run is read in pieces and averaged: the figures, breaks and defects of the run read whole."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loading.condense import block_means, block_starts
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loading.long_runs import MemoryBounds
from bufferstand.evaluation.record.defects import Cleaner
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.content import Segment, StreamContent
from bufferstand.recording.runfile.file import open_run, write_run
from tests.evaluation.long_run_child import ABSORBED_J
from tests.evaluation.signals import Ellipse, Floats
from tests.evaluation.test_load import ELLIPSE, RATE, csv_of, write
from tests.recording import samples

ROOT = Path(__file__).parents[2]
WHOLE = MemoryBounds()
PIECES = MemoryBounds(whole_rows=100, piece_rows=256)
HIDDEN = np.nan


def shortened(record: Record, size: int) -> Record:
    """Return means of a record that was read whole."""
    edges = np.array([0, *record.breaks, record.time_s.size])

    def column(values: Floats | None) -> Any:
        return None if values is None else block_means(values, edges, size)

    return replace(
        record,
        **{name: column(getattr(record, name)) for name in COLUMNS},
        breaks=tuple(np.searchsorted(block_starts(edges, size), record.breaks).tolist()),
        averaged=size,
    )


COLUMNS = ("time_s", "stroke_mm", "force_kN", "speed_mm_per_s", "wire_difference_mm")


def assert_same(one: Record, other: Record, atol: float) -> None:
    for name in COLUMNS:
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None), name
        if a is not None:
            np.testing.assert_allclose(a, b, rtol=0.0, atol=atol, err_msg=name)
    assert one.breaks == other.breaks
    assert one.defects == other.defects
    assert one.averaged == other.averaged
    for mine, its in zip(one.temperatures, other.temperatures, strict=True):
        np.testing.assert_array_equal(mine.temperature_C, its.temperature_C)


@pytest.mark.parametrize("piece", [97, 256, 350, 702, 4000])
@pytest.mark.parametrize("points", [10**9, 500, 130])
def test_pieces_join(tmp_path: Path, piece: int, points: int) -> None:
    """A gap in the middle of a piece, at its first row or just before; delays undone by splines."""
    size = ELLIPSE.columns(2.0, RATE, 6.5)[0].size
    kept = np.delete(np.arange(size), np.r_[700:720, 1071, 1200:1210])
    path = write(tmp_path / "r1.h5", kept=kept)
    whole, facts = load_run(path)
    short, same = load_run(path, MemoryBounds(whole_rows=100, piece_rows=piece, points=points))
    assert facts == same
    assert whole.breaks == (700, 1051, 1179)
    block = -(-kept.size // points)
    assert_same(short, shortened(whole, block) if block > 1 else whole, 1e-9)


def test_cells_without_a_number_and_time_that_repeats(tmp_path: Path) -> None:
    """Across the edges of pieces, at both ends of the record, and longer than a piece."""
    time, stroke, force = (column[:400].copy() for column in ELLIPSE.columns(2.0, 100.0, 8.5))
    force[[0, 1, 63, 64, 65, 399]] = HIDDEN
    force[150:260] = HIDDEN
    stroke[[128, 300]] = HIDDEN
    time[[320, 319]] = time[318]
    time[383:387] -= 0.2
    speed = 100.0 * np.gradient(stroke)
    columns = {"time__s": time, "force__kN": force, "stroke__mm": stroke, "speed__mm/s": speed}
    path = csv_of(tmp_path / "dirty.csv", **columns, **{"temperature_1__°C": time})
    whole, _ = load_run(path)
    assert {d.kind for d in whole.defects} >= {"nan", "repeated-time", "backward-time"}
    for piece in (7, 64, 65, 399):
        for points in (10**9, 60):
            short, _ = load_run(path, MemoryBounds(whole_rows=10, piece_rows=piece, points=points))
            block = -(-400 // points)
            assert_same(short, shortened(whole, block) if block > 1 else whole, 1e-12)


def test_more_breaks_than_blocks_were_foreseen(tmp_path: Path) -> None:
    time, stroke, force = Ellipse().columns(1.0, 1000.0, 5.0)
    force[::3] = HIDDEN
    path = columns_written(tmp_path / "r.h5", time, stroke, force)
    whole, _ = load_run(path)
    assert len(whole.breaks) == 1666
    short, _ = load_run(path, MemoryBounds(whole_rows=1000, piece_rows=512, points=100))
    assert_same(short, shortened(whole, 51), 1e-12)


STEPS = st.sampled_from([0.01, 0.01, 0.01, 0.01, 0.01, 0.011, 0.05, 0.0, -0.03, HIDDEN])


@settings(max_examples=150, deadline=None)
@given(
    steps=st.lists(STEPS, min_size=3, max_size=60),
    hidden=st.sets(st.integers(0, 59), max_size=12),
    cuts=st.sets(st.integers(1, 59), max_size=6),
    lost=st.dictionaries(st.integers(1, 59), st.integers(0, 3), max_size=4),
)
def test_any_pieces_have_the_defects_of_the_whole(
    steps: list[float], hidden: set[int], cuts: set[int], lost: dict[int, int]
) -> None:
    time = np.cumsum(np.nan_to_num(steps))
    time[np.isnan(steps)] = HIDDEN
    stroke = np.sin(3.0 * np.arange(time.size))
    stroke[[row for row in hidden if row < time.size]] = HIDDEN
    interruptions = [(row, count) for row, count in sorted(lost.items()) if row < time.size]
    whole = Cleaner()  # make_record sees more: stretches of time with steps of their own
    all_kept, all_breaks = whole.take(time, stroke, stroke, interruptions)
    if whole.kept < 2:
        return
    limit_s = _limit_of(time[all_kept], stroke[all_kept])
    cleaner, kept, breaks = Cleaner(limit_s), [], []
    edges = [0, *sorted(cut for cut in cuts if cut < time.size), time.size]
    for first, last in pairwise(edges):
        part = slice(first, last)
        own = [(row - first, count) for row, count in interruptions if first <= row < last]
        before = cleaner.kept
        rows, found = cleaner.take(time[part], stroke[part], stroke[part], own)
        kept.append(time[part][rows])
        breaks += (found + before).tolist()
    np.testing.assert_array_equal(np.concatenate(kept), time[all_kept])
    np.testing.assert_array_equal(breaks, all_breaks)
    assert sorted(map(repr, cleaner.defects())) == sorted(map(repr, whole.defects()))


def _limit_of(time: Floats, stroke: Floats) -> float:
    """Return the longest usual step as the whole record has it: half way between usual steps and gaps."""
    step = np.diff(time)
    gaps = Cleaner().take(time, stroke, stroke)[1]
    usual = np.delete(step, gaps - 1)
    return float(np.max(usual, initial=0.0)) * (1.0 + 1e-9) if gaps.size else np.inf


def evaluated(path: Path, bounds: MemoryBounds) -> RunEvaluation:
    return evaluate_run(*load_run(path, bounds), Options(draws=200))


def test_figures_are_those_of_the_run_read_whole(tmp_path: Path) -> None:
    """A thousand samples a cycle, condensed by 4 while they are read and then as ever; uncertainties too."""
    columns = Ellipse().columns(1.0, 1000.0, 20.3, noise=2e-4)
    columns[2][5000:5120] = columns[1][12_288] = HIDDEN
    kept = np.delete(np.arange(columns[0].size), slice(9000, 9120))
    path = columns_written(tmp_path / "r.h5", *(column[kept] for column in columns))
    whole = evaluated(path, WHOLE)
    short = evaluated(path, MemoryBounds(whole_rows=1000, piece_rows=1024, points=6000))
    assert short.record.averaged % 4 == 0
    assert [c.cycle.complete for c in short.cycles] == [c.cycle.complete for c in whole.cycles]
    assert short.cycles[5].cycle.why == whole.cycles[5].cycle.why != ()
    assert not all(c.cycle.complete for c in whole.cycles[1:-1])
    assert short.summary.cycles_used == whole.summary.cycles_used
    own = " does not close ("  # by how much is told to 0.1 mm
    assert [w for w in short.warnings if own not in w] == [w for w in whole.warnings if own not in w]
    for name, tolerance in TOLERANCES.items():
        one, other = whole.summary.values[name], short.summary.values[name]
        assert other.value == pytest.approx(one.value, rel=tolerance), name
        assert one.expanded_uncertainty is not None
        assert other.expanded_uncertainty == pytest.approx(one.expanded_uncertainty, rel=0.1), name


TOLERANCES = {
    "stored_energy_J": 1e-5,
    "absorbed_energy_J": 3e-5,
    "damping": 3e-5,
    "storage_stiffness_kN_per_mm": 1e-5,
    "loss_stiffness_kN_per_mm": 3e-5,
    "tangent_stiffness_kN_per_mm": 1e-3,
    "amplitude_mm": 1e-4,
    "force_max_kN": 1e-3,
}
"""By how much the two ways may differ; noise of 0.02 % of the range on both channels is in it."""


def columns_written(
    path: Path,
    time: Floats,
    stroke: Floats,
    force: Floats,
    further: Mapping[str, Floats] | None = None,
    **run: Any,
) -> Path:
    """Write an imported run of these columns as they are; ``further`` are more strokes, by name."""
    strokes = {"stroke_1": stroke, **(further or {})}
    metadata = samples.metadata(path.stem, status="imported", **run)
    metadata["step"] = {}
    channels = [
        Channel(
            name="force",
            quantity="force",
            unit="kN",
            uncertainty=ChannelUncertainty(accuracy_percent=0.5, zero=0.1),
        ),
        *(
            Channel(
                name=name,
                quantity="stroke",
                unit="mm",
                uncertainty=ChannelUncertainty(linearity=0.25, zero=0.05),
            )
            for name in strokes
        ),
    ]
    metadata["streams"] = {
        "import": {
            "clock": "device",
            "rate_Hz": 1000.0,
            "device": "file",
            "channels": [channel.model_dump(mode="json") for channel in channels],
        }
    }
    return write_run(path, metadata, {"import": StreamContent(time, {"force": force, **strokes})})


@pytest.mark.parametrize("points", [10**9, 900])
@pytest.mark.parametrize("stuck", [("stroke_2",), ("stroke_1", "stroke_3")])
def test_wires_that_fail_are_found_in_pieces_as_in_the_whole(
    tmp_path: Path, points: int, stuck: tuple[str, ...]
) -> None:
    """Of three wires those that stand still from the middle on are left out, whatever is held at once."""
    time, stroke, force = Ellipse().columns(1.0, 500.0, 8.0)
    random = np.random.default_rng(11)
    wires = {f"stroke_{n}": stroke + 0.005 * random.standard_normal(stroke.size) for n in (1, 2, 3)}
    middle = stroke.size // 2
    for name in stuck:
        wires[name][middle:] = wires[name][middle]
    path = columns_written(tmp_path / "r.h5", time, wires.pop("stroke_1"), force, wires, kind="harmonic")
    whole, parts = (
        evaluated(path, bounds)
        for bounds in (WHOLE, MemoryBounds(whole_rows=100, piece_rows=333, points=points))
    )
    assert whole.draw_wires is not None
    assert parts.draw_wires is not None
    assert (
        [one.wire for one in parts.draw_wires.out]
        == [one.wire for one in whole.draw_wires.out]
        == list(stuck)
    )
    for mine, its in zip(parts.draw_wires.out, whole.draw_wires.out, strict=True):
        assert mine.from_s == pytest.approx(its.from_s, abs=0.05)
        assert mine.from_s == pytest.approx(time[middle], abs=0.05)
    assert len(parts.facts.stroke_uncertainty) == 3 - len(stuck)
    assert parts.summary.values["amplitude_mm"].value == pytest.approx(
        whole.summary.values["amplitude_mm"].value, rel=2e-3
    )
    assert parts.extremes["stroke_max_mm"].value == pytest.approx(
        whole.extremes["stroke_max_mm"].value, abs=0.05
    )
    assert {one.kind for one in parts.findings} == {one.kind for one in whole.findings}


def test_sound_wires_in_pieces_are_three_as_in_the_whole(tmp_path: Path) -> None:
    time, stroke, force = Ellipse().columns(1.0, 500.0, 8.0)
    wires = {f"stroke_{n}": stroke + 0.1 * n for n in (1, 2, 3)}
    path = columns_written(tmp_path / "r.h5", time, wires.pop("stroke_1"), force, wires, kind="harmonic")
    whole, parts = (evaluated(path, bounds) for bounds in (WHOLE, PIECES))
    assert_same(parts.record, whole.record, 1e-9)
    for one in (whole, parts):
        assert one.draw_wires is not None
        assert one.draw_wires.out == ()
        assert one.draw_wires.largest_difference_mm == pytest.approx(0.2)
    assert {one.kind for one in parts.findings} == {one.kind for one in whole.findings}


def test_a_falling_branch_is_remembered_from_piece_to_piece(tmp_path: Path) -> None:
    metadata = samples.metadata(status="complete")
    calibration = Calibration(coefficients=(0.0, 0.01), falling=(0.3, 0.01), turn_counts=50.0)
    metadata["streams"]["controller"]["channels"][0]["calibration"] = calibration.model_dump(mode="json")
    rows = np.arange(3000)
    counts = samples.counts(rows)
    counts["force"] = np.round(5000.0 * np.sin(rows / 200.0)).astype(np.int32)
    content = StreamContent(samples.time_us(rows), counts, (Segment(0, 0, 0),))
    run = open_run(write_run(tmp_path / "r.h5", metadata, {"controller": content}))
    blocks = [block["force"] for block in run.blocks(["force"], 77)]
    whole = run.series("force")
    np.testing.assert_array_equal(np.concatenate([block.value for block in blocks]), whole.value)
    np.testing.assert_array_equal(np.concatenate([block.time_s for block in blocks]), whole.time_s)


def test_a_column_without_a_number_is_named_in_a_long_run_too(tmp_path: Path) -> None:
    nothing = np.full(400, HIDDEN)
    single = nothing.copy()
    single[7] = 1.0
    for name, column, count in (("force__kN", nothing, "none"), ("stroke__mm", single, "only 1")):
        run = csv_of(tmp_path / f"{count[:4]}.csv", **{name: column})
        with pytest.raises(BadInput, match=f"{count} of its 400 samples is a number"):
            load_run(run, PIECES)
    backward = csv_of(tmp_path / "back.csv", time__s=np.linspace(4.0, 0.0, 400))
    with pytest.raises(BadInput, match="399 of its 400 time stamps do not advance"):
        load_run(backward, PIECES)


def test_a_temperature_recorded_fast_is_thinned(tmp_path: Path) -> None:
    warm: Floats = 20.0 + 0.01 * np.arange(400)
    path = csv_of(tmp_path / "warm.csv", **{"temperature_1__°C": warm})
    (sensor,) = load_run(path, MemoryBounds(whole_rows=100, piece_rows=37, readings=50))[0].temperatures
    np.testing.assert_allclose(sensor.temperature_C, 20.0 + 0.08 * np.arange(50))
    np.testing.assert_allclose(sensor.time_s, 0.08 * np.arange(50))


def test_uneven_sampling_is_no_gap_in_a_long_run(tmp_path: Path) -> None:
    """Steps between 0.5 and 1.5 ms; one of 20 ms is one."""
    _, stroke, force = Ellipse().columns(1.0, 1000.0, 8.3)
    time = np.cumsum(np.random.default_rng(1).uniform(0.0005, 0.0015, stroke.size))
    time[4000:] += 0.02
    path = columns_written(tmp_path / "r.h5", time, stroke, force)
    whole, _ = load_run(path)
    short, _ = load_run(path, PIECES)
    assert whole.breaks == (4000,)
    assert_same(short, whole, 1e-12)


@pytest.mark.parametrize(
    ("cycles", "points", "words"),
    [(20, 10_000, ""), (200, 10_000, "leaves 44 points a cycle where 120 are wanted")],
)
def test_too_few_points_are_said(cycles: int, points: int, words: str) -> None:
    time, stroke, force = Ellipse().columns(cycles / 100.0, 1000.0, cycles)
    block = -(-time.size // points)
    record = shortened(make_record(time, stroke, force), block)
    found = [w for w in evaluate_run(record, RunFacts("r", "harmonic"), Options(draws=0)).warnings
             if w.startswith("coarse")]  # fmt: skip
    assert len(found) == (1 if words else 0)
    assert all(words in text for text in found)
    single = evaluate_run(record, RunFacts("r", "impact"), Options(draws=0)).warnings
    assert any("a peak shorter than" in text for text in single)


def test_cycles_as_short_as_a_block_are_not_taken_for_slow_ones(tmp_path: Path) -> None:
    path = columns_written(tmp_path / "r.h5", *Ellipse().columns(9.0, 1000.0, 90.0))
    for points, wrong in ((9000, False), (1000, False), (500, True), (100, True), (89, True)):
        run = evaluated(path, MemoryBounds(whole_rows=1000, piece_rows=1024, points=points))
        assert any("too coarse" in text for text in run.warnings) == wrong


def peaks_of(path: Path, rows: int, frequency_Hz: float, draws: int, *bounds: int) -> tuple[float, ...]:
    """Evaluate a run in a process; return peak memory before and after, the file's size and its cycles."""
    given = [str(number) for number in (rows, frequency_Hz, draws, *bounds)]
    done = subprocess.run(
        [sys.executable, "-m", "tests.evaluation.long_run_child", str(path), *given],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    before, after, size, cycles, absorbed_J, _ = map(float, done.stdout.split())
    assert absorbed_J == pytest.approx(ABSORBED_J, rel=1e-3)
    return before, after, size, cycles


def test_memory_does_not_grow_with_the_run(tmp_path: Path) -> None:
    """2 400 000 rows read whole take 290 MB more than the process has; in pieces 95, with libraries."""
    before, after, *_ = peaks_of(tmp_path / "r.h5", 2_400_000, 0.2, 0, 100_000, 65_536, 200_000)
    assert after - before < 150.0


@pytest.mark.long
@pytest.mark.parametrize("draws", [0, 2000])
def test_two_gigabytes_are_evaluated_under_500_megabytes(tmp_path: Path, draws: int) -> None:
    _, after, size, cycles = peaks_of(tmp_path / "r.h5", 175_000_000, 0.1, draws)
    assert size > 2000.0
    assert cycles == pytest.approx(17_500, abs=1)
    assert after < 500.0
