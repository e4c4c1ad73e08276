"""Evaluates slow motions, strokes to a limit and ramps, once they have ended."""

from __future__ import annotations

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.command_settings import StrokeCommandSettings
from bufferstand.daq.strokes.sine_correction import MotionOrder
from bufferstand.daq.strokes.static_watch import RampWatch, StaticWatch
from bufferstand.daq.strokes.stroke_rows import StrokeRow, static_row
from bufferstand.foundation import RampTo, StaticCycles


class _AtTheEnd:
    """Has nothing to judge while the motion runs."""

    def look(self, cycles_done: int) -> None:
        """Do nothing in a pass."""

    def judge_rest(self) -> bool:
        """Return that nothing waits to be judged."""
        return False

    def row(self) -> StrokeRow | None:
        """Return None: what was reached is known at the end."""
        return None


class StaticStrokeCheck(_AtTheEnd):
    """Looks at slow strokes to a limit, and learns from them.

    Parameters
    ----------
    motion : StaticCycles
        As it was asked for.
    commanded_mm : float
        Where the piston turns, from first contact [mm].
    order : Order
    """

    def __init__(self, motion: StaticCycles, commanded_mm: float, order: MotionOrder) -> None:
        self._order = order
        self._watch = StaticWatch(motion, commanded_mm, order.terms.delays_s)

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        self._watch.take(block)

    def end(self) -> StrokeRow | None:
        """Learn from the strokes, and return the row that is kept; None where no sample came."""
        watch, order = self._watch, self._order
        if watch.reached_mm is None:
            return None
        if not watch.by_force:
            order.terms.knowledge.take_turn(watch.turn_s)
        if (slow := watch.seen()) is not None:
            for doubt in order.terms.knowledge.take_slow(slow, order.expected_of(1)):
                order.once(doubt)
        return static_row(
            watch.motion.stroke_limit_mm,
            watch.commanded_mm,
            watch.reached_mm,
            watch.by_force,
            compensated=order.compensates,
        )


class RampCheck(_AtTheEnd):
    """Looks at a ramp, and learns how late the piston follows it: of a sine that comes next nothing is known.

    Parameters
    ----------
    motion : RampTo
    terms : Terms
    """

    def __init__(self, motion: RampTo, terms: StrokeCommandSettings) -> None:
        self._terms, self._watch = terms, RampWatch(motion.speed_mm_per_s)

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        self._watch.take(block)

    def end(self) -> StrokeRow | None:
        """Learn from the ramp; it has no row."""
        self._terms.knowledge.take_lag(self._watch.lag_s)
        return None
