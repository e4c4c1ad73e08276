"""Which samples of a sine are its full cycles, by the command that is recorded with them.

The controller counts cycles in its status, but samples and status are read apart from each other: a reader
that is behind, or looks seldom, has samples of one cycle and the count of another. The command stands beside
every sample. The first whole period with the full amplitude is cycle 1, and the others follow period by
period; so each cycle has its number and its samples, however late they are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.daq.strokes.sine_watch import CommandSeen, SineWatch
from bufferstand.protocols.prediction import Sine

SEARCH_SHARE = 0.125
"""The first full period is looked for in steps of so much of a cycle."""
FULL_SHARE = 0.8
"""A full cycle's command has so much of the amplitude at least: a correction takes 0.05 of it at most."""
STEADY_SHARE, STEADY_MM = 0.05, 0.02
"""The first full cycle's command departs from a sine by so much at most; what leads in, by more."""
STOPPED_SHARE = 0.4
"""A command that departs by more than this share of its amplitude stopped within the cycle."""
SAME_SHARE, SAME_MM = 0.05, 0.002
"""Commands are the same if they differ by no more than this share of a change, or by its resolution [mm]."""


@dataclass(frozen=True)
class FullCycle:
    """Where a full cycle is.

    Parameters
    ----------
    number : int
        From 1 on.
    begin_us : float
        Time stamp at which its command rises through the mean [µs].
    command : CommandSeen or None
        None where samples are missing.
    """

    number: int
    begin_us: float
    command: CommandSeen | None


class FullCycles:
    """Finds the full cycles of a sine, one after the other.

    Parameters
    ----------
    watch : SineWatch
        Has the samples.
    amplitude_mm : float
        As first commanded.
    cycles : int
        At full amplitude; what comes behind them leads out.
    """

    def __init__(self, watch: SineWatch, amplitude_mm: float, cycles: int) -> None:
        self._watch, self._amplitude_mm, self._cycles = watch, amplitude_mm, cycles
        self._search_us: float | None = None
        self._begin_us: float | None = None
        self._number = 1
        self._hole = False
        self._over = False
        self.changed_mm = 0.0
        """By so much the command is being changed [mm]: its cycle departs from a sine by no more."""

    def next(self, counted: int) -> FullCycle | None:
        """Return the next one that is over; None where there is none yet.

        Parameters
        ----------
        counted : int
            Cycles that the controller counts at present. It decides the number only where the samples in
            which the sine begins are missing.
        """
        newest_us = self._watch.newest_us
        if newest_us is None or self._over:
            return None
        if self._begin_us is None and not self._found_first(newest_us, counted):
            return None
        assert self._begin_us is not None
        begin_us, period_us = self._begin_us, self._watch.period_us
        period = self._watch.period_from(begin_us)
        if period is None and newest_us < begin_us + 1.1 * period_us:
            return None
        command = None if period is None else period.command
        if command is not None and not self._is_full(
            command, STOPPED_SHARE * self._amplitude_mm + self.changed_mm
        ):
            self._over = True
            return None
        if period is not None and command is not None and self._is_steady(command):
            # The controller's clock is not quite ours.
            self._begin_us = period.first_us + command.late_share * period_us
        found = FullCycle(self._number, begin_us, command)
        self._begin_us += period_us
        self._number += 1
        self._over = self._number > self._cycles
        return found

    def _found_first(self, newest_us: int, counted: int) -> bool:
        """Look for the first full cycle among the samples that were not yet looked at."""
        period_us = self._watch.period_us
        if self._search_us is None:
            self._search_us = float(self._watch.oldest_us or 0)
        while self._search_us + period_us <= newest_us:
            period = self._watch.period_from(self._search_us)
            if period is not None and self._is_steady(period.command):
                self._begin_us = period.first_us + period.command.late_share * period_us
                if self._hole:
                    since = int((newest_us - self._begin_us) / period_us)
                    self._number = min(max(counted - since + 1, 1), self._cycles)
                return True
            self._hole = self._hole or period is None
            self._search_us += SEARCH_SHARE * period_us
            self._watch.forget_before(self._search_us - 0.5 * period_us)
        return False

    def _is_full(self, command: CommandSeen, misfit_mm: float) -> bool:
        return command.sine.amplitude_mm >= FULL_SHARE * self._amplitude_mm and command.misfit_mm <= misfit_mm

    def _is_steady(self, command: CommandSeen) -> bool:
        return self._is_full(command, STEADY_SHARE * self._amplitude_mm + STEADY_MM)


class SineChange:
    """Follows by the recorded command how a running sine goes over to another one."""

    def __init__(self) -> None:
        self._last: Sine | None = None
        self._target: Sine | None = None
        self._near_mm = SAME_MM
        self._began = False

    @property
    def is_awaited(self) -> bool:
        """Whether a change was ordered that is not seen to be over."""
        return self._target is not None

    def order(self, before: Sine, after: Sine) -> None:
        """Await that the command goes over from one sine to another [mm]; what it is by now was seen."""
        assert self._last is not None
        mean_mm, amplitude_mm = after.mean_mm - before.mean_mm, after.amplitude_mm - before.amplitude_mm
        self._target = Sine(self._last.mean_mm + mean_mm, self._last.amplitude_mm + amplitude_mm)
        self._near_mm = max(SAME_MM, SAME_SHARE * max(abs(mean_mm), abs(amplitude_mm)))
        self._began = False

    def goes_over(self, command: Sine) -> bool:
        """Return whether the command goes over in the next cycle, by that cycle's mean and amplitude."""
        before, self._last = self._last, command
        if self._target is None or before is None:
            return False
        if self._is_near(command, self._target):
            self._target = None
            return False
        if self._is_near(command, before):
            if self._began:  # the controller rounded it
                self._target = None
            return False
        self._began = True
        return True

    def _is_near(self, one: Sine, other: Sine) -> bool:
        apart_mm = max(abs(one.mean_mm - other.mean_mm), abs(one.amplitude_mm - other.amplitude_mm))
        return apart_mm <= self._near_mm
