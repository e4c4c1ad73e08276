"""Follows a sine: it is compared and corrected while it runs, and a row is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.command_settings import StrokeCommandSettings, StrokeMessages, WarnOnce
from bufferstand.daq.strokes.correction_steps import corrected
from bufferstand.daq.strokes.cycle_checks import CycleChecks
from bufferstand.daq.strokes.full_cycles import FullCycle, FullCycles, SineChange
from bufferstand.daq.strokes.sine_watch import CycleSeen, Period, SineWatch
from bufferstand.daq.strokes.stroke_rows import StrokeRow, harmonic_row
from bufferstand.daq.strokes.turning_points import StrokeTurns
from bufferstand.drivers import Controller
from bufferstand.foundation import CommandRejected, Harmonic
from bufferstand.protocols.prediction import Sine
from bufferstand.protocols.steps import ExpectedTurns

LEAST_LEFT = 2
"""Cycles that are left when a sine is changed: it goes over in the first, and the second shows it."""
LATE_SHARES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25)
"""A piston may be so much of a cycle late: its turns are looked for in a period that begins so much later."""
MOST_AT_ONCE = 8
"""Cycles that are judged in one pass: a reader that was behind has many, and the loop must go on."""
CHANGE_CYCLES = 2
"""A change goes over in the next cycle, and counts from the one after it."""
ABOVE_SHARE = 0.002
"""A force is above its limit by more than this share: that of a turn is known no better."""


@dataclass(frozen=True)
class MotionOrder:
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

    terms: StrokeCommandSettings
    voice: StrokeMessages
    once: WarnOnce
    expected_of: Callable[[int], ExpectedTurns | None]
    compensates: bool


class SineCorrector:
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
        self, motion: Harmonic, command: Sine, order: MotionOrder, controller: Controller, zero_mm: float
    ) -> None:
        self._motion, self._order, self._controller, self._zero_mm = motion, order, controller, zero_mm
        self._asked = Sine(motion.mean_mm, motion.amplitude_mm)
        self._first_command = self._command = command
        self._watch = SineWatch(motion.frequency_Hz, order.terms.delays_s)
        self._cycles = FullCycles(self._watch, command.amplitude_mm, motion.cycles)
        self._change = SineChange()
        self._open: tuple[FullCycle, bool] | None = None
        self._late: list[float] = []
        self._newest: CycleSeen | None = None
        self._counted = 0
        self._warned = self._above_force = self._over = False
        self._judged = CycleChecks(self._asked, order.terms.table)

    def take(self, block: ScaledBlock) -> None:
        """Keep a block of the controller's samples."""
        self._watch.take(block)

    def look(self, cycles_done: int) -> None:
        """Judge what has come, once in every pass; command the next cycles anew where that is possible."""
        self._counted = cycles_done
        if self.judge() or self._newest is None:
            return
        cycle, self._newest = self._newest, None
        if self._order.compensates and not self._change.is_awaited:
            self._correct(cycle, self._motion.cycles - max(cycles_done, self._judged.done))

    def judge_rest(self) -> bool:
        """Judge a few cycles of a sine that has ended; return whether there are more."""
        self._over = True
        return self.judge()

    def judge(self) -> bool:
        """Judge the cycles that are over, a few at once; return whether there are more."""
        for _ in range(MOST_AT_ONCE):
            if self._open is None and (found := self._cycles.next(self._counted)) is not None:
                goes_over = found.command is not None and self._change.goes_over(found.command.sine)
                self._open, self._late = (found, goes_over), list(LATE_SHARES)
            if self._open is None or not self._see(*self._open):
                return False
            self._open = None
        return True

    def _see(self, cycle: FullCycle, goes_over: bool) -> bool:
        """Judge a cycle by its turns; return False if the lower one is still awaited."""
        self._newest = None
        period = self._turned(cycle.begin_us)
        if period is None or period.turned is None:
            latest_us = cycle.begin_us + (1.0 + LATE_SHARES[-1]) * self._watch.period_us
            if self._late and cycle.command is not None and (self._watch.newest_us or 0) < latest_us:
                return False
            self._judged.miss(cycle.number)
        else:
            self._take(cycle.number, period, period.turned, goes_over=goes_over)
        self._watch.forget_before(cycle.begin_us + 0.5 * self._watch.period_us)
        return True

    def _take(self, number: int, period: Period, turned: StrokeTurns, *, goes_over: bool) -> None:
        """Keep what a cycle reached, and learn from it where its command was steady."""
        self._judged.take(number, turned.sine, turned.u_mm, goes_over=goes_over)
        if not goes_over and (seen := period.seen()) is not None:
            self._newest = seen
            for doubt in self._order.terms.knowledge.take(seen, self._order.expected_of(number)):
                self._order.once(doubt)
            self._see_force(number, seen)
        if not self._warned and not self._over:
            self._warn(number)

    def _turned(self, begin_us: float) -> Period | None:
        """Return the first period from there on, or a little later, that has both turns of a cycle.

        None where there is none, or not yet.
        """
        while self._late:
            period = self._watch.period_from(begin_us + self._late[0] * self._watch.period_us)
            if period is None:
                return None
            turned = period.turned
            if turned is not None and turned.upper.time_s < turned.lower.time_s:
                return period
            self._late.pop(0)
        return None

    def _warn(self, number: int) -> None:
        """Say once, while it runs, that a cycle is off."""
        row, order = self.row(), self._order
        if not order.compensates or row is None or not row.is_off(order.terms.table):
            return
        self._warned = True
        left = self._motion.cycles - max(number, self._counted)
        can = " (it can still be corrected)" if self._controller.can_adjust and left >= LEAST_LEFT else ""
        order.voice.warn(f"WARNING: after cycle {number}{can}: {row.sentence()}")

    def _see_force(self, number: int, cycle: CycleSeen) -> None:
        """Say once that a cycle brings more force than it may."""
        motion, order, most_kN = self._motion, self._order, self._order.terms.bounds.force_max_kN
        if self._above_force or cycle.upper_kN <= (1.0 + ABOVE_SHARE) * most_kN:
            return
        self._above_force = True
        left = motion.cycles - max(number, self._counted)
        lowered = order.compensates and self._controller.can_adjust and not self._over and left >= LEAST_LEFT
        order.voice.warn(
            f"WARNING: {self._name()} brings {cycle.upper_kN:.1f} kN in cycle {number}, "
            f"more than force_max_kN = {most_kN:g}: "
            + (
                "it is made smaller"
                if lowered
                else "this sine goes on so, it can no longer be changed; steps after it are made smaller"
            )
        )

    def _correct(self, cycle: CycleSeen, left: int) -> None:
        """Command the cycles that are left anew, by what a cycle did."""
        motion, terms = self._motion, self._order.terms
        if not self._controller.can_adjust or left < 1:
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
        if held and self._judged.last_is_not_close:
            self._order.once(f"{self._name()} cannot be reached: {held}")
        if wanted != self._command and left >= LEAST_LEFT:
            self._adjust(wanted)

    def _coming_kN(self) -> tuple[float, float]:  # noqa: N802 - the unit keeps its capital
        """Return by how much the forces at the turns change by themselves until a change has gone over."""
        now, then = (self._order.expected_of(self._judged.done + more) for more in (0, CHANGE_CYCLES))
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
            told = f"not corrected to {text} of the piston: {why}"
            voice.event("stroke", told, answer=str(rejected))
            self._order.once(f"{self._name()} is not corrected: {why}")
            return
        voice.event(
            "stroke",
            f"corrected to {text} of the piston",
            mean_mm=wanted.mean_mm,
            amplitude_mm=wanted.amplitude_mm,
        )
        self._change.order(self._command, wanted)
        self._cycles.changed_mm = abs(wanted.mean_mm - self._command.mean_mm) + abs(
            wanted.amplitude_mm - self._command.amplitude_mm
        )
        self._command = wanted

    def _name(self) -> str:
        return (
            f"{self._asked.mean_mm:g} ± {self._asked.amplitude_mm:g} mm at {self._motion.frequency_Hz:g} Hz"
        )

    def row(self) -> StrokeRow | None:
        """Return what was asked, commanded and reached up to now; None before a cycle."""
        if self._judged.last is None:
            return None
        return harmonic_row(
            self._motion.frequency_Hz,
            (self._first_command, self._command),
            self._judged,
            compensated=self._order.compensates,
        )

    def end(self) -> StrokeRow | None:
        """Judge what is left, and return the row that is kept; say so where nothing could be judged."""
        while self.judge():
            """Until none is left."""
        if self._over and self._counted >= self._motion.cycles:  # all of them were made
            for number in range(self._judged.done + 1, self._motion.cycles + 1):
                self._judged.miss(number)
        row = self.row()
        if row is None and self._counted > 0:
            self._order.once(f"what {self._name()} reached is not known: no cycle is whole among its samples")
        return row
