from __future__ import annotations

import numpy as np

from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.drivers.mailbox import Mailbox


def block(first: int, samples: int, lost: int = 0) -> SampleBlock:
    time_us = np.arange(first, first + samples, dtype=np.int64)
    return SampleBlock("amplifier", first, time_us, {"force_2": np.zeros(samples, np.int32)}, lost, 0.0)


def test_everything_comes_out_once_in_order() -> None:
    mailbox = Mailbox()
    items: list[SampleBlock | SensorFault] = [block(0, 3), SensorFault("amplifier", 1.0, "x"), block(3, 2)]
    for item in items:
        mailbox.put(item)
    assert list(mailbox.take()) == items
    assert list(mailbox.take()) == []


def test_what_nobody_fetched_is_counted_as_lost() -> None:
    mailbox = Mailbox(limit=2)
    for first in range(0, 50, 5):
        mailbox.put(block(first, 5, lost=1 if first == 10 else 0))
    left = mailbox.take()
    blocks = [item for item in left if isinstance(item, SampleBlock)]
    assert [item.first_sequence for item in blocks] == [40, 45]
    assert [item.lost for item in blocks] == [41, 0]  # eight blocks of five, and one lost before
    mailbox.put(block(50, 5))
    (fresh,) = mailbox.take()
    assert isinstance(fresh, SampleBlock)
    assert fresh.lost == 0
