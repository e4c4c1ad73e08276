"""Bounds of a campaign's numbers, as they were agreed: a table written by hand, beside the code."""

from __future__ import annotations

import math
from typing import Any, get_args

import annotated_types as at
import pytest

from bufferstand.foundation.settings import Within
from bufferstand.protocols import bounded_numbers
from bufferstand.protocols.bounded_numbers import POWER_ON_C, bounds_of

BOUNDS: dict[str, tuple[type, float | None, float, float]] = {
    # type, greater than (None: or equal, or without a sign), bounds of a file
    "Force": (float, 0, 0.5, 10_000.0),
    "Stroke": (float, 0, 0.01, 1000.0),
    "StrokeFromZero": (float, None, 0.0, 1000.0),
    "Speed": (float, 0, 0.001, 5000.0),
    "Frequency": (float, 0, 0.0001, 100.0),
    "Duration": (float, 0, 0.01, 604_800.0),
    "Pause": (float, None, 0.0, 604_800.0),
    "Timeout": (float, 0, 0.1, 604_800.0),
    "Temperature": (float, None, -40.0, 85.0),
    "Cycles": (int, 0, 1, 100_000),
    "Percent": (float, 0, 0.001, 100.0),
    "Air": (float, None, -40.0, 60.0),
}


def limits(kind: Any) -> tuple[type, float | None, float | None, Within]:
    """Return the type of a number, its open and its closed lower limit, and its bounds in a file."""
    own, *said = get_args(kind)
    stated = [one for field in said for one in getattr(field, "metadata", [])]
    above = next((one.gt for one in stated if isinstance(one, at.Gt)), None)
    least = next((one.ge for one in stated if isinstance(one, at.Ge)), None)
    return own, above, least, next(one for one in said if isinstance(one, Within))


def test_every_kind_of_number_is_in_the_table() -> None:
    kinds = {
        name
        for name, one in vars(bounded_numbers).items()
        if any(isinstance(part, Within) for part in get_args(one))
    }
    assert kinds == BOUNDS.keys()


@pytest.mark.parametrize("name", BOUNDS)
def test_a_number_of_a_campaign_has_the_bounds_agreed(name: str) -> None:
    kind, above, low, high = BOUNDS[name]
    own, gt, ge, within = limits(getattr(bounded_numbers, name))
    assert (own, gt) == (kind, above)
    assert ge == (0 if name in ("StrokeFromZero", "Pause") else None)
    assert (within.low, within.high) == (low, high)
    assert within.why
    assert math.isfinite(within.low)


def test_a_stop_above_what_a_sensor_without_supply_shows_cannot_be_written() -> None:
    assert POWER_ON_C == 85.0
    assert bounds_of(bounded_numbers.Temperature).high == POWER_ON_C
    assert "85 °C" in bounds_of(bounded_numbers.Temperature).why


def test_the_bounds_of_a_kind_are_found_among_what_else_is_said_of_it() -> None:
    assert bounds_of(bounded_numbers.Cycles) == limits(bounded_numbers.Cycles)[3]
