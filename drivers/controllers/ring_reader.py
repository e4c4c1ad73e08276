"""The bookkeeping of the sample ring: the next request, and checks that a reply is right, whole and new."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.controllers.cycle_gaps import missed_cycles
from bufferstand.drivers.register_maps import ASKED, CHECK, Profile

_WRAP = 1 << 32
_HALF = 1 << 31


class DoubtfulBlock(Exception):  # noqa: N818 - it names the fact
    """A block that cannot be true: torn, repeated or out of step; asking again is harmless."""


class AlteredBlock(DoubtfulBlock):
    """A block that came otherwise than it was sent: the wire's fault, not the device's."""


@dataclass(frozen=True)
class RingRows:
    """New samples of the ring.

    Parameters
    ----------
    first_sequence : int
        Absolute sequence number of row 0, unwrapped.
    time_us : NDArray[int64]
        Device time [µs], unwrapped, shape (n,).
    counts : dict of str to NDArray
        Raw counts by channel, shape (n,).
    lost : int
        Samples missing before row 0.
    missed : tuple of tuple of int and int
        Rows before which the device's clock went on without a sample, and by how many cycles, whether its
        numbers leave them out or not. They are not among ``lost``.
    """

    first_sequence: int
    time_us: NDArray[np.int64]
    counts: dict[str, NDArray[Any]]
    lost: int
    missed: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class RingWindow:
    """A window whose header and CRC are true.

    Parameters
    ----------
    first_sequence : int
        Absolute sequence number of its first sample.
    rows : int
        Samples in it.
    lost : int
        Samples missing before them.
    overruns : int
        The controller's counter.
    samples : bytes
        Its samples as they came.
    """

    first_sequence: int
    rows: int
    lost: int
    overruns: int
    samples: bytes

    @property
    def behind(self) -> int:
        """Sequence number behind it, as the register holds it (modulo 2**32)."""
        return (self.first_sequence + self.rows) % _WRAP


class RingReader:
    """Turns windows of registers into consecutive samples with unwrapped time.

    A window is taken only if it answers what was asked, its CRC is right (where the profile has these
    fields), its sequence continues (or leaves a gap, which is counted) and its ticks are those that the
    sequence and the sample rate demand; so a torn, late or repeated window cannot pass. A clock that goes on
    by some periods without a sample shows cycles that the controller missed: they are counted. Without a CRC
    that is believed only of a window that came twice alike. A hole in the numbers is of missed cycles, too,
    where the counter of overruns did not rise and the clock went on by no more than a pause: then nothing
    was overwritten.

    Parameters
    ----------
    profile : Profile
        The register map.
    sample_rate_Hz : float
        Of the device.
    """

    def __init__(self, profile: Profile, sample_rate_Hz: float) -> None:
        self._header = profile.ring_header
        self._sample = profile.ring_sample
        self._most = profile.ring.samples_per_block
        self._period_us = 1e6 / sample_rate_Hz
        self._next_sequence: int | None = None
        self._first_ask = 0
        self._floor = (0, 0)
        self._last_time_us = 0
        self._overruns: int | None = None
        self._doubted = b""
        self.events: list[str] = []

    @property
    def acknowledge(self) -> int:
        """Sequence number to ask for next, as the register holds it (modulo 2**32)."""
        return (self._next_sequence if self._next_sequence is not None else self._first_ask) % _WRAP

    def skip(self, samples: int) -> None:
        """Ask next for what lies so many samples further on, as if nothing had been read yet."""
        self._first_ask = (self._next_sequence or 0) + samples
        self._floor = (self._next_sequence or self._floor[0], self._last_time_us)
        self._next_sequence = None

    def begin_anew(self) -> None:
        """Take the ring as at a start: its device may have been started anew, and counts from anywhere then.

        Sequence numbers and times go on behind those that were read, as if the device's counters had wrapped.
        """
        self._floor = (self._next_sequence or self._floor[0], self._last_time_us)
        self._next_sequence, self._first_ask = None, 0
        self._overruns = None

    def take(self, packed: bytes) -> RingRows | None:
        """Return the samples of a window, given as it came over the wire, and move on behind them.

        None where it holds none.

        Raises
        ------
        DoubtfulBlock
            If the window cannot be true; nothing has moved then.
        ValueError
            If the window has the wrong length.
        """
        return self.unpack(self.look(packed))

    def look(self, packed: bytes) -> RingWindow:
        """Return what a window holds, if header and CRC are true; nothing moves yet.

        Raises
        ------
        DoubtfulBlock, ValueError
            As :meth:`take`.
        """
        start = 2 * self._header.words
        header = self._header.unpack(packed[:start])
        rows = int(header["count"])
        if rows > self._most:
            raise DoubtfulBlock(f"the block claims {rows} samples, {self._most} fit")
        samples = packed[start : start + 2 * rows * self._sample.words]
        self._demand_whole(header, packed[: start - 4], samples)
        first, lost = self._place(int(header["first_sequence"]), rows)
        return RingWindow(first, rows, lost, int(header["overruns"]), samples)

    def is_answered(self, packed: bytes) -> bool:
        """Return whether a window repeats the number that is asked for, or the profile has it not."""
        header = self._header.unpack(packed[: 2 * self._header.words])
        return header.get(ASKED, self.acknowledge) == self.acknowledge

    @property
    def is_checked(self) -> bool:
        """Whether a window's CRC proves it true; without one only its ticks do, which come later."""
        return any(place.name == CHECK for place in self._header.places)

    def is_full(self, window: RingWindow) -> bool:
        """Return whether a window holds all that fits: there are more samples behind it."""
        return window.rows == self._most

    def unpack(self, window: RingWindow) -> RingRows | None:
        """Return a window's samples, None where it holds none, and move on behind them.

        Raises
        ------
        DoubtfulBlock
            If its ticks cannot be true; nothing has moved then.
        """
        first, rows, lost = window.first_sequence, window.rows, window.lost
        if rows == 0:
            if self._next_sequence is None:
                self._first_ask = first  # after 25 days “0” lies ahead of the device's sequence, not behind
            self._note_overruns(window.overruns, lost=0, at=first)
            return None
        columns = self._sample.unpack_rows(window.samples, rows)
        time_us, missed = self._unwrap(columns.pop("tick"), lost)
        if missed and not self.is_checked and window.samples != self._doubted:
            self._doubted = window.samples
            cycles = sum(several for _, several in missed)
            raise DoubtfulBlock(
                f"the ticks leave out {cycles} periods: cycles that the controller missed, or a block that "
                "was altered on its way"
            )
        if self._next_sequence is None:
            lost = 0
        rose = self._note_overruns(window.overruns, lost=lost, at=first)
        if lost and not rose:  # nothing was overwritten: it never took them
            if missed_cycles((lost + 1) * self._period_us, self._period_us):
                missed, lost = _with_hole(missed, lost), 0
            else:
                self.events.append(
                    f"{lost} samples are missing before sequence {first}: the controller's numbers leave "
                    "them out, and its overrun counter did not rise"
                )
        self._next_sequence = first + rows
        self._last_time_us = int(time_us[-1])
        return RingRows(first, time_us, columns, lost, missed)

    def _demand_whole(self, header: dict[str, float | int], before_check: bytes, samples: bytes) -> None:
        """See that the window answers this request and came unaltered, as far as the profile lets it."""
        if CHECK in header and zlib.crc32(samples, zlib.crc32(before_check)) != header[CHECK]:
            raise AlteredBlock("the block's CRC does not fit its content: it was altered on its way")
        if header.get(ASKED, self.acknowledge) != self.acknowledge:
            raise DoubtfulBlock(
                f"the block answers a request for sequence {header[ASKED]}, not {self.acknowledge}: "
                "it is late, or another program reads this ring"
            )

    def _place(self, first: int, rows: int) -> tuple[int, int]:
        """Return the absolute sequence of row 0 and the samples missing before it."""
        if self._next_sequence is None:
            return _lifted(first, self._floor[0]), 0
        ahead = (first - self._next_sequence) % _WRAP
        if ahead >= _HALF:
            raise DoubtfulBlock(
                f"the block begins at sequence {first}, before {self.acknowledge} which was asked for: "
                "the controller has restarted, or another program reads its ring"
            )
        if rows == 0 and ahead:
            raise DoubtfulBlock(f"the block is empty but begins at {first}, not {self.acknowledge}")
        return self._next_sequence + ahead, ahead

    def _unwrap(
        self, ticks: NDArray[np.uint32], lost: int
    ) -> tuple[NDArray[np.int64], tuple[tuple[int, int], ...]]:
        """Return device time without the 32-bit wrap (every 71.6 min), and where cycles were missed.

        Ticks that stand, go back, or jump by more than a pause are refused.
        """
        stamps = ticks.tolist()  # a handful: plain numbers are quicker than arrays
        steps = [(after - before) % _WRAP for before, after in pairwise(stamps)]
        missed: list[tuple[int, int]] = []
        if steps and (min(steps) < 0.5 * self._period_us or max(steps) > 1.5 * self._period_us):
            missed = self._missed_inside(steps)
        if self._next_sequence is None:
            start = _lifted(stamps[0], self._floor[1])
        else:
            expected_us = (lost + 1) * self._period_us
            step_us = (stamps[0] - self._last_time_us) % _WRAP
            step_us += round((expected_us - step_us) / _WRAP) * _WRAP
            if abs(step_us - expected_us) > 0.5 * self._period_us + 1e-3 * expected_us:
                cycles = missed_cycles(step_us - lost * self._period_us, self._period_us)
                if not cycles:
                    raise DoubtfulBlock(
                        f"the tick steps by {step_us} µs from the last block, "
                        f"{expected_us:g} µs would be right"
                    )
                missed.insert(0, (0, cycles))
            start = self._last_time_us + step_us
        time_us = np.fromiter(accumulate(steps, initial=start), dtype=np.int64, count=len(stamps))
        return time_us, tuple(missed)

    def _missed_inside(self, steps: Sequence[int]) -> list[tuple[int, int]]:
        """Return the rows before which cycles were missed, and how many; refuse steps that are no time."""
        missed: list[tuple[int, int]] = []
        for row, step_us in enumerate(steps, 1):
            cycles = missed_cycles(step_us, self._period_us)
            if cycles is None:
                raise DoubtfulBlock(
                    f"the ticks step by {min(steps)} … {max(steps)} µs inside the block, "
                    f"the sample rate demands {self._period_us:g}"
                )
            if cycles:
                missed.append((row, cycles))
        return missed

    def _note_overruns(self, overruns: int, *, lost: int, at: int) -> int:
        """Say what was overwritten before it was read; return by how much the controller's counter rose."""
        before, self._overruns = self._overruns, overruns
        rose = 0 if before is None else (overruns - before) % 0x10000
        if lost and rose:
            self.events.append(
                f"{lost} samples lost before sequence {at}: the ring was read too late "
                f"(overrun counter +{rose})"
            )
        elif rose:
            self.events.append(
                f"the controller's overrun counter rose by {rose} at sequence {at} without a gap"
            )
        return rose


def _lifted(counter: int, floor: int) -> int:
    """Return the least number, not below a floor, of which a counter of 32 bits shows the end."""
    return counter + max(0, -(-(floor - counter) // _WRAP)) * _WRAP


def _with_hole(missed: tuple[tuple[int, int], ...], cycles: int) -> tuple[tuple[int, int], ...]:
    """Return where cycles were missed, with those before row 0 that are missing in its number, too."""
    before = dict(missed)
    return tuple(sorted({**before, 0: before.get(0, 0) + cycles}.items()))
