from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.controllers.cycle_gaps import parted
from bufferstand.drivers.controllers.ring_reader import DoubtfulBlock, RingReader, RingRows
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.register_maps.coding import pack
from bufferstand.drivers.register_maps.profile import load_profile
from tests.drivers.profiles import plain_ring
from tests.drivers.ring_device import PERIOD_US, RingDevice

PROFILE = plain_ring()
"""Without CRC, so that what the sequence and the ticks alone can tell is seen."""
SHIPPED = load_profile("ring")
WRAP = 1 << 32


def taken(reader: RingReader, registers: list[int]) -> RingRows | None:
    return reader.take(pack(registers))


def fetch(reader: RingReader, device: RingDevice) -> RingRows | None:
    device.set("ring_acknowledge", reader.acknowledge)
    return taken(reader, device.window())


def first_rows(device: RingDevice) -> tuple[RingReader, RingRows]:
    reader = RingReader(PROFILE, 1e6 / PERIOD_US)
    rows = fetch(reader, device)
    assert rows is not None
    return reader, rows


@given(
    portions=st.lists(st.integers(0, 40), min_size=1, max_size=30),
    first=st.sampled_from([0, 17, WRAP - 20]),
    tick=st.sampled_from([0, 123, WRAP - 30_000]),
)
def test_samples_come_once_in_order_and_without_wraps(portions: list[int], first: int, tick: int) -> None:
    device = RingDevice(PROFILE, first_sequence=first, tick=tick)
    reader = RingReader(PROFILE, 1e6 / PERIOD_US)
    assert fetch(reader, device) is None
    got: list[RingRows] = []
    for portion in portions:
        device.sample(portion)
        while (rows := fetch(reader, device)) is not None:
            got.append(rows)
    total = sum(portions)
    assert sum(len(rows.time_us) for rows in got) == total
    if not total:
        return
    time_us = np.concatenate([rows.time_us for rows in got])
    force = np.concatenate([rows.counts["force"] for rows in got])
    # the device's own formulas, without modulo
    np.testing.assert_array_equal(time_us, tick + np.arange(total) * PERIOD_US)
    np.testing.assert_array_equal(force, (first + np.arange(total)) % 10_000_000 * 7 - 1_000_000)
    np.testing.assert_array_equal(
        [rows.first_sequence for rows in got],
        first + np.concatenate([[0], np.cumsum([len(rows.time_us) for rows in got])])[:-1],
    )
    assert all(rows.lost == 0 for rows in got)
    assert reader.events == []


@given(capacity=st.integers(15, 200), burst=st.integers(1, 5000))
def test_every_sample_is_delivered_or_counted_as_lost(capacity: int, burst: int) -> None:
    device = RingDevice(PROFILE, capacity=capacity)
    device.sample(10)
    reader, rows = first_rows(device)
    delivered, lost = len(rows.time_us), rows.lost
    device.sample(burst)
    while (more := fetch(reader, device)) is not None:
        delivered += len(more.time_us)
        lost += more.lost
        np.testing.assert_array_equal(
            more.time_us, (more.first_sequence + np.arange(len(more.time_us))) * PERIOD_US
        )
    assert delivered + lost == 10 + burst
    assert lost == max(0, burst - capacity)
    if lost:
        (event,) = reader.events
        assert event == (
            f"{lost} samples lost before sequence {10 + lost}: the ring was read too late "
            "(overrun counter +1)"
        )


@pytest.mark.parametrize(
    ("hole", "overruns", "lost", "missed", "told"),
    [
        (3, 0, 0, ((0, 3), (5, 2)), []),
        (
            3,
            1,
            3,
            ((5, 2),),
            ["3 samples lost before sequence 13: the ring was read too late (overrun coun"],
        ),
        (500, 0, 0, ((0, 500), (5, 2)), []),
        (
            501,
            0,
            501,
            ((5, 2),),
            ["501 samples are missing before sequence 511: the controller's numbers leave"],
        ),
    ],
)
def test_a_hole_in_the_numbers_is_of_missed_cycles_where_nothing_was_overwritten(
    hole: int, overruns: int, lost: int, missed: tuple[tuple[int, int], ...], told: list[str]
) -> None:
    """Half a second is the longest pause: what is missing longer is no cycle that was missed."""
    device, reader = RingDevice(SHIPPED), RingReader(SHIPPED, 1e6 / PERIOD_US)
    device.sample(10)
    assert fetch(reader, device) is not None
    device.sample(hole + 10)
    device.oldest = 10 + hole
    device.missed = {10 + hole + 5: 2}
    device.overruns += overruns
    rows = fetch(reader, device)
    assert rows is not None
    assert (rows.first_sequence, rows.lost, rows.missed) == (10 + hole, lost, missed)
    assert [event[:75] for event in reader.events] == told


def test_a_gap_longer_than_the_tick_wraps_keeps_true_time() -> None:
    device = RingDevice(PROFILE, capacity=100)
    device.sample(10)
    reader, _ = first_rows(device)
    device.sample(3 * 4_294_968 + 7)  # more than three wraps of 71.6 min
    rows = fetch(reader, device)
    assert rows is not None
    np.testing.assert_array_equal(
        rows.time_us[:2], np.array([rows.first_sequence, rows.first_sequence + 1]) * 1000
    )
    assert rows.lost == 3 * 4_294_968 + 7 - 100


def test_what_the_ring_held_before_the_first_read_is_no_loss() -> None:
    device = RingDevice(PROFILE, capacity=20)
    device.sample(500)
    _, rows = first_rows(device)
    assert rows.first_sequence == 480
    assert rows.lost == 0


@pytest.fixture
def running() -> tuple[RingReader, RingDevice]:
    device = RingDevice(PROFILE)
    device.sample(15)
    reader, _ = first_rows(device)
    device.sample(15)
    return reader, device


def refuse(reader: RingReader, window: list[int], message: str) -> None:
    before = reader.acknowledge
    with pytest.raises(DoubtfulBlock, match=message):
        taken(reader, window)
    assert reader.acknowledge == before  # nothing was taken


def test_a_repeated_block_is_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 0)
    refuse(
        reader,
        device.window(),
        "begins at sequence 0, before 15 which was asked for: the controller has restarted",
    )


def test_a_block_with_the_header_of_another_is_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 15)
    true = device.window()
    device.set("ring_acknowledge", 0)
    old = device.window()
    refuse(
        reader, true[:5] + old[5:], "the tick steps by -14000 µs from the last block, 1000 µs would be right"
    )


def test_a_block_torn_in_the_middle_is_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 15)
    true = device.window()
    device.set("ring_acknowledge", 0)
    old = device.window()
    cut = 5 + 8 * 7
    refuse(reader, true[:cut] + old[cut:], "the ticks step by 1000 … 4294953296 µs inside the block")


def test_a_stamp_that_does_not_move_is_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 15)
    window = device.window()
    window[5 + 8 : 5 + 10] = window[5:7]
    refuse(reader, window, "the ticks step by 0 … 2000 µs inside the block, the sample rate demands 1000")


def test_too_many_samples_are_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 15)
    window = device.window()
    window[2] = 16
    refuse(reader, window, "the block claims 16 samples, 15 fit")


def test_an_empty_block_elsewhere_is_refused(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.set("ring_acknowledge", 15)
    window = device.window()
    window[1] += 4
    window[2] = 0
    refuse(reader, window, "the block is empty but begins at 19, not 15")


def test_the_overrun_counter_alone_is_told(running: tuple[RingReader, RingDevice]) -> None:
    reader, device = running
    device.overruns = 3
    assert fetch(reader, device) is not None
    assert reader.events == ["the controller's overrun counter rose by 3 at sequence 15 without a gap"]


@pytest.fixture
def checked() -> tuple[RingReader, RingDevice]:
    """A reader of the shipped profile that has taken one block of two."""
    device = RingDevice(SHIPPED)
    device.sample(14)
    reader = RingReader(SHIPPED, 1e6 / PERIOD_US)
    assert fetch(reader, device) is not None
    device.sample(14)
    device.set("ring_acknowledge", reader.acknowledge)
    return reader, device


@given(place=st.integers(0, 120), bits=st.integers(1, 0xFFFF))
def test_no_altered_register_of_a_checked_block_is_taken(place: int, bits: int) -> None:
    device = RingDevice(SHIPPED)
    device.sample(14)
    reader = RingReader(SHIPPED, 1e6 / PERIOD_US)
    window = device.window()
    window[place] ^= bits
    refuse(reader, window, "the block")


def test_without_a_crc_an_altered_force_is_taken(running: tuple[RingReader, RingDevice]) -> None:
    """Why the default profile has one; docs/drivers.md says so."""
    reader, device = running
    device.set("ring_acknowledge", 15)
    window = device.window()
    window[5 + 3] ^= 0x0100
    rows = taken(reader, window)
    assert rows is not None
    assert rows.counts["force"][0] != device.rows(15, 1)["force"][0]


def test_an_altered_force_is_refused(checked: tuple[RingReader, RingDevice]) -> None:
    reader, device = checked
    window = device.window()
    window[9 + 3] ^= 0x0100
    refuse(reader, window, "the block's CRC does not fit its content: it was altered on its way")


def test_the_answer_to_another_request_is_refused(checked: tuple[RingReader, RingDevice]) -> None:
    """As a late reply on a serial line, or a request whose acknowledgement was altered."""
    reader, device = checked
    device.set("ring_acknowledge", 20)
    refuse(reader, device.window(), "the block answers a request for sequence 20, not 14")


@given(at=st.integers(1, 40), cycles=st.integers(1, 400))
def test_missed_cycles_are_counted_where_they_were(at: int, cycles: int) -> None:
    device = RingDevice(SHIPPED)
    device.missed = {at: cycles}
    reader = RingReader(SHIPPED, 1e6 / PERIOD_US)
    device.sample(60)
    found, stamps = [], []
    while (rows := fetch(reader, device)) is not None:
        found += [(rows.first_sequence + row, count) for row, count in rows.missed]
        stamps += rows.time_us.tolist()
        assert rows.lost == 0, "nothing was read too late"
    assert found == [(at, cycles)]
    assert np.diff(stamps).tolist() == [1000 * (1 + cycles * (row == at)) for row in range(1, 60)]


@pytest.mark.parametrize("cycles", [-1, -2, -300, 600, 5000, 3_600_000])
@pytest.mark.parametrize("at", [5, 14])
def test_a_clock_that_stands_goes_back_or_jumps_is_no_missed_cycle(at: int, cycles: int) -> None:
    device = RingDevice(SHIPPED)
    device.missed = {at: cycles}
    reader = RingReader(SHIPPED, 1e6 / PERIOD_US)
    device.sample(60)
    if at == 14:
        assert fetch(reader, device) is not None
    with pytest.raises(DoubtfulBlock, match=r"the ticks? steps? by"):
        fetch(reader, device)


def test_without_a_crc_missed_cycles_are_believed_when_the_block_comes_twice_alike(
    running: tuple[RingReader, RingDevice],
) -> None:
    reader, device = running
    device.missed = {20: 2}
    device.set("ring_acknowledge", 15)
    refuse(reader, device.window(), "the ticks leave out 2 periods: cycles that the controller missed, or")
    rows = fetch(reader, device)
    assert rows is not None
    assert rows.missed == ((5, 2),)


@given(
    rows=st.integers(1, 30),
    gaps=st.dictionaries(st.integers(0, 29), st.integers(1, 9), max_size=5),
    lost=st.integers(0, 3),
    more=st.booleans(),
)
def test_a_parted_block_keeps_every_row_and_counts_every_gap(
    rows: int, gaps: dict[int, int], lost: int, more: bool
) -> None:
    missed = sorted((row, cycles) for row, cycles in gaps.items() if row < rows)
    sequence = np.arange(100, 100 + rows)
    block = SampleBlock("controller", 100, sequence * 1000, {"force": sequence}, lost, 1.0, more=more)
    parts = list(parted(block, missed))
    assert [n for part in parts for n in part.counts["force"].tolist()] == sequence.tolist()
    assert [part.first_sequence for part in parts] == [int(part.counts["force"][0]) for part in parts]
    assert sum(part.lost for part in parts) == lost + sum(cycles for _, cycles in missed)
    assert sum(part.missed for part in parts) == sum(cycles for _, cycles in missed)
    assert {part.first_sequence - 100: part.missed for part in parts if part.missed} == dict(missed)
    assert [part.more for part in parts] == [True] * (len(parts) - 1) + [more]
