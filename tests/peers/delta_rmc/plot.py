"""A continuous plot and its upload area (p. 187–192, 1138)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from tests.peers.delta_rmc.unsaid import Unsaid

NOT_TRIGGERED, CAPTURING, COMPLETE = 0, 1, 2
TRIGGERED, CONTINUOUS, NEWEST = 1, 2, 3
MISMATCH, OVERRAN = 1, 2


class Plot:
    """One plot of several data sets, read set by set from the upload area.

    Parameters
    ----------
    sets : sequence of str
        Names of what is sampled (of the controller's quantities), in the order of the plot template.
    period_loops : int
        Loops of the controller from sample to sample.
    unsaid : Unsaid
    """

    def __init__(self, sets: Sequence[str], period_loops: int, unsaid: Unsaid) -> None:
        self.sets, self.period_loops, self._unsaid = tuple(sets), period_loops, unsaid
        self.state, self.identity = COMPLETE, 0
        self._samples: deque[tuple[float, ...]] = deque(maxlen=unsaid.plot_samples)
        self.captured = 0
        self.mode = self.upload_status = self.requested = self.uploaded = self.index = 0
        self._next = 0

    def rearm(self) -> None:
        """Rearm Plot (103): capture continuously from now on."""
        self.state = NOT_TRIGGERED
        self.identity += 1
        self._samples.clear()
        self.captured = 0
        self._restart()

    def sample(self, row: tuple[float, ...]) -> None:
        """Take one sample of every data set."""
        if self.state == NOT_TRIGGERED:
            self._samples.append(row)
            self.captured += 1

    @property
    def oldest(self) -> int:
        """Number of the oldest sample that is still there."""
        return self.captured - len(self._samples)

    def _restart(self) -> None:
        self.upload_status = self.uploaded = 0
        newest = self.mode in (CONTINUOUS, NEWEST) and self._unsaid.mode_2_starts == "newest"
        self._next = self.index = self.captured if newest else self.oldest

    def write(self, element: int, value: int) -> None:
        """Write mode (resets the index, p. 187), requested samples or current index; no other is taken."""
        if element == 0:
            self.mode = value & 0xF
            self._restart()
        elif element == 1:
            self.requested = value
        elif element == 2:
            self._next = self.index = value
            self.upload_status = 0
            if value == 0:  # how to recover from an overrun (p. 189): it must not overrun at once again
                self._restart()

    def read(self, room: int) -> tuple[list[int], list[float]]:
        """Give registers 0 to 4 and as many samples as were asked for, set by set.

        Parameters
        ----------
        room : int
            Registers of data that fit into this read.
        """
        count = self.requested
        fits = count > 0 and count * len(self.sets) <= room
        before = self._next
        data: list[float] = []
        self.uploaded = 0
        if self.mode == TRIGGERED or self.state != NOT_TRIGGERED:
            self.upload_status = MISMATCH
            self.index = 0
        elif self.mode == NEWEST and fits and self.captured - self.oldest >= count:
            self.index = self.captured - count
            data = self._block(self.index, count)
        elif self.mode == CONTINUOUS and self.upload_status != OVERRAN:
            self.index = before
            if before < self.oldest:
                self.upload_status = OVERRAN
            elif fits and before + count <= self.captured:
                data = self._block(before, count)
                self._next = before + count
        head = [self.mode | self.upload_status << 4, self.requested, self.index, self.identity, self.uploaded]
        return head, data

    def take_back(self) -> None:
        """Undo the last read's step, where a lost reply is not to move the index."""
        self._next = self.index

    def _block(self, first: int, count: int) -> list[float]:
        self.uploaded = count
        rows = [self._samples[first - self.oldest + step] for step in range(count)]
        return [row[column] for column in range(len(self.sets)) for row in rows]
