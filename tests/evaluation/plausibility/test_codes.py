"""Codes in the place of readings leave the record; they are no extremes, and cost no cycle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bufferstand.evaluation.plausibility.invalid_samples.error_codes import without_codes
from bufferstand.evaluation.plausibility.run_view.channels import Channels
from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.plausibility.records import Change, Floats, of_kind, static


def coded(column: int, rows: list[int], code: float) -> Change:
    def change(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = (c.copy() for c in columns)
        (time_s, stroke, force)[column][rows] = code
        return time_s, stroke, force

    return change


@pytest.mark.parametrize(
    "code",
    [
        9.91e37,
        *(pytest.param(code, marks=pytest.mark.long) for code in (-9.9e37, 1e9, -9999.0, 99999.9)),
        9999.0,
    ],
)
@pytest.mark.parametrize("rows", [[1500], [1500, 1501, 1502, 1503], [0, 700, 2900]])
@pytest.mark.parametrize("column", [1, 2])
def test_codes_are_no_readings(column: int, rows: list[int], code: float) -> None:
    good, run = static(), static(coded(column, rows, code))
    (finding,) = of_kind(run, "spike")
    assert finding.channel == ("stroke" if column == 1 else "force")
    assert (finding.start_s, finding.end_s, finding.effect) == (rows[0] / 100.0, rows[-1] / 100.0, "noted")
    assert f"{code:.6g}" in finding.text
    assert len(run.cycles) == len(good.cycles)
    assert run.verdict == "pass"
    for name in ("force_max_kN", "stroke_max_mm", "force_min_kN", "stroke_min_mm"):
        assert run.extremes[name].value == good.extremes[name].value
        assert not run.extremes[name].doubt


def test_what_a_spline_makes_beside_a_code_is_no_force() -> None:
    """A force that is 0.3 ms late is brought to the stroke's instants by a spline, which rings far."""
    stamps_s, moments_s = np.arange(4000) / 1000.0, np.arange(4000) / 1000.0 + 0.0003
    force = 100.0 - 50.0 * np.cos(stamps_s)
    force[[1500, 1501, 2600]] = 9.91e37
    stroke = 20.0 * np.sin(stamps_s)
    made = make_record(stamps_s, stroke, CubicSpline(moments_s, force)(stamps_s))
    left, (coded,) = without_codes(Channels(replace(made, as_recorded={"force": (moments_s, force)})))
    assert coded.time_s.size == 3
    true = 100.0 - 50.0 * np.cos(left.record.time_s - 0.0003)
    assert left.record.force_kN == pytest.approx(true, abs=1e-3)


def test_large_values_are_no_codes() -> None:
    """A force in N that is called kN: wrong, but readings."""
    time = np.arange(2000) / 100.0
    force = 600_000.0 * np.sin(time) ** 2
    assert not Samples("force", time, force).codes.size
    assert not Samples("force", time, 2.0 * force).codes.size
