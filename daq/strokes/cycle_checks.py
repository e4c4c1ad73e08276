"""The strokes that the full cycles of a sine reached, and which of them were off."""

from __future__ import annotations

from bufferstand.protocols.campaign_file import StrokeTable
from bufferstand.protocols.prediction import Sine

CLOSE_PERCENT, CLOSE_MM = 0.5, 0.1
"""What compensation is to reach: amplitude, in per cent of what is asked, and mean [mm]."""
SURE = 2.0
"""Off by so little is told from noise where it is this many standard uncertainties of the turns beyond it."""


class CycleChecks:
    """Keeps what every full cycle reached, by its number.

    Parameters
    ----------
    asked : Sine
        Of the specimen.
    table : StrokeTable
        How far off is worth a warning.
    """

    def __init__(self, asked: Sine, table: StrokeTable) -> None:
        self.asked, self._table = asked, table
        self.first: Sine | None = None
        """Reached in the first full cycle that is on record."""
        self.last: Sine | None = None
        """Reached in the last one."""
        self.done = 0
        """Number of the last full cycle."""
        self.off: list[int] = []
        """Cycles that were off by more than the campaign states."""
        self.changed: list[int] = []
        """Those of ``off`` in which the command went over to another one."""
        self.not_close: list[int] = []
        """Cycles that were off by less than that, but by more than compensation is to reach."""
        self.unseen: list[int] = []
        """Cycles whose turns are not whole on record."""

    def take(self, number: int, reached: Sine, u_mm: float, *, goes_over: bool) -> None:
        """Judge a cycle.

        Parameters
        ----------
        number : int
            From 1 on.
        reached : Sine
            What the specimen did.
        u_mm : float
            Standard uncertainty of its mean and amplitude by noise [mm].
        goes_over : bool
            Whether its command went over to another one.
        """
        self.first, self.last, self.done = self.first or reached, reached, number
        if is_off(self.asked, reached, self._table.warn_percent, self._table.warn_mm):
            self.off.append(number)
            self.changed += [number] * goes_over
        elif is_off(self.asked, reached, CLOSE_PERCENT, CLOSE_MM, SURE * u_mm):
            self.not_close.append(number)

    def miss(self, number: int) -> None:
        """Count a cycle whose turns are not whole on record."""
        self.done = number
        self.unseen.append(number)

    @property
    def last_is_not_close(self) -> bool:
        """Whether the last cycle is off by more than compensation is to reach."""
        return self.last is not None and is_off(self.asked, self.last, CLOSE_PERCENT, CLOSE_MM)


def is_off(asked: Sine, reached: Sine, percent: float, mm: float, doubt_mm: float = 0.0) -> bool:
    """Return whether a sine is off by more than so many per cent of its amplitude, or mm of its mean.

    ``doubt_mm`` is added to either limit.
    """
    amplitude_mm = 0.01 * percent * asked.amplitude_mm
    return (
        abs(reached.amplitude_mm - asked.amplitude_mm) > amplitude_mm + doubt_mm
        or abs(reached.mean_mm - asked.mean_mm) > mm + doubt_mm
    )
