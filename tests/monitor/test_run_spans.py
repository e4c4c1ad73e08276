"""A zoom into a run that is over reads what it shows, and gives what reading all of it gives."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.monitor.past import RunSpans, run_spans
from bufferstand.foundation.channels import Calibration
from bufferstand.recording.content import Anchor, Segment, StreamContent
from bufferstand.recording.runfile import Run, open_run, write_run
from bufferstand.recording.runfile.reading_apart import DatasetReader
from tests.recording import samples

ROWS, BLOCK = 400_000, 1000
"""Over six minutes at 1 kHz, and a block so short that there are many."""
WHOLE = (-math.inf, math.inf)
FILE = "runs/long.h5"
NAMES = ["force", "stroke", "stroke_2", "temperature_1"]


def long_run(folder: Path, rows: int = ROWS, shift: int = 0) -> Path:
    """A run whose time stamps go back now and then, as those of a foreign record may; with a thermometer."""
    sequence = np.arange(rows) + shift
    time = samples.time_us(np.arange(rows))
    time[5::997] -= 1500
    seconds = np.arange(rows // 1000 + 1)
    heat = StreamContent(1_000_000 * (seconds + 20), {"temperature_1": (200 + seconds).astype(np.int16)})
    anchors = [
        Anchor(int(time[0]) + 10_000_000 * n, 20.0 + 10.0 * n, "2026-03-01T08:00:00+00:00") for n in range(9)
    ]
    (folder / "runs").mkdir(exist_ok=True)
    content = {
        "controller": StreamContent(time, samples.counts(sequence), (Segment(0, 0, 0),)),
        "temperature_1": heat,
    }
    return write_run(folder / FILE, samples.metadata(status="complete"), content, (), anchors)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("long")
    long_run(folder)
    return folder


@pytest.fixture
def rows_read(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """What is asked of run files, in rows of a dataset; blocks are short meanwhile."""
    found: list[int] = []
    own = DatasetReader.column

    def column(self: DatasetReader, place: str, rows: slice = slice(None)) -> np.ndarray:
        values = own(self, place, rows)
        found.append(len(values))
        return values

    monkeypatch.setattr(DatasetReader, "column", column)
    monkeypatch.setattr(run_spans, "BLOCK_ROWS", BLOCK)
    return found


def by_hand(run: Run, found: dict, channel: str) -> list[list[float | None]]:
    """The extremes of a channel in an answer's buckets, of all of its samples at once."""
    series, width_s = run.series(channel), found["width_s"]
    numbers = np.floor(series.time_s / width_s)
    ends: list[list[float | None]] = [[], []]
    for middle in found["t"]:
        inside = series.value[numbers == math.floor(middle / width_s)]
        for end, values in zip((np.min, np.max), ends, strict=True):
            values.append(round(float(end(inside)), 4) if inside.size else None)
    return ends


def test_a_zoom_reads_the_blocks_that_it_shows_and_the_first_look_all_stamps_once(
    campaign: Path, rows_read: list[int]
) -> None:
    spans = RunSpans(campaign)
    spans.span(FILE, 300.0, 301.0, ["force"])
    assert sum(rows_read) < 1.2 * ROWS, "time stamps once, and of the force little"
    of_a_block = 2 * BLOCK  # time stamps and force
    before = 30 * 1000  # a value may have come so long before, and hold
    for from_s, to_s in ((200.0, 200.1), (0.0, 1.0), (399.0, math.inf), (100.0, 110.0)):
        rows_read.clear()
        spans.span(FILE, from_s, to_s, ["force"])
        shown = 1000 * (min(to_s, 400.0) - from_s)
        assert 0 < sum(rows_read) <= 2 * (shown + min(before, 1000 * from_s)) + 3 * of_a_block, (from_s, to_s)
    rows_read.clear()
    spans.span(FILE, 200.0, 200.1, ["force"])
    assert rows_read == [], "whoever goes back to where he was waits for nothing"


@pytest.mark.parametrize("span_s", [(200.45, 200.9), (0.0, 0.7), (123.4, 187.6), (399.5, math.inf), WHOLE])
def test_a_zoom_gives_what_reading_the_whole_run_gives(
    campaign: Path, rows_read: list[int], monkeypatch: pytest.MonkeyPatch, span_s: tuple[float, float]
) -> None:
    found = RunSpans(campaign).span(FILE, *span_s, NAMES)
    monkeypatch.setattr(run_spans, "BLOCK_ROWS", 10 * ROWS)
    rows_read.clear()
    assert RunSpans(campaign).span(FILE, *span_s, NAMES) == found
    assert sum(rows_read) > 4 * ROWS
    if span_s[0] == 200.45:  # no time stamp goes back there
        low, high = by_hand(open_run(campaign / FILE), found, "force")
        assert [found["values"]["force"][end][:-1] for end in ("low", "high")] == [low[:-1], high[:-1]]


@pytest.mark.parametrize("span_s", [WHOLE, (50.0, 350.0), (17.3, 90.1), (300.0, math.inf)])
def test_a_wide_span_is_put_together_from_cells_without_reading_again(
    campaign: Path, rows_read: list[int], monkeypatch: pytest.MonkeyPatch, span_s: tuple[float, float]
) -> None:
    monkeypatch.setattr(run_spans, "WIDE_ROWS", 20_000)
    spans = RunSpans(campaign)
    spans.span(FILE, *WHOLE, NAMES)
    assert sum(rows_read) > 4 * ROWS
    rows_read.clear()
    found = spans.span(FILE, *span_s, NAMES)
    assert rows_read == []
    lasting = min(span_s[1], found["last_s"]) - max(span_s[0], 0.0)
    assert lasting / run_spans.MOST_POINTS <= found["width_s"] < lasting / run_spans.MOST_POINTS + 0.021
    assert lasting / found["width_s"] <= len(found["t"]) <= run_spans.MOST_POINTS + 1
    run = open_run(campaign / FILE)
    low, high = by_hand(run, found, "force")
    at = found["values"]["force"]
    differing = sum(a != b for a, b in zip([*low, *high], [*at["low"], *at["high"]], strict=True))
    assert differing <= 4, "where a time stamp goes back over a bucket's edge the sample before is repeated"
    assert None not in found["values"]["temperature_1"]["high"][1:]
    rows_read.clear()
    spans.span(FILE, 200.0, 205.0, NAMES)
    assert 0 < sum(rows_read) < ROWS, "a close one is read"


def test_what_lies_behind_a_time_stamp_that_is_missing_is_shown(tmp_path: Path) -> None:
    rows = np.arange(2000)
    time_s = rows / 1000.0
    time_s[50] = np.nan
    content = StreamContent(time_s, samples.counts(rows), (Segment(0, 0, 0),))
    (tmp_path / "runs").mkdir()
    run = open_run(write_run(tmp_path / FILE, samples.metadata(status="imported"), {"controller": content}))
    found = RunSpans(tmp_path).span(FILE, 1.0, 1.5, ["force"])
    assert found["last_s"] == pytest.approx(1.999)
    low, _ = by_hand(run, found, "force")
    assert found["values"]["force"]["low"][:-1] == low[:-1]
    assert None not in low


def test_a_file_that_is_another_one_is_opened_anew(tmp_path: Path) -> None:
    long_run(tmp_path, 5000)
    spans = RunSpans(tmp_path)
    before = spans.span(FILE, *WHOLE, ["force"])
    long_run(tmp_path, 6000, shift=77)
    after = spans.span(FILE, *WHOLE, ["force"])
    assert (before["last_s"], after["last_s"]) == (pytest.approx(4.999), pytest.approx(5.999))
    assert after == RunSpans(tmp_path).span(FILE, *WHOLE, ["force"])


def test_runs_and_answers_that_are_kept_are_few(campaign: Path, tmp_path: Path) -> None:
    made = long_run(tmp_path, 2000)
    for number in range(7):
        made.with_name(f"{number}.h5").write_bytes(made.read_bytes())
    spans = RunSpans(tmp_path)
    for number in range(7):
        for end_s in range(1, 20):
            spans.span(f"runs/{number}.h5", 0.0, end_s / 10.0, ["force"])
    assert len(spans._opened) == run_spans.MOST_OPEN
    assert all(len(one._answers) == run_spans.MOST_ANSWERS for one in spans._opened.values())


def test_blocks_behind_others_that_are_not_read_remember_the_falling_branch(tmp_path: Path) -> None:
    metadata = samples.metadata(status="complete")
    calibration = Calibration(coefficients=(0.0, 0.01), falling=(0.3, 0.01), turn_counts=5e9)
    metadata["streams"]["controller"]["channels"][0]["calibration"] = calibration.model_dump(mode="json")
    rows = np.arange(3000)
    content = StreamContent(samples.time_us(rows), samples.counts(rows), (Segment(0, 0, 0),))
    run = open_run(write_run(tmp_path / "r.h5", metadata, {"controller": content}))
    every = list(run.blocks(["force", "stroke_1"], 700))
    for only in ([3], [0, 2], [], [4]):
        some = list(run.blocks(["force", "stroke_1"], 700, only))
        assert len(some) == len(only)
        for number, block in zip(only, some, strict=True):
            for name, series in block.items():
                np.testing.assert_array_equal(series.value, every[number][name].value)
                np.testing.assert_array_equal(series.time_s, every[number][name].time_s)
