"""Cycles that a controller missed: steps of its clock without a sample, unlike a clock that jumped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bufferstand.drivers.interfaces import SampleBlock

LONGEST_PAUSE_S = 0.5
"""A clock that steps by more than this between two samples was set, or its device restarted [s]."""


def missed_cycles(step_us: float, period_us: float) -> int | None:
    """Return how many samples are missing where two that follow each other lie ``step_us`` apart.

    A device that skips a cycle of its loop has no sample of it; its clock goes on. To half a period a step
    is one period.

    Parameters
    ----------
    step_us : float
        From one time stamp to the next, by the device's clock [µs].
    period_us : float
        Sample period [µs].

    Returns
    -------
    int or None
        Their number; None where the clock stood, went back, or jumped by more than ``LONGEST_PAUSE_S``.
    """
    if not 0.5 * period_us <= step_us <= LONGEST_PAUSE_S * 1e6 + period_us:
        return None
    return 0 if step_us <= 1.5 * period_us else round(step_us / period_us) - 1


def parted(block: SampleBlock, missed: Sequence[tuple[int, int]]) -> Iterator[SampleBlock]:
    """Yield a block in parts, so that no part has a missed cycle inside.

    Parameters
    ----------
    block : SampleBlock
        Rows whose sequence counts on.
    missed : sequence of tuple of int and int
        Row before which cycles were missed, rising, and how many.

    Yields
    ------
    SampleBlock
        The same rows in the same order; a part's ``lost`` counts the cycles missed before it. ``more`` is
        true of all but the last part.
    """
    starts = [0, *(row for row, _ in missed if row > 0)]
    before = dict(missed)
    for start, end in zip(starts, [*starts[1:], len(block.time_us)], strict=True):
        cycles = before.get(start, 0)
        yield SampleBlock(
            block.stream,
            block.first_sequence + start,
            block.time_us[start:end],
            {name: column[start:end] for name, column in block.counts.items()},
            (block.lost if start == 0 else 0) + cycles,
            block.received_s,
            cycles,
            block.more or end < len(block.time_us),
        )
