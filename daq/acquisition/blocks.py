"""Joins consecutive blocks of one stream, so that the guards look once instead of many times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from bufferstand.drivers import SampleBlock


def join_blocks(blocks: Iterable[SampleBlock]) -> Iterator[SampleBlock]:
    """Join consecutive blocks of one stream; a loss or a jump of the sequence begins a new one.

    Parameters
    ----------
    blocks : iterable of SampleBlock
        In the order in which they came.

    Yields
    ------
    SampleBlock
        The same rows in the same order; ``received_s`` is that of the last block joined.
    """
    pending: list[SampleBlock] = []
    for block in blocks:
        if pending and not _follows(pending[-1], block):
            yield _joined(pending)
            pending = []
        pending.append(block)
    if pending:
        yield _joined(pending)


def _follows(before: SampleBlock, block: SampleBlock) -> bool:
    return (
        block.lost == 0
        and block.stream == before.stream
        and block.first_sequence == before.first_sequence + len(before.time_us)
    )


def _joined(blocks: list[SampleBlock]) -> SampleBlock:
    first = blocks[0]
    if len(blocks) == 1:
        return first
    return SampleBlock(
        first.stream,
        first.first_sequence,
        np.concatenate([block.time_us for block in blocks]),
        {name: np.concatenate([block.counts[name] for block in blocks]) for name in first.counts},
        first.lost,
        blocks[-1].received_s,
        first.missed,
        blocks[-1].more,
    )
