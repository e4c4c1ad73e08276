"""How many samples a second a wire can deliver in blocks, against how many the controller takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

STATUS_REST = 7.0
"""The status is read again after so many times its own duration: that is an eighth of a slow wire's time."""
STATUS_WAIT_S = 0.2
"""While the reader is up to date the status is read again after so long at the latest, while it is behind
after so long at the earliest [s of the wall]."""
STATUS_LONGEST_S = 0.5
"""However slow the wire, it is read again after so long: a guard counts on its heartbeat [s of the wall]."""
FEED_S = 0.25
"""The watchdog is fed this often [s of the wall]."""
COMMANDS_HZ = 6.0
"""Exchanges a second for commands: that is one command, with lock, arming, judgement, reading back, execution
and judgement, half of them as long as a status, half as feeding. Measured over short campaigns: 5."""
CATCH_UP_SHARE = 0.05
"""Share of the time that is kept to catch up in, behind a command or a pause of the computer."""
CATCH_UP_BLOCKS = 6.0
"""What one other exchange costs is to be caught up while the controller takes so many blocks of samples: near
the limit a reader, and its guards, would be long behind after each."""
WORK_S = 0.0012
"""The computer judges and records a block for so long before it asks for the next one, where that is not
asked for ahead [s]; measured, on one of two busy processors."""
_HALVINGS = 40


def status_rest_s(took_s: float, *, up_to_date: bool) -> float:
    """Return how long the wire belongs to the samples before the status is read again [s of the wall].

    Parameters
    ----------
    took_s : float
        How long the last reading of the status took [s of the wall].
    up_to_date : bool
        Whether the reader has all samples; while it has not, they go first.
    """
    rest_s = STATUS_REST * took_s
    if up_to_date:
        return min(rest_s, STATUS_WAIT_S)
    return min(max(rest_s, STATUS_WAIT_S), STATUS_LONGEST_S)


@dataclass(frozen=True)
class Delivery:
    """What a controller with a ring delivers: samples per block over round trip, less the other exchanges.

    Parameters
    ----------
    samples_per_block : int
        That one read can carry.
    round_trip_s : float
        From asking for a block to having it [s of the wall]; a quarter of those that were measured was
        quicker, since a busy computer makes single ones long.
    rate_Hz : float
        Samples a second that the controller takes.
    status_s, feed_s : float
        From asking for the status to having it, likewise, and for feeding the watchdog [s of the wall].
    gap_s : float
        From having a block to asking for the next one [s of the wall]; 0 where that is asked for ahead.
    line_s : float
        What the bytes of a block alone take on a serial line [s]; 0 on a network.
    median_trip_s : float
        Half of the round trips of blocks were quicker [s of the wall]; 0 where that was not measured.
    """

    samples_per_block: int
    round_trip_s: float
    rate_Hz: float
    status_s: float
    feed_s: float
    gap_s: float = 0.0
    line_s: float = 0.0
    median_trip_s: float = 0.0

    @property
    def samples_share(self) -> float:
        """Share of the time in which blocks can be under way while the reader catches up."""
        return self._share(1.0)

    @property
    def most_Hz(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Samples a second that can be read at most, with status, watchdog and commands in between."""
        return self.samples_share * self.samples_per_block / (self.round_trip_s + self.gap_s)

    @property
    def catch_up_s(self) -> float:
        """How long it takes to read what has waited behind one other exchange, block by block [s]."""
        return self._catch_up_s(1.0)

    @property
    def longest_catch_up_s(self) -> float:
        """How long that may take [s]."""
        return CATCH_UP_BLOCKS * self.samples_per_block / self.rate_Hz

    @property
    def longest_trip_s(self) -> float:
        """Round trip of a block from which on it does not keep up; the other exchanges grow alike [s]."""
        short_s, long_s = 0.0, self.samples_per_block / self.rate_Hz
        for _ in range(_HALVINGS):
            middle_s = 0.5 * (short_s + long_s)
            if self._keeps_up(middle_s / self.round_trip_s):
                short_s = middle_s
            else:
                long_s = middle_s
        return short_s

    @property
    def keeps_up(self) -> bool:
        """Whether all samples can be read, and what has waited behind a request soon."""
        return self._keeps_up(1.0)

    @property
    def text(self) -> str:
        """The same for a person."""
        figures = (
            f"at most {self.most_Hz:.0f} samples/s of {self.rate_Hz:g} ({self.samples_per_block} samples a "
            f"block in {self.round_trip_s * 1e3:.2f} ms, {self.samples_share * 100.0:.0f} % of the time)"
        )
        if self.keeps_up:
            return f"keeps up: {figures}" + (f"; {self.remark}" if self.remark else "")
        wire = "a quicker wire"
        if self.line_s:
            wire = f"a higher baud rate (the bytes of a block alone take {self.line_s * 1e3:.1f} ms)"
        longest = f"a block must take less than {self.longest_trip_s * 1e3:.1f} ms"
        if self.most_Hz > self.rate_Hz:
            longest = (
                f"what waits behind one other request is read in {self.catch_up_s * 1e3:.0f} ms, "
                f"{self.longest_catch_up_s * 1e3:.0f} ms at most would do; {longest}"
            )
        do = f"{wire}, larger blocks, or a lower sample rate of the controller"
        return f"does not keep up: {figures}; {longest}: {do}"

    @property
    def remark(self) -> str:
        """What is to be said although it keeps up: the quick blocks do, half of them do not; else empty."""
        if not self.keeps_up or self.median_trip_s <= self.longest_trip_s:
            return ""
        return (
            f"but half of the blocks take longer than {self.median_trip_s * 1e3:.1f} ms, and less than "
            f"{self.longest_trip_s * 1e3:.1f} ms would do: the guards may see the stand late; look at "
            "network, controller and load of this computer"
        )

    def _keeps_up(self, slower: float) -> bool:
        """Return whether it does where each exchange takes so many times as long."""
        block_s = slower * self.round_trip_s + self.gap_s
        reads_all = self._share(slower) * self.samples_per_block > self.rate_Hz * block_s
        return reads_all and self._catch_up_s(slower) <= self.longest_catch_up_s

    def _catch_up_s(self, slower: float) -> float:
        """Return the time to catch up in where each exchange takes so many times as long [s]."""
        block_s = slower * self.round_trip_s + WORK_S  # it is not asked ahead so soon
        gained = self.samples_per_block - self.rate_Hz * block_s
        waiting = self.rate_Hz * slower * max(self.status_s, self.feed_s)
        return waiting / gained * block_s if gained > 0.0 else math.inf

    def _share(self, slower: float) -> float:
        """Return the share of the time left to samples where each exchange takes so many times as long."""
        status_s, feed_s = slower * self.status_s, slower * self.feed_s
        status = status_s / (status_s + status_rest_s(status_s, up_to_date=False))
        commands = COMMANDS_HZ * 0.5 * (status_s + feed_s)
        return max(1.0 - CATCH_UP_SHARE - status - feed_s / FEED_S - commands, 0.0)
