"""Joining blocks: no sample is added, lost or moved, and a loss stays where it was."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.acquisition.blocks import join_blocks
from bufferstand.drivers.interfaces import SampleBlock


def block(first: int, count: int, *, lost: int = 0, stream: str = "controller") -> SampleBlock:
    sequence = np.arange(first, first + count)
    return SampleBlock(
        stream, first, sequence * 1000, {"force": sequence.astype(np.int32)}, lost, float(first + count)
    )


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 3)), max_size=12))
def test_rows_and_losses_are_kept(parts: list[tuple[int, int]]) -> None:
    blocks, sequence = [], 0
    for count, lost in parts:
        sequence += lost
        blocks.append(block(sequence, count, lost=lost))
        sequence += count
    joined = list(join_blocks(blocks))
    rows = [row for part in joined for row in (part.first_sequence + np.arange(len(part.time_us))).tolist()]
    assert rows == [row for part in blocks for row in part.counts["force"].tolist()]
    assert [row * 1000 for row in rows] == [t for part in joined for t in part.time_us.tolist()]
    assert rows == [count for part in joined for count in part.counts["force"].tolist()]
    assert sum(part.lost for part in joined) == sum(lost for _, lost in parts)
    assert len(joined) == sum(lost > 0 for _, lost in parts[1:]) + bool(parts)


def test_consecutive_blocks_become_one_received_last() -> None:
    (joined,) = join_blocks([block(5, 15), block(20, 15), block(35, 2)])
    assert (joined.first_sequence, len(joined.time_us), joined.received_s) == (5, 32, 37.0)


def test_a_jump_without_a_stated_loss_is_not_papered_over() -> None:
    assert len(list(join_blocks([block(0, 5), block(6, 5)]))) == 2
    assert len(list(join_blocks([block(0, 5), block(5, 5, stream="amplifier")]))) == 2
