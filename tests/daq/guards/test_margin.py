"""What the monitor is told of a guard: shares that are numbers, and the extremes of the last seconds."""

from __future__ import annotations

import math

import pytest

from bufferstand.daq.guards.margin import SHOWN_S, Margin, Peaks
from bufferstand.daq.guards.trips import Action


@pytest.mark.parametrize(("share", "shown"), [(0.25, 0.25), (None, None), (math.inf, None), (math.nan, None)])
def test_a_share_that_is_no_number_is_not_sent(share: float | None, shown: float | None) -> None:
    assert Margin("force", "Force", "1 of 4 kN", share, Action.STOP).as_dict() == {
        "name": "force",
        "label": "Force",
        "text": "1 of 4 kN",
        "share": shown,
        "action": "stop",
    }


def test_nothing_seen_has_no_span() -> None:
    assert Peaks().span() is None
    assert Peaks().seconds == ()


def test_within_a_second_the_extremes_grow_and_never_shrink() -> None:
    peaks = Peaks().seen(0.0, 1.0, 9.0).seen(7.1, 2.0, 5.0)
    assert peaks.seconds == ((0, 1.0, 9.0), (7, 2.0, 5.0))
    for low, high in ((2.0, 5.0), (3.0, 4.0), (2.0, 4.0), (3.0, 5.0)):
        assert peaks.seen(7.9, low, high) is peaks, "nothing new"
    assert peaks.seen(7.9, 1.5, 4.0).seconds == ((0, 1.0, 9.0), (7, 1.5, 5.0))
    assert peaks.seen(7.9, 3.0, 6.0).seconds == ((0, 1.0, 9.0), (7, 2.0, 6.0))
    assert peaks.seen(7.9, -1.0, 6.0).seconds == ((0, 1.0, 9.0), (7, -1.0, 6.0))
    three = peaks.seen(8.0, 0.0, 0.5)
    assert three.seconds == ((0, 1.0, 9.0), (7, 2.0, 5.0), (8, 0.0, 0.5))
    assert three.seen(8.2, 0.0, 0.7).seconds == ((0, 1.0, 9.0), (7, 2.0, 5.0), (8, 0.0, 0.7))
    assert three.span() == (0.0, 9.0)


def test_ten_seconds_count_and_what_is_older_is_forgotten() -> None:
    assert SHOWN_S == 10
    peaks = Peaks()
    for second in range(12):
        peaks = peaks.seen(second + 0.5, -second, second)
    assert [one[0] for one in peaks.seconds] == list(range(2, 12))
    assert peaks.span() == (-11, 11)
    assert peaks.seen(20.9, 0.0, 0.0).seconds == ((11, -11, 11), (20, 0.0, 0.0))
    assert peaks.seen(21.0, 0.0, 0.0).seconds == ((21, 0.0, 0.0),)


def test_a_clock_that_was_set_back_keeps_no_second_to_come() -> None:
    assert Peaks().seen(50.0, 1.0, 2.0).seen(49.0, 3.0, 4.0).seconds == ((49, 3.0, 4.0),)
    assert Peaks().seen(49.0, 1.0, 2.0).seen(50.0, 0.0, 0.5).seconds == ((49, 1.0, 2.0), (50, 0.0, 0.5))
