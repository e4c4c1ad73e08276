"""Which blocks of a run's stream have samples in a span of time, so that only these are read."""

from __future__ import annotations

import numpy as np

from bufferstand.recording.runfile import Run, StreamData


class BlockTimes:
    """The earliest and latest sample of every block of a stream, by one look at its time stamps alone.

    Nothing is presumed of their order: foreign records may go back in time.

    Parameters
    ----------
    run : Run
    stream : StreamData
        One of its streams, with at least one sample.
    rows : int
        Of a block; the last one may be shorter.

    Raises
    ------
    BadInput
        As :meth:`~bufferstand.recording.runfile.Run.time_blocks`.
    """

    def __init__(self, run: Run, stream: StreamData, rows: int) -> None:
        delays_s = [channel.delay_s for channel in stream.channels.values()] or [0.0]
        ends = [(one.min(), one.max()) for one in run.time_blocks(stream.name, rows)]
        first_s, last_s = np.array(ends).T
        self._first_s, self._last_s = first_s - max(delays_s), last_s - min(delays_s)

    def within(self, from_s: float, to_s: float) -> list[int]:
        """Return the numbers of the blocks that may have samples from one time to another [s], rising."""
        outside = (self._last_s < from_s) | (self._first_s > to_s)  # never so of one with a time that is none
        return np.flatnonzero(~outside).tolist()
