"""Bounds of a stand file's numbers, as they were agreed: a table written by hand, beside the code."""

from __future__ import annotations

from typing import get_args

import annotated_types as at
import pytest

from bufferstand.drivers.instruments import bounded_numbers
from bufferstand.foundation.settings import Within

BOUNDS: dict[str, tuple[type, str, float | None, float, float]] = {
    # type, what it may not fall below in any use, what it may not exceed in any use, bounds of a file
    "Baud": (int, "> 0", 4_000_000, 300, 4_000_000),
    "MovingMass": (float, ">= 0", None, 0.0, 10_000.0),
    "MassAccuracy": (float, ">= 0", None, 0.0, 100.0),
    "StandForce": (float, "> 0", None, 1.0, 10_000.0),
    "Travel": (float, "> 0", None, 1.0, 1000.0),
    "StandFrequency": (float, "> 0", None, 0.01, 100.0),
    "StandSpeed": (float, "> 0", None, 1.0, 5000.0),
    "Stiffness": (float, "> 0", None, 1.0, 100_000.0),
    "Watchdog": (float, "> 0", 65.535, 0.1, 10.0),
    "ReplyTime": (float, "> 0", 10, 0.005, 5.0),
    "SampleRate": (float, "> 0", None, 0.1, 100_000.0),
    "CellRange": (float, "> 0", None, 1.0, 20_000.0),
    "SensorDelay": (float, "", None, -1.0, 60.0),
    "SensorPeriod": (float, "> 0", None, 0.01, 10.0),
}


@pytest.mark.parametrize("name", BOUNDS)
def test_a_number_of_a_stand_has_the_bounds_agreed(name: str) -> None:
    own, *said = get_args(getattr(bounded_numbers, name))
    stated = [one for field in said for one in getattr(field, "metadata", [])]
    least = [f"> {one.gt}" for one in stated if isinstance(one, at.Gt)]
    least += [f">= {one.ge}" for one in stated if isinstance(one, at.Ge)]
    most = [one.le for one in stated if isinstance(one, at.Le)]
    within = next(one for one in said if isinstance(one, Within))
    kind, lower, upper, low, high = BOUNDS[name]
    assert own is kind
    assert "".join(least) == lower
    assert most == ([] if upper is None else [upper])
    assert (within.low, within.high) == (low, high)
    assert within.why


def test_no_number_is_missing_from_the_table() -> None:
    kinds = {
        name
        for name, one in vars(bounded_numbers).items()
        if any(isinstance(part, Within) for part in get_args(one))
    }
    assert kinds == BOUNDS.keys()
