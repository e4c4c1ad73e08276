"""How many registers an RMC answers in one read, found by asking."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.controllers.rmc.largest_read import LEAST, MOST, find_largest_read
from bufferstand.foundation import DeviceFault


class Device:
    """Answers reads up to so many registers."""

    def __init__(self, most: int) -> None:
        self.most, self.asked = most, [0]

    def read(self, count: int) -> None:
        self.asked.append(count)
        if count > self.most:
            raise DeviceFault("refused")


@given(most=st.integers(LEAST, MOST))
def test_the_largest_even_number_is_found_in_few_reads(most: int) -> None:
    device = Device(most)
    assert find_largest_read(device.read) == 2 * (most // 2)
    assert max(device.asked) <= MOST
    assert all(count % 2 == 0 for count in device.asked)
    assert len(device.asked) <= 1 + 9


def test_one_that_answers_all_is_asked_twice() -> None:
    device = Device(MOST)
    assert find_largest_read(device.read) == MOST - 1
    assert device.asked == [0, LEAST, MOST - 1]


def test_one_that_answers_too_little_is_a_fault() -> None:
    with pytest.raises(DeviceFault):
        find_largest_read(Device(LEAST - 2).read)
