"""How many polls a second a wire allows: reads per poll × round trip, against the period."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bufferstand.drivers.delivery_rate.blocks import COMMANDS_HZ, FEED_S, status_rest_s

LEFT_OUT_SHARE = 0.1
"""Share of the periods that may be without a sample; more is no test at the stated rate."""


@dataclass(frozen=True)
class PollDelivery:
    """What a controller delivers that is polled: as many polls as fit between the other exchanges.

    Parameters
    ----------
    reads : int
        Requests of one poll.
    poll_s : float
        From the first request of a poll to its last reply [s of stand time]; a quarter of those that were
        measured was quicker, since a busy computer makes single ones long.
    rate_Hz : float
        Polls a second that the profile asks for.
    """

    reads: int
    poll_s: float
    rate_Hz: float

    @property
    def read_s(self) -> float:
        """Round trip of one read [s]."""
        return self.poll_s / self.reads

    @property
    def most_Hz(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Polls a second that can be made at most, with status, watchdog and commands in between.

        None at all where the reads of one poll come further apart than a period: such polls are left out.
        """
        apart_s = (self.reads - 1) * self.read_s
        return self._wire_Hz if apart_s * self.rate_Hz <= 1.0 else 0.0

    @property
    def _wire_Hz(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Polls a second that the wire has room for, at whatever period [Hz]."""
        status = self.read_s / (self.read_s + status_rest_s(self.read_s, up_to_date=True))
        share = 1.0 - status - self.read_s / FEED_S - COMMANDS_HZ * self.read_s
        return max(share, 0.0) / self.poll_s

    @property
    def keeps_up(self) -> bool:
        """Whether at most :data:`LEFT_OUT_SHARE` of the periods will be without a sample."""
        return self.most_Hz >= (1.0 - LEFT_OUT_SHARE) * self.rate_Hz

    @property
    def remark(self) -> str:
        """What is to be said although it keeps up; empty where every period will have its sample."""
        if not self.keeps_up or self.most_Hz >= self.rate_Hz:
            return ""
        return f"{self._figures}; some periods will have no sample: {self._remedy}"

    @property
    def text(self) -> str:
        """The figures for a person."""
        if self.keeps_up:
            return self.remark or f"keeps up: {self._figures}"
        return f"does not keep up: {self._figures}; {self._remedy}"

    @property
    def _figures(self) -> str:
        reads = "1 read" if self.reads == 1 else f"{self.reads} reads"
        return (
            f"at most {self.most_Hz:.0f} polls/s of {self.rate_Hz:g} ({reads} of {self.read_s * 1e3:.2f} ms, "
            f"so {self.poll_s * 1e3:.2f} ms a poll in periods of {1e3 / self.rate_Hz:.4g} ms)"
        )

    @property
    def _remedy(self) -> str:
        one = "" if self.reads == 1 else ", read all channels at once"
        suited_Hz = math.floor(10.0 * self._wire_Hz) / 10.0
        return f"state rate_Hz = {suited_Hz:g} or less in [poll] of the profile{one}, or a quicker wire"
