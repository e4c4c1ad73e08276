"""The history of a campaign: every extreme is kept, whatever is asked for, in a store that does not grow."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.daq.monitor.past.answers import MOST_POINTS
from bufferstand.daq.monitor.past.history import BUCKETS, LEVELS, MOST_CHANNELS, History

CHANNELS = [{"name": "stroke", "unit": "mm"}, {"name": "force", "unit": "kN"}]


def filled(samples: list[tuple[float, float]]) -> History:
    history = History()
    history.name(CHANNELS)
    for at_s, value in samples:
        history.add(at_s, {"stroke": [value - 1.0, value + 1.0]})
    return history


@given(st.lists(st.tuples(st.floats(0.0, 1e5), st.floats(-1e3, 1e3)), min_size=1, max_size=200).map(sorted))
@settings(max_examples=60, deadline=None)
def test_the_whole_span_has_the_extremes_of_all_that_came(samples: list[tuple[float, float]]) -> None:
    found = filled(samples).span(-math.inf, math.inf, ["stroke"])
    json.dumps(found, allow_nan=False)
    low = [one for one in found["values"]["stroke"]["low"] if one is not None]
    high = [one for one in found["values"]["stroke"]["high"] if one is not None]
    assert min(low) == pytest.approx(min(v for _, v in samples) - 1.0, abs=1e-4)
    assert max(high) == pytest.approx(max(v for _, v in samples) + 1.0, abs=1e-4)
    assert len(found["t"]) <= MOST_POINTS
    assert found["t"] == sorted(found["t"])


@pytest.mark.slow
def test_hours_take_no_more_room_than_the_first_minutes_and_one_spike_is_still_seen() -> None:
    """Twelve hours of packets as they come (20 a second), forty channels: nothing grows."""
    history = History()
    names = [f"channel_{number}" for number in range(MOST_CHANNELS + 5)]
    history.name([{"name": name, "unit": "V"} for name in names])
    sizes = set()
    spike_s = 3600.0 * 3
    for packet in range(12 * 3600):  # every twentieth of what comes, at its place in time
        at_s = float(packet)
        top = 99.0 if abs(at_s - spike_s) < 0.5 else 1.0
        history.add(at_s, {names[packet % len(names)]: [0.0, 0.5], names[0]: [-1.0, top]})
        if packet % 10_000 == 5_000:
            sizes.add(history.bytes)
    assert max(sizes) == history.bytes == LEVELS * BUCKETS * 8 * (1 + 2 * MOST_CHANNELS)
    whole = history.span(-math.inf, math.inf, [names[0]])
    assert max(whole["values"][names[0]]["high"]) == 99.0
    assert len(whole["t"]) <= MOST_POINTS
    near = history.span(3600.0 * 3 - 20.0, 3600.0 * 3 + 20.0, [names[0]])
    at = near["values"][names[0]]["high"].index(99.0)
    assert abs(near["t"][at] - spike_s) <= near["width_s"]
    assert near["width_s"] < whole["width_s"], "what is looked at more closely is shown more finely"


def test_the_last_minutes_are_there_as_finely_as_they_came() -> None:
    history = filled([(number * 0.1 + 0.05, float(number)) for number in range(6000)])
    found = history.span(590.0, 595.0, ["stroke", "force", "no such"])
    assert found["width_s"] == pytest.approx(0.1)
    assert list(found["values"]) == ["stroke", "force"]
    assert set(found["values"]["force"]["low"]) == {None}, "known, and nothing was read"
    assert len(found["t"]) == pytest.approx(50, abs=2)


def test_another_start_begins_anew_and_a_late_packet_does_not() -> None:
    history = filled([(100.0, 5.0), (99.5, 9.0), (101.0, 5.0)])
    assert history.span(-math.inf, math.inf, ["stroke"])["values"]["stroke"]["high"][0] == 10.0
    history.add(2.0, {"stroke": [1.0, 1.0]})
    found = history.span(-math.inf, math.inf, ["stroke"])
    assert (found["first_s"], found["last_s"]) == (2.0, 2.0)


def test_without_anything_it_says_so() -> None:
    history = History()
    history.add(1.0, {"stroke": [None, None]})
    assert history.span(-math.inf, math.inf, ["stroke"])["first_s"] is None
