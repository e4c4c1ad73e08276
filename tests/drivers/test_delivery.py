"""What a wire delivers: samples per block over round trip, less what status, watchdog and commands take."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.drivers.delivery_rate.blocks import WORK_S, Delivery, status_rest_s

PER_BLOCK = 14


def delivery(trip_s: float, rate_Hz: float = 1000.0) -> Delivery:
    return Delivery(PER_BLOCK, trip_s, rate_Hz, status_s=trip_s, feed_s=trip_s)


@pytest.mark.parametrize(
    ("trip_s", "share"),
    [
        (0.001, 1.0 - 0.05 - 1 / 201 - 4 * 0.001 - 6 * 0.001),
        (0.01, 1.0 - 0.05 - 10 / 210 - 4 * 0.01 - 6 * 0.01),
        (0.02, 1.0 - 0.05 - 20 / 220 - 4 * 0.02 - 6 * 0.02),
        (0.05, 1.0 - 0.05 - 1 / 8 - 4 * 0.05 - 6 * 0.05),  # seven times 50 ms are more than 200 ms
        (0.2, 0.0),
    ],
)
def test_a_status_every_fifth_of_a_second_four_feeds_and_six_exchanges_for_commands(
    trip_s: float, share: float
) -> None:
    found = delivery(trip_s)
    assert found.samples_share == pytest.approx(share, rel=1e-12)
    assert found.most_Hz == pytest.approx(share * PER_BLOCK / trip_s, rel=1e-12)


@pytest.mark.parametrize("rate_Hz", [20.0, 300.0, 1000.0, 5000.0])
@pytest.mark.parametrize("gap_s", [0.0, 0.0012])
def test_the_longest_round_trip_is_that_at_which_the_rate_is_just_reached(
    rate_Hz: float, gap_s: float
) -> None:
    found = Delivery(PER_BLOCK, 0.03, rate_Hz, status_s=0.01, feed_s=0.005, gap_s=gap_s)
    ratio = found.longest_trip_s / found.round_trip_s
    there = replace(found, round_trip_s=ratio * 0.03, status_s=ratio * 0.01, feed_s=ratio * 0.005)
    share_of_rate = there.most_Hz / rate_Hz
    share_of_time = there.longest_catch_up_s / there.catch_up_s
    assert min(share_of_rate, share_of_time) == pytest.approx(1.0, rel=1e-6)


def test_it_keeps_up_on_one_side_of_it_only() -> None:
    longest_s = delivery(0.01).longest_trip_s
    assert 0.0110 < longest_s < 0.0111
    assert delivery(0.999 * longest_s).keeps_up
    assert not delivery(1.001 * longest_s).keeps_up


@pytest.mark.parametrize("trip_s", [0.002, 0.005, 0.01])
def test_what_waits_behind_a_request_is_read_in_the_time_that_a_reader_takes_for_it(trip_s: float) -> None:
    """Block by block: each read brings 14 samples, and as many come meanwhile as it takes milliseconds."""
    found = delivery(trip_s)
    waiting, passed_s = 1000.0 * trip_s, 0.0
    while waiting > 0.0:
        waiting += 1000.0 * (trip_s + WORK_S) - PER_BLOCK
        passed_s += trip_s + WORK_S
    assert passed_s - (trip_s + WORK_S) <= found.catch_up_s <= passed_s


def test_one_that_would_catch_up_late_is_refused_with_the_figures() -> None:
    found = replace(delivery(0.0095), status_s=0.03, feed_s=0.005)
    assert found.most_Hz > found.rate_Hz
    assert not found.keeps_up
    said = (
        "what waits behind one other request is read in 97 ms, 84 ms at most would do; a block must take less"
    )
    assert said in found.text


def test_what_does_not_keep_up_says_the_figures() -> None:
    text = delivery(0.02).text
    assert "does not keep up: at most 461 samples/s of 1000 (14 samples a block in 20.00 ms, 66 %" in text
    assert "a block must take less than 11.0 ms: a quicker wire" in text
    line = replace(delivery(0.028, 600.0), line_s=0.0252).text
    assert "a higher baud rate (the bytes of a block alone take 25.2 ms)" in line


def test_samples_go_first_while_the_reader_is_behind() -> None:
    for took_s, up_to_date, rest_s in [
        (0.00004, True, 0.00028),
        (0.00004, False, 0.2),
        (0.01, True, 0.07),
        (0.01, False, 0.2),
        (0.05, True, 0.2),
        (0.05, False, 0.35),
        (0.4, False, 0.5),
    ]:
        assert status_rest_s(took_s, up_to_date=up_to_date) == pytest.approx(rest_s)


@pytest.mark.parametrize(("median_s", "said"), [(0.0, False), (0.0095, False), (0.0112, True)])
def test_a_wire_whose_slower_half_does_not_keep_up_is_remarked_on(median_s: float, said: bool) -> None:
    found = Delivery(PER_BLOCK, 0.0093, 1000.0, 0.0093, 0.0093, median_trip_s=median_s)
    assert found.keeps_up
    assert (
        "but half of the blocks take longer than 11.2 ms, and less than 11.0 ms would do" in found.remark
    ) is said
    assert found.text.endswith(found.remark)
    slow = Delivery(PER_BLOCK, 0.0118, 1000.0, 0.0118, 0.0118, median_trip_s=0.013)
    assert not slow.keeps_up
    assert not slow.remark, "that it does not keep up is said already"
