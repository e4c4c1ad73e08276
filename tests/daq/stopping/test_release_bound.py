"""When a release has let go, millimetre by millimetre: by where the piston is, and by the force."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import pytest

from bufferstand.daq.motions import release_bound
from bufferstand.daq.motions.release_bound import ReleaseBound, contact_of
from bufferstand.foundation.channels import Zero
from bufferstand.foundation.channels.zero import ChannelZero


def test_the_figures_below_hold_for_these() -> None:
    here = release_bound
    assert (here.GROWN_MM, here.UNTOUCHED_MM, here.FALLS_MM, here.SPECIMEN_MM) == (5.0, 10.0, 15.0, 110.0)
    assert (here.STAYS_KN, here.STAYS_SHARE, here.OVER_MM) == (1.0, 0.05, 4.0)


def went(bound: ReleaseBound, *seen: tuple[float, float]) -> list[bool]:
    return [bool(bound.look(at_mm, force_kN, 0.0)) for at_mm, force_kN in seen]


def test_a_force_that_stays_has_let_go_as_soon_as_nothing_touches() -> None:
    bound = ReleaseBound(50.0, 1.5)  # the end lies at −5, whatever is behind contact
    assert went(bound, (0.0, 3.0), (-4.0, 3.0), (-5.0, 3.0), (-5.001, 3.0)) == [False, False, False, True]
    early = ReleaseBound(50.0, -4.0)
    assert went(early, (-4.0, 3.0), (-9.0, 3.0), (-9.001, 3.0)) == [False, False, True]
    untouched = ReleaseBound(50.0, None)
    assert went(untouched, (-5.0, 3.0), (-10.0, 3.0), (-10.001, 3.0)) == [False, False, True]


def test_how_far_back_and_from_where_is_said() -> None:
    bound = ReleaseBound(50.0, 1.5)
    bound.look(0.0, 3.0, 2.0)
    assert bound.look(-6.0, 3.0, -2.5) == (
        "the force reads +3.0 kN (the controller's own reading: -2.5 kN) though the stand has let go: the "
        "piston is 7.5 mm back from first contact; no load is read there, look at zero, scale and wire of "
        "channel force"
    )
    untouched = ReleaseBound(50.0, None)
    untouched.look(0.0, 3.0, 2.0)
    assert "12.0 mm back from its own zero (no contact was touched off);" in untouched.look(-12.0, 3.0, 3.0)


@pytest.mark.parametrize(
    ("before_kN", "now_kN", "stays"),
    [
        (3.0, 4.125, True),
        (3.0, 4.16, False),
        (3.0, 1.875, True),
        (3.0, 1.84, False),
        (-40.0, -43.0, True),
        (-40.0, -43.1, False),
        (math.nan, 3.0, True),
        (3.0, math.nan, True),
    ],
)
def test_a_force_may_change_by_a_kilonewton_and_a_twentieth(
    before_kN: float, now_kN: float, stays: bool
) -> None:
    bound = ReleaseBound(50.0, 0.0)
    assert went(bound, (-2.0, before_kN), (-6.0, now_kN)) == [False, stays]


def test_the_force_is_compared_over_four_millimetres_and_no_less() -> None:
    assert went(ReleaseBound(50.0, 0.0), (-2.0, 3.0), (-5.999, 3.0)) == [False, False]
    assert went(ReleaseBound(50.0, 0.0), (-2.0, 3.0), (-6.0, 3.0)) == [False, True]
    rising = ReleaseBound(50.0, 0.0)
    assert went(rising, (10.0, 90.0), (-1.0, 3.0), (-5.0, 3.0), (-5.5, 3.0)) == [False, False, False, True]
    kept = ReleaseBound(50.0, 0.0)
    assert went(kept, (2.0, 90.0), (-2.0, 90.0), (-3.0, 3.0), (-6.5, 3.0)) == [False, False, False, False]
    assert went(kept, (-7.0, 3.0)) == [True], "since −3 it stays"


@pytest.mark.parametrize(
    ("began_mm", "contact_mm", "last_mm"),
    [(50.0, 0.0, -20.0), (-10.0, 0.0, -25.0), (-4.9, 0.0, -20.0), (50.0, None, -60.0), (100.0, None, -25.0)],
)
def test_a_force_that_changes_is_believed_for_some_way_more(
    began_mm: float, contact_mm: float | None, last_mm: float
) -> None:
    bound = ReleaseBound(began_mm, contact_mm)
    assert went(bound, (last_mm + 8.0, 500.0), (last_mm + 4.0, 400.0), (last_mm, 300.0)) == [
        False,
        False,
        False,
    ]
    assert went(bound, (last_mm - 0.001, 200.0)) == [True]


@pytest.mark.parametrize("position_mm", [math.nan, math.inf, -math.inf])
def test_a_position_that_is_no_number_is_not_looked_at(position_mm: float) -> None:
    bound = ReleaseBound(50.0, 0.0)
    assert went(bound, (position_mm, 3.0), (-6.0, 3.0), (position_mm, 3.0)) == [False, False, False]
    assert went(bound, (-10.0, 3.0)) == [True]


def zero(how: str, *names: str) -> Zero:
    channels = tuple(ChannelZero(name=name, unit="mm", value=1.25, u=0.05) for name in names)
    return Zero.model_construct(how=how, found=datetime.now(UTC), channel=channels)


def test_contact_is_known_only_where_it_was_touched_off() -> None:
    assert contact_of(None) is None
    assert contact_of(zero("touch", "stroke_1", "position")) == 1.25
    assert contact_of(zero("tare", "stroke_1", "position")) is None
    assert contact_of(zero("touch", "stroke_1")) is None
