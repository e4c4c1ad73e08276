"""Which rows of a table are readings: blanks of a slower channel, doubled rows, shared stamps, rates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.recording.foreign.times.instants import (
    doubled_rows,
    has_own_instants,
    shared_stamps,
    spread_stamps,
)
from bufferstand.recording.foreign.times.stamps import examine

from .attempts import read

TIME_S = np.arange(4000) / 1000.0
WAVE = 30.0 - 20.0 * np.cos(2.0 * np.pi * TIME_S)
ROW = np.arange(TIME_S.size) + 2


def filled(**at: slice) -> np.ndarray:
    rows = np.zeros(TIME_S.size, dtype=bool)
    for part in at.values():
        rows[part] = True
    return rows


@given(st.integers(2, 500), st.integers(0, 400))
def test_every_nth_row_is_a_slower_channel(every: int, first: int) -> None:
    assert has_own_instants(TIME_S, filled(own=slice(first, None, every)))


def test_rows_of_two_channels_in_turn_are_both_their_own() -> None:
    """Force at 1000 Hz and stroke at 300 Hz, in one table by their stamps: neither has a hole."""
    fast, slow = np.arange(4000) / 1000.0, 0.00037 + np.arange(1200) / 300.0
    time_s = np.concatenate((fast, slow))
    order = np.argsort(time_s)
    is_fast = np.arange(time_s.size)[order] < fast.size
    assert has_own_instants(time_s[order], is_fast)
    assert has_own_instants(time_s[order], ~is_fast)


def test_a_hole_in_a_slower_channel_leaves_it_one() -> None:
    assert has_own_instants(TIME_S, filled(a=slice(0, 1000, 5), b=slice(2000, None, 5)))


@given(st.floats(0.005, 0.4), st.integers(0, 99))
def test_readings_that_are_missing_here_and_there_are_no_slower_channel(share: float, seed: int) -> None:
    kept = np.random.default_rng(seed).random(TIME_S.size) > share
    assert not has_own_instants(TIME_S, kept)


@pytest.mark.parametrize("part", [slice(0, 1000), slice(3000, None), slice(1000, 1004), slice(0, 0)])
def test_a_channel_that_ends_early_or_begins_late_is_no_slower_one(part: slice) -> None:
    assert not has_own_instants(TIME_S, filled(own=part))


def test_doubled_rows_are_those_that_say_the_same() -> None:
    time_s = np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, np.nan, np.nan])
    force = np.array([5.0, 5.0, 6.0, 7.0, np.nan, np.nan, np.nan, 1.0, 1.0])
    assert np.flatnonzero(doubled_rows(time_s, [force])).tolist() == [1, 5, 6]


@given(st.sampled_from([np.floor, np.round]), st.sampled_from([0.01, 1.0 / 64.0, 0.1]), st.floats(0.0, 0.02))
def test_instants_behind_a_coarse_clock_are_found(rounding: np.ufunc, clock_s: float, first_s: float) -> None:
    """Even rows: their spacing comes back to a thousandth, and their instants up to the clock's step."""
    truth_s = first_s + TIME_S
    stamps_s = rounding(truth_s / clock_s + 1e-9) * clock_s
    found = shared_stamps(stamps_s)
    assert found is not None
    assert found[0] == pytest.approx(clock_s)
    instants_s = spread_stamps(stamps_s)
    assert np.max(np.abs(instants_s - truth_s)) <= clock_s
    assert np.max(np.abs(np.diff(instants_s) * 1000.0 - 1.0)) < 0.01


def test_a_gap_stays_where_a_coarse_clock_shows_it() -> None:
    kept = np.delete(np.arange(TIME_S.size), slice(1500, 2500))
    instants_s = spread_stamps(np.floor(TIME_S[kept] * 100.0 + 1e-9) / 100.0)
    assert np.flatnonzero(np.diff(instants_s) > 0.5).tolist() == [1499]


@pytest.mark.parametrize("changed", [[7, 8], [-3], []])
def test_stamps_that_are_repeated_now_and_then_are_no_coarse_clock(changed: list[int]) -> None:
    stamps_s = TIME_S.copy()
    stamps_s[changed] = stamps_s[6]
    assert shared_stamps(stamps_s) is None


# --- what an import says ------------------------------------------------------------------------------


def test_a_logger_that_changes_its_rate_has_lost_nothing() -> None:
    rest_s = 4.0 + np.arange(100) / 10.0
    time_s = np.concatenate((TIME_S, rest_s, 14.0 + TIME_S))
    found = examine(time_s, np.arange(time_s.size) + 2)
    assert len(found.segments) == 1
    (finding,) = found.findings
    rates = "1000 Hz, 10 Hz from line 4002 on, 1000 Hz from line 4102 on"
    assert finding == f"the sample rate changes: {rates}; nothing is missing there"


@pytest.mark.parametrize("at", [2000, 4050, 6000])
def test_a_gap_beside_a_change_of_the_rate_is_still_one(at: int) -> None:
    """A hole of 5 usual steps, in the fast stretch as in the slow one."""
    time_s = np.concatenate((TIME_S, 4.0 + np.arange(100) / 10.0, 14.0 + TIME_S))
    step_s = time_s[at + 1] - time_s[at]
    time_s[at + 1 :] += 5.0 * step_s
    found = examine(time_s, np.arange(time_s.size) + 2)
    assert [segment.first_row for segment in found.segments] == [0, at + 1]
    assert found.segments[1].lost == 5


def by_event(threshold_mm: float) -> np.ndarray:
    kept = [0]
    for row in range(1, TIME_S.size):
        if abs(WAVE[row] - WAVE[kept[-1]]) > threshold_mm:
            kept.append(row)
    return np.array(kept)


@pytest.mark.parametrize("threshold_mm", [0.1, 0.5])
def test_rows_that_are_written_on_change_have_lost_nothing(threshold_mm: float) -> None:
    kept = by_event(threshold_mm)
    found = examine(TIME_S[kept], ROW[kept], values=[WAVE[kept]])
    assert len(found.segments) == 1
    assert "written when something changed" in found.findings[0]


def test_rows_that_are_written_on_change_and_lost_in_motion_are_a_gap() -> None:
    kept = by_event(0.1)
    moving = np.flatnonzero(np.abs(WAVE[kept] - 30.0) < 5.0)[:40]
    left = np.delete(kept, moving[5:35])
    found = examine(TIME_S[left], ROW[left], values=[WAVE[left]])
    assert len(found.segments) > 1


def test_an_even_record_that_loses_rows_at_rest_is_not_said_to_be_written_on_change() -> None:
    kept = np.flatnonzero(np.random.default_rng(3).random(TIME_S.size) > 0.1)
    still = np.abs(WAVE - 30.0) > 19.5
    kept = np.flatnonzero(np.isin(np.arange(TIME_S.size), kept) | ~still)
    found = examine(TIME_S[kept], ROW[kept], values=[WAVE[kept]])
    assert "gap(s)" in found.findings[0]


def written(path: Path, *columns: np.ndarray, separator: str = ",", decimal: str = ".") -> Path:
    """Write a table of time, stroke, force (and temperature), blank where a column holds no number."""
    heads = ("time [s]", "stroke [mm]", "force [kN]", "temperature [°C]")[: len(columns)]
    rows = [
        separator.join("" if np.isnan(v) else f"{v:.6f}".replace(".", decimal) for v in row)
        for row in zip(*columns, strict=True)
    ]
    path.write_text("\n".join([separator.join(heads), *rows, ""]), encoding="utf-8")
    return path


def every(values: np.ndarray, rows: int) -> np.ndarray:
    return np.where(np.arange(values.size) % rows == 0, values, np.nan)


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ",")])
def test_a_slower_channel_of_a_table_keeps_its_own_instants(
    tmp_path: Path, separator: str, decimal: str
) -> None:
    columns = TIME_S, every(WAVE, 5), 2.0 * WAVE, every(25.0 + TIME_S, 1000)
    run, warnings = read(written(tmp_path / "r.csv", *columns, separator=separator, decimal=decimal))
    assert [list(stream.channels) for stream in run.streams.values()] == [
        ["stroke_1"],
        ["force"],
        ["temperature_1"],
    ]
    np.testing.assert_allclose(run.series("stroke").time_s, TIME_S[::5], atol=1e-9)
    np.testing.assert_allclose(run.series("stroke").value, WAVE[::5], atol=1e-6)
    assert run.series("force").time_s.size == TIME_S.size
    assert run.gaps("record") == run.gaps("record_2") == run.gaps("record_3") == []
    assert warnings == (
        "record: stroke_1: read in 800 of 4000 lines, 200 Hz; the blanks between are no missing readings",
        "record_3: temperature_1: read in 4 of 4000 lines, 1 Hz; the blanks between are no missing readings",
        "each at its own instants: stroke_1 at 200 Hz, force at 1000 Hz",
    )


def test_doubled_rows_are_said_and_no_interruptions(tmp_path: Path) -> None:
    rows = np.sort(np.concatenate((np.arange(TIME_S.size), np.arange(10, TIME_S.size, 100))))
    run, warnings = read(written(tmp_path / "r.csv", TIME_S[rows], WAVE[rows], WAVE[rows]))
    assert run.series("force").time_s.size == rows.size  # kept as they are
    assert run.gaps("record") == []
    assert warnings == (
        "40 doubled row(s) (stamp and values of the row before), which count once, the first in line 13",
    )


def test_rows_that_share_the_stamps_of_a_coarse_clock_are_said(tmp_path: Path) -> None:
    stamps_s = np.floor(TIME_S * 100.0 + 1e-9) / 100.0
    run, warnings = read(written(tmp_path / "r.csv", stamps_s, WAVE, WAVE))
    np.testing.assert_allclose(run.series("force").time_s, stamps_s)  # kept as they are
    assert run.gaps("record") == []
    assert run.streams["record"].rows == TIME_S.size
    (warning,) = warnings
    rounded = "time stamps rounded to 0.01 s: about 10 rows share each"
    assert warning == f"{rounded}, and their instants are taken as even in between"
