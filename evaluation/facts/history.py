"""Holds, residual strokes, settling and cumulated energy of a run, as facts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

HoldKind = Literal["relaxation", "creep", "mixed"]


@dataclass(frozen=True)
class PerDecade:
    """Change by each tenfold time of a hold: slope of y over log10 of the time since its start.

    ``expanded_uncertainty`` is None where the channel states no accuracy; ``misfit`` is the root mean square
    of what the line leaves, in the unit of y.
    """

    value: float
    expanded_uncertainty: float | None
    misfit: float


@dataclass(frozen=True)
class RecordedHold:
    """A dwell at an upper turning point: the stroke rests and the force relaxes, or the other way round.

    Start and end values are means over the first and the last 5 % of it.
    """

    cycle: int
    kind: HoldKind
    start_s: float
    duration_s: float
    force_start_kN: float
    force_end_kN: float
    stroke_start_mm: float
    stroke_end_mm: float
    force_per_decade_kN: PerDecade
    stroke_per_decade_mm: PerDecade


@dataclass(frozen=True)
class ResidualStroke:
    """What stays of a stroke that ends in a pause, and what of it the pause takes back [mm].

    U holds what both ends of the stroke do not share: the errors of their turning points.
    """

    cycle: int
    residual_mm: float
    expanded_uncertainty: float
    pause_s: float
    recovered_mm: float


@dataclass(frozen=True)
class Settling:
    """How a figure changes over the complete cycles of a run.

    Attributes
    ----------
    quantity : str
    part : int or None
        Of a run with several steps, which one.
    first_cycle, last_cycle : int
    first, last : float
    relative_change : float or None
        Last less first over first; None where that is 0.
    expanded_uncertainty : float or None
        Of the difference, by what noise makes of two cycles: errors of the channels are common to all. Where
        nothing was drawn, by what neighbouring cycles scatter; None below four of them.
    rate_per_cycle : float
        Slope over the last half of the cycles.
    settled_at_cycle : int or None
        From this one on all stay within 2 % of the mean of the last quarter; None where the last does not.
    """

    quantity: str
    part: int | None
    first_cycle: int
    last_cycle: int
    first: float
    last: float
    relative_change: float | None
    expanded_uncertainty: float | None
    rate_per_cycle: float
    settled_at_cycle: int | None


@dataclass(frozen=True)
class CumulatedEnergy:
    """Absorbed energy of all cycles that were evaluated [J]; a lower bound where others were not.

    U is the sum of theirs: errors of the channels are common to all. None where one has none.
    """

    absorbed: float
    expanded_uncertainty: float | None
    cycles: int
    not_evaluated: tuple[int, ...]


@dataclass(frozen=True)
class RunHistory:
    """What a run holds besides; ``cumulated`` is None where no cycle was evaluated."""

    holds: tuple[RecordedHold, ...] = ()
    residual_strokes: tuple[ResidualStroke, ...] = ()
    settling: tuple[Settling, ...] = ()
    cumulated: CumulatedEnergy | None = None
