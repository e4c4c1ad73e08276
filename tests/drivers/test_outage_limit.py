"""How long a wire may be out: worked out by hand from watchdog, silence, ring and the time of a reply."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from bufferstand.drivers.controllers.outage_limit import RESERVE_S, OutageLimit, leeway_of
from bufferstand.drivers.delivery_rate import FEED_S
from bufferstand.drivers.modbus import HURRY_S, LONGER


def test_the_figures_below_hold_for_these() -> None:
    assert (RESERVE_S, FEED_S, HURRY_S, LONGER) == (0.2, 0.25, 0.1, 1.25)


@pytest.mark.parametrize(
    ("limit", "timeout_s", "longest_s"),
    [
        (OutageLimit(2.0, math.inf, True), 0.5, 1.55 - (0.1 + 0.25 * 0.55)),
        (OutageLimit(2.0, math.inf, True), 0.1, 1.55 - 0.1),  # no wait is longer than the longest one
        (OutageLimit(2.0, 1.0, True), 0.2, 0.8 - (0.1 + 0.25 * 0.4)),  # the guards lose patience first
        (OutageLimit(2.0, math.inf, False), 0.1, 0.0),  # no samples wait
        (OutageLimit(2.0, math.inf, True), 0.52, 0.0),  # three waits are 1.56 s, there are 1.55 s
        (OutageLimit(1.95, math.inf, True), 0.5, 1.5 - (0.1 + 0.25 * 0.5)),  # three waits just fit
    ],
)
def test_the_longest_outage(limit: OutageLimit, timeout_s: float, longest_s: float) -> None:
    assert limit.longest_s(timeout_s) == pytest.approx(longest_s, abs=1e-12)


def test_the_last_try_comes_while_the_watchdog_and_the_guards_wait() -> None:
    assert OutageLimit(2.0, math.inf, True).last_try_s == pytest.approx(1.8)
    assert OutageLimit(2.0, 1.5, True).last_try_s == pytest.approx(1.3)


def test_what_is_said_before_a_campaign_begins() -> None:
    assert (
        OutageLimit(2.0, math.inf, True)
        .sentence(0.5)
        .startswith("an outage of the wire of up to 1.3 s is ridden out (watchdog 2 s)")
    )
    assert "of up to 0.6 s is ridden out" in OutageLimit(2.0, 1.0, True).sentence(0.2)
    assert (
        OutageLimit(2.0, math.inf, True)
        .sentence(0.6)
        .startswith(
            "no outage of the wire longer than 0.6 s is ridden out: timeout_s = 0.6 leaves no time for it "
            "within the watchdog's 2 s; a shorter one is asked over"
        )
    )
    assert (
        OutageLimit(2.0, math.inf, False)
        .sentence(0.5)
        .startswith("an outage of the wire is asked over for 0.5 s at most: this controller keeps no samples")
    )


def test_a_controller_that_is_polled_keeps_no_samples() -> None:
    settings = SimpleNamespace(watchdog_s=3.0)
    ring, polled = SimpleNamespace(poll=None), SimpleNamespace(poll=object())
    assert leeway_of(settings, ring) == OutageLimit(3.0, math.inf, True)  # type: ignore[arg-type]
    assert leeway_of(settings, polled, 1.5) == OutageLimit(3.0, 1.5, False)  # type: ignore[arg-type]
