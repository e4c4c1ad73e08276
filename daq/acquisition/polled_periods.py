"""Counts the periods of polling without a sample: late polls are no gaps."""

from __future__ import annotations

from bufferstand.daq.scaling import ScaledBlock


class PolledPeriods:
    """Counts the samples of a polled controller against the periods that they span.

    Parameters
    ----------
    rate_Hz : float
        Polls a second that the profile asks for.
    """

    def __init__(self, rate_Hz: float) -> None:
        self._rate_Hz = rate_Hz
        self.begin()

    def begin(self) -> None:
        """Count anew."""
        self._first_us: int | None = None
        self._last_us = 0
        self._rows = self._lost = 0

    def take(self, block: ScaledBlock) -> None:
        """Take a block of the controller."""
        if not len(block):
            return
        if self._first_us is None:
            self._first_us = int(block.time_us[0])
        else:
            self._lost += block.lost
        self._last_us = int(block.time_us[-1])
        self._rows += len(block)

    @property
    def periods(self) -> int:
        """Periods from the first sample to the last, both included."""
        if self._first_us is None:
            return 0
        return round((self._last_us - self._first_us) * 1e-6 * self._rate_Hz) + 1

    @property
    def without_sample(self) -> int:
        """Periods without a sample, those that a gap counts as lost among them."""
        return max(self.periods - self._rows, 0)

    def sentence(self) -> str:
        """Return the same in words."""
        text = f"{self.without_sample} of {self.periods} polling periods have no sample"
        return f"{text}, {self._lost} of them are counted as lost in gaps" if self._lost else text

    def facts(self) -> dict[str, int]:
        """Return the same as the data of an event."""
        return {"periods": self.periods, "without_sample": self.without_sample, "lost": self._lost}
