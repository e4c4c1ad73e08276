"""Defects of a record are found, named, and cut out."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.record.defects import describe
from bufferstand.evaluation.record.record import make_record
from bufferstand.foundation.errors import BadInput

TIME = np.arange(100) * 0.01
STROKE = np.sin(TIME)


def test_clean_record_is_left_alone() -> None:
    record = make_record(TIME, STROKE, 2.0 * STROKE)
    assert record.breaks == ()
    assert record.defects == ()
    np.testing.assert_array_equal(record.stroke_mm, STROKE)


def test_gap_is_a_break() -> None:
    keep = np.r_[0:40, 43:100]
    record = make_record(TIME[keep], STROKE[keep], STROKE[keep])
    assert record.breaks == (40,)
    (defect,) = record.defects
    assert defect.kind == "gap"
    assert defect.text == "gap of 0.04 s after 0.39 s"


def test_one_missing_sample_is_a_gap() -> None:
    keep = np.delete(np.arange(100), 50)
    assert make_record(TIME[keep], STROKE[keep], STROKE[keep]).breaks == (50,)


def test_uneven_sampling_is_no_gap() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.015, 400))
    assert make_record(time, np.sin(time), np.sin(time)).breaks == ()


def test_repeated_stamp() -> None:
    time = TIME.copy()
    time[30] = time[29]
    record = make_record(time, STROKE, STROKE)
    assert [d.kind for d in record.defects] == ["repeated-time"]
    assert record.breaks == (30,)
    assert record.time_s.size == 99


def test_backward_stamps_count_once() -> None:
    time = TIME.copy()
    time[60:65] -= 0.3
    record = make_record(time, STROKE, STROKE)
    assert [d.kind for d in record.defects] == ["backward-time"]
    assert "in 5 samples" in record.defects[0].text
    assert np.all(np.diff(record.time_s) > 0.0)


@pytest.mark.parametrize("column", [0, 1, 2])
def test_nan_in_any_column(column: int) -> None:
    columns = [TIME.copy(), STROKE.copy(), STROKE.copy()]
    columns[column][[10, 11, 70]] = np.nan
    record = make_record(*columns)
    assert [d.kind for d in record.defects] == ["nan", "nan"]
    assert record.breaks == (10, 68)
    assert np.all(np.isfinite(record.force_kN))


def test_nan_at_the_ends_breaks_nothing() -> None:
    force = STROKE.copy()
    force[[0, -1]] = np.nan
    record = make_record(TIME, STROKE, force)
    assert record.breaks == ()
    assert len(record.defects) == 2


def test_counted_loss_is_not_also_a_gap() -> None:
    keep = np.r_[0:40, 50:100]
    record = make_record(TIME[keep], STROKE[keep], STROKE[keep], lost_before=[(40, 10)])
    assert [d.text for d in record.defects] == ["10 samples lost after 0.39 s"]
    assert record.breaks == (40,)


def test_interruption_of_unknown_size() -> None:
    record = make_record(TIME, STROKE, STROKE, lost_before=[(40, 0)])
    assert [d.text for d in record.defects] == ["interruption after 0.39 s"]
    keep = np.r_[0:40, 50:100]
    record = make_record(TIME[keep], STROKE[keep], STROKE[keep], lost_before=[(40, 0)])
    assert [d.text for d in record.defects] == ["gap of 0.11 s after 0.39 s"]


def test_has_break() -> None:
    record = make_record(TIME[np.r_[0:40, 50:100]], np.zeros(90), np.zeros(90))
    assert record.has_break(39, 40)
    assert not record.has_break(40, 80)
    assert not record.has_break(0, 39)


def test_lengths_must_agree() -> None:
    with pytest.raises(BadInput, match="force_kN has 99 samples, time has 100"):
        make_record(TIME, STROKE, STROKE[:-1])


def test_nothing_usable_is_refused() -> None:
    with pytest.raises(BadInput, match="fewer than two usable samples"):
        make_record(TIME, STROKE * np.nan, STROKE)


def test_descriptions_are_short() -> None:
    time = TIME.copy()
    force = STROKE.copy()
    force[::10] = np.nan
    record = make_record(time, STROKE, force)
    assert describe(record.defects, 2).endswith("and 8 more")
