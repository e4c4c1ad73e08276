"""Codes in the place of readings leave the record; they are no extremes, and cost no cycle."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.plausibility.samples import Samples
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


def test_large_values_are_no_codes() -> None:
    """A force in N that is called kN: wrong, but readings."""
    time = np.arange(2000) / 100.0
    force = 600_000.0 * np.sin(time) ** 2
    assert not Samples("force", time, force).codes.size
    assert not Samples("force", time, 2.0 * force).codes.size
