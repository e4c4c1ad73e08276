"""What becomes of a cyclic motion: a sine is looked at and corrected while it runs, and a row is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from daq.scaling import ScaledBlock
from daq.sine_watch import CycleSeen, SineWatch
from daq.static_watch import RampWatch, StaticWatch
from daq.stroke_agreement import Once, Terms, Voice
from daq.stroke_rows import CLOSE_MM, CLOSE_PERCENT, StrokeRow, harmonic_row, is_off, static_row
from daq.stroke_steps import corrected
from drivers.interfaces import Controller
from foundation.errors import CommandRejected
from protocols.commanded import Sine
from protocols.steps import Harmonic, RampTo, StaticCycles, Turns

OVERLAP = 0.15
"""A cycle may begin so much of a cycle before the last change is over: 5 % of the change is left then."""
LEAST_LEFT = 2
"""Cycles that are left when a sine is changed: it goes over in the first, and the second shows it."""
CHANGE_CYCLES = 2
"""A change goes over in the next cycle, and counts from the one after it."""
ABOVE_SHARE = 0.002
"""A force is above its limit by more than this share: that of a turn is known no better."""
LATE = 0.25
"""A turn that is not whole at the end of its cycle, because the piston is late, is awaited so long."""


@dataclass(frozen=True)
class Order:
    """What is told of a motion, beside the motion itself.

    Parameters
    ----------
    terms : Terms
    voice : Voice
    once : Once
        For what is said once in a campaign.
    expected_of : callable
        What is expected of the turns of one of its cycles, by its number from 1; None where nothing is.
    compensates : bool
        Whether it is the specimen's stroke that is asked for.
    """

    terms: Terms
    voice: Voice
    once: Once
    expected_of: Callable[[int], Turns | None]
    compensates: bool


class SineLook:
    """Looks at a sine, learns from its cycles, and corrects it where that can be done.

    Parameters
    ----------
    motion : Harmonic
        As it was asked for.
    command : Sine
        What the piston was told, from first contact.
    order : Order
    controller : Controller
    zero_mm : float
        Piston position of first contact.
    """

    def __init__(
        self, motion: Harmonic, command: Sine, order: Order, controller: Controller, zero_mm: float
    ) -> None:
        self._motion, self._order, self._controller, self._zero_mm = motion, order, controller, zero_mm
        self._asked = Sine(motion.mean_mm, motion.amplitude_mm)
        self._first_command = self._command = command
        self._watch = SineWatch(motion.frequency_Hz, order.terms.delays_s)
        self._cycles_done = 0
        self._seen_us: int | None = None
        self._due_us: int | None = None
        self._changing = False
        self._changed_us: int | None = None
        self._first: CycleSeen | None = None
        self._last: CycleSeen | None = None
        self._warned = self._above_force = False
        self._turns: dict[int, Sine] = {}

    def take(self, block: ScaledBlock) -> None:
        """Keep a block of the controller's samples."""
        self._watch.take(block)

    def look(self, cycles_done: int) -> None:
        """Look at it, once in every pass."""
        before_us, self._seen_us = self._seen_us, self._watch.newest_us
        if self._changed_us is None and self._changing:
            self._changed_us, self._changing = self._seen_us, False
        if cycles_done > self._cycles_done and before_us is not None:
            self._cycles_done = cycles_done
            # What had been read when the count was still lower belongs to the cycles before.
            self._due_us = before_us
            self._see(before_us)
        elif self._due_us is not None and self._seen_us is not None:
            self._see(self._seen_us)

    def _see(self, end_us: int) -> None:
        """Look at the cycle that ends there; await its last turn for a while if it is not whole."""
        period = self._watch.period_until(end_us)
        turned = None if period is None else period.turned
        if period is None or turned is None:
            assert self._due_us is not None
            if end_us - self._due_us > LATE * 1e6 / self._motion.frequency_Hz:
                self._due_us = None
            return
        self._due_us = None
        self._turns[self._cycles_done] = turned.sine
        if self._is_changing_at(end_us) or (cycle := period.seen()) is None:
            return
        self._first, self._last = self._first or cycle, cycle
        order = self._order
        for doubt in order.terms.knowledge.take(cycle, order.expected_of(self._cycles_done)):
            order.once(doubt)
        self._see_force(cycle)
        if order.compensates:
            self._judge(cycle)

    def _see_force(self, cycle: CycleSeen) -> None:
        """Say once that a cycle brings more force than it may."""
        motion, order, most_kN = self._motion, self._order, self._order.terms.bounds.force_max_kN
        if self._above_force or cycle.upper_kN <= (1.0 + ABOVE_SHARE) * most_kN:
            return
        self._above_force = True
        lowered = order.compensates and self._controller.can_adjust
        order.voice.warn(
            f"WARNING: {motion.mean_mm:g} ± {motion.amplitude_mm:g} mm at {motion.frequency_Hz:g} Hz brings "
            f"{cycle.upper_kN:.1f} kN in cycle {self._cycles_done}, more than force_max_kN = {most_kN:g}: "
            + ("it is made smaller" if lowered else "this sine goes on, what follows is made smaller")
        )

    def _judge(self, cycle: CycleSeen) -> None:
        """Say that a cycle is off, and command the next ones anew where that is possible."""
        motion, terms = self._motion, self._order.terms
        row = self.row()
        can_adjust = self._controller.can_adjust
        if row is not None and not self._warned and row.is_off(terms.table):
            self._warned = True
            can = " (being corrected)" if can_adjust else ""
            self._order.voice.warn(f"WARNING: after cycle {self._cycles_done}{can}: {row.sentence()}")
        if not can_adjust or self._cycles_done >= motion.cycles:
            return
        wanted, held = corrected(
            self._asked,
            self._command,
            cycle,
            terms.knowledge.gain(motion.frequency_Hz),
            terms.knowledge.give_mm_per_kN,
            terms.bounds,
            self._coming_kN(),
        )
        if held and is_off(self._asked, cycle.stroke, CLOSE_PERCENT, CLOSE_MM):
            self._order.once(
                f"{motion.mean_mm:g} ± {motion.amplitude_mm:g} mm at {motion.frequency_Hz:g} Hz "
                f"cannot be reached: {held}"
            )
        if wanted != self._command and motion.cycles - self._cycles_done >= LEAST_LEFT:
            self._adjust(wanted)

    def _coming_kN(self) -> tuple[float, float]:  # noqa: N802 - the unit keeps its capital
        """Return by how much the forces at the turns change by themselves until a change has gone over."""
        now, then = (self._order.expected_of(self._cycles_done + more) for more in (0, CHANGE_CYCLES))
        return self._order.terms.knowledge.change_kN(now, then)

    def _adjust(self, wanted: Sine) -> None:
        text = f"{wanted.mean_mm:.3f} ± {wanted.amplitude_mm:.3f} mm"
        voice = self._order.voice
        try:
            self._controller.adjust_harmonic(
                mean_mm=wanted.mean_mm + self._zero_mm, amplitude_mm=wanted.amplitude_mm
            )
        except CommandRejected as rejected:  # no reason to stop
            why = "the controller did not take the change; the sine goes on as it was"
            voice.event("stroke", f"not corrected to {text} of the piston: {why}", answer=str(rejected))
            return
        voice.event(
            "stroke",
            f"corrected to {text} of the piston",
            mean_mm=wanted.mean_mm,
            amplitude_mm=wanted.amplitude_mm,
        )
        self._command, self._changing, self._changed_us = wanted, True, None

    def _is_changing_at(self, end_us: int) -> bool:
        """Return whether the cycle that ends there was still going over to another command."""
        if self._changing:
            return True
        if self._changed_us is None:
            return False
        period_us = 1e6 / self._motion.frequency_Hz
        return end_us - period_us < self._changed_us + (1.0 - OVERLAP) * period_us

    def row(self) -> StrokeRow | None:
        """Return what was asked, commanded and reached up to now; None before a cycle."""
        if self._first is None or self._last is None:
            return None
        return harmonic_row(
            self._asked,
            self._motion.frequency_Hz,
            (self._first_command, self._command),
            (self._first.stroke, self._last.stroke),
            self._turns,
            self._order.terms.table,
            compensated=self._order.compensates,
        )

    def end(self) -> StrokeRow | None:
        """Return the row that is kept."""
        return self.row()


class StaticLook:
    """Looks at slow strokes to a limit, and learns from them.

    Parameters
    ----------
    motion : StaticCycles
        As it was asked for.
    commanded_mm : float
        Where the piston turns, from first contact [mm].
    order : Order
    """

    def __init__(self, motion: StaticCycles, commanded_mm: float, order: Order) -> None:
        self._order = order
        self._watch = StaticWatch(motion, commanded_mm, order.terms.delays_s)

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        self._watch.take(block)

    def look(self, cycles_done: int) -> None:
        """Do nothing in a pass: what slow strokes show is read at their end."""

    def row(self) -> StrokeRow | None:
        """Return None: what was reached is known at the end."""
        return None

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


class RampLook:
    """Looks at a ramp, and learns how late the piston follows it: of a sine that comes next nothing is known.

    Parameters
    ----------
    motion : RampTo
    terms : Terms
    """

    def __init__(self, motion: RampTo, terms: Terms) -> None:
        self._terms, self._watch = terms, RampWatch(motion.speed_mm_per_s)

    def take(self, block: ScaledBlock) -> None:
        """Look at a block of the controller's samples."""
        self._watch.take(block)

    def look(self, cycles_done: int) -> None:
        """Do nothing in a pass: a ramp has no cycles."""

    def row(self) -> StrokeRow | None:
        """Return None: a ramp has no row."""
        return None

    def end(self) -> StrokeRow | None:
        """Learn from the ramp; it has no row."""
        self._terms.knowledge.take_lag(self._watch.lag_s)
        return None
