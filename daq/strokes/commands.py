"""From the stroke that was asked for to what the controller is told to do, and back to what became of it.

Asked is the specimen's stroke, commanded the piston's: further by what the machine gives way under the force
that is expected, by what the actuator falls short at the frequency, and by the zero. What is expected comes
from the plan and from what was learned (:mod:`bufferstand.daq.strokes.knowledge`); a running sine is
corrected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from bufferstand.daq.strokes.command_settings import (
    NoMessages,
    StrokeCommandSettings,
    StrokeMessages,
    WarnOnce,
)
from bufferstand.daq.strokes.sine_command import commanded_sine, first_loading
from bufferstand.daq.strokes.sine_correction import MotionOrder, SineCorrector
from bufferstand.daq.strokes.slow_motions import RampCheck, StaticStrokeCheck
from bufferstand.daq.strokes.stroke_rows import StrokeRow
from bufferstand.drivers import Controller
from bufferstand.foundation import Commandable, Harmonic, RampTo, StaticCycles
from bufferstand.protocols.prediction import Sine, piston_mm
from bufferstand.protocols.steps import ExpectedTurns, Motion, MotionEstimate, PlannedStep, RampToForce

"""The motions that a controller performs by itself."""

NEAR_MEAN_MM = 0.3
"""A sine is begun no further from its mean than this [mm]; the controller allows 0.5."""
APPROACH_MM_PER_S = 2.0
"""Speed of the way to it [mm/s]."""
AT_OWN_ZERO_MM = 0.1
"""First contact this far before the piston's own zero is at it [mm]."""
PLANNED_PERCENT, PLANNED_MM = 5.0, 1.0
"""A sine that is asked of the piston makes the specimen do what the plan expects to within this: what is not
stated right of machine and spring is less, and a controller whose gain is a tenth too low is more."""


class StrokeCommands:
    """Gives the controller its commands, looks what becomes of them, and corrects a running sine.

    Parameters
    ----------
    controller : Controller
        Who performs them.

    Notes
    -----
    Without :meth:`agree` it commands what is asked, from the zero on.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self.zero_mm = 0.0
        """Piston position of first contact: strokes are asked from there, positions commanded from the
        controller's zero [mm]."""
        self._terms: StrokeCommandSettings | None = None
        self._voice: StrokeMessages = NoMessages()
        self._step: PlannedStep | None = None
        self._motions: Sequence[Motion] = ()
        self._look: SineCorrector | StaticStrokeCheck | RampCheck | None = None
        self._looked_at: Motion | None = None
        self._keep_learned: Callable[[], object] | None = None
        self._warmer_K = 0.0
        self._is_measured = False
        self._known: tuple[Harmonic, Harmonic] | None = None
        self._once = WarnOnce(self._voice)
        self.rows: list[StrokeRow] = []
        """What was asked, commanded and reached in the step under way."""

    def agree(
        self, terms: StrokeCommandSettings, voice: StrokeMessages, keep: Callable[[], object] | None = None
    ) -> None:
        """Compensate from now on by these terms, and say what is to be said.

        Parameters
        ----------
        terms : Terms
        voice : Voice
        keep : callable, optional
            Called after every look: keeps what was learned.
        """
        self._terms, self._voice, self._once = terms, voice, WarnOnce(voice)
        self._keep_learned = keep

    @property
    def voice(self) -> StrokeMessages:
        """Who says what becomes of the commands."""
        return self._voice

    def begin_step(
        self, step: PlannedStep, motions: Sequence[Motion], specimen_C: float | None = None
    ) -> None:
        """Take the motions of a step, which say where a ramp leads to and what forces are expected.

        Parameters
        ----------
        step : PlannedStep
        motions : sequence of Motion
            Its motions, or those that are left.
        specimen_C : float, optional
            Temperature of the specimen's mass now [°C]; as planned if not given.
        """
        self._step, self._motions, self.rows = step, motions, []
        self._is_measured = False
        self._warmer_K = 0.0 if specimen_C is None else specimen_C - step.start_temperature_C

    def specimen_is(self, specimen_C: float) -> None:
        """Expect the forces of a specimen of this temperature [°C], measured while it warms up.

        A warm-up's cycles are as many as it takes: the plan's temperature of one of them is no use.
        """
        if self._step is not None:
            self._is_measured = True
            self._warmer_K = specimen_C - self._step.start_temperature_C

    # --- commands -----------------------------------------------------------------------------------

    def commanded(self, motion: Commandable) -> Commandable:
        """Return the motion that the controller is to make so that the specimen makes ``motion``."""
        if self._terms is None or not self._is_of_step(motion) or not self._compensates:
            return from_zero(motion, self.zero_mm)
        match motion:
            case RampTo(target_mm=target) if target > 0.0:
                if isinstance(sine := self._next(motion), Harmonic) and sine.mean_mm == target:
                    piston = self._commanded_sine(sine).mean_mm
                    return replace(motion, target_mm=piston + self.zero_mm)
                return replace(motion, target_mm=self._piston(target, motion) + self.zero_mm)
            case Harmonic():
                return from_zero(self._commanded_sine(motion), self.zero_mm)
            case StaticCycles():
                limit_mm = self._piston(motion.stroke_limit_mm, motion, most_kN=motion.force_limit_kN)
                limit_mm -= min(self._terms.knowledge.turn_s * motion.speed_mm_per_s, 0.5 * limit_mm)
                return replace(motion, stroke_limit_mm=limit_mm + self.zero_mm)
        return from_zero(motion, self.zero_mm)

    def way_to_force(self, motion: RampToForce) -> RampTo:
        """Return the ramp of the piston on which a force is met, up to where the stroke ends it."""
        end_mm = motion.stroke_limit_mm
        if self._terms is not None and self._compensates:
            give = self._terms.knowledge.give_mm_per_kN
            end_mm = min(piston_mm(end_mm, motion.force_kN, give), self._terms.bounds.piston_max_mm)
        return RampTo(end_mm, motion.speed_mm_per_s)

    @property
    def force_max_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """The greatest force that may be aimed at [kN]: that in force, which the controller keeps, too."""
        return float("inf") if self._terms is None else self._terms.bounds.force_max_kN

    def before_own_zero(self, motion: Motion) -> str:
        """Return why a motion cannot be made with first contact before the piston's own zero, else nothing.

        A controller's static cycles begin and end at its own zero: the specimen would stay compressed there.
        """
        if self.zero_mm >= -AT_OWN_ZERO_MM or not isinstance(motion, StaticCycles | Harmonic):
            return ""
        told = self.commanded(motion)
        if isinstance(told, Harmonic) and told.mean_mm >= told.amplitude_mm:
            return ""
        what = f"this {motion.name} begins" if isinstance(motion, StaticCycles) else "this sine goes"
        return (
            f"first contact is at {self.zero_mm:+.2f} mm of the piston, and {what} at or below its own "
            f"zero: give the specimen {-self.zero_mm:.2f} mm more room, or set the controller's zero back by "
            "as much"
        )

    def approach(self, motion: Motion, command_mm: float | None) -> RampTo | None:
        """Return the way of the piston to a sine's commanded mean; None where it stands there."""
        if not isinstance(motion, Harmonic) or command_mm is None or not self._is_of_step(motion):
            return None
        piston = self.commanded(motion)
        if not isinstance(piston, Harmonic) or abs(piston.mean_mm - command_mm) <= NEAR_MEAN_MM:
            return None
        return RampTo(piston.mean_mm - self.zero_mm, APPROACH_MM_PER_S)

    def start(self, motion: Commandable) -> int:
        """Start a motion of the specimen; return its sequence number.

        Raises
        ------
        CommandRejected
            If the controller refuses it.
        DeviceFault
            If the wire fails.
        """
        return self._controller.start(self.commanded(motion))

    @property
    def _compensates(self) -> bool:
        return self._step is not None and self._step.compensate

    def _is_of_step(self, motion: Motion) -> bool:
        return any(one is motion for one in self._motions)

    def _next(self, motion: Motion) -> Motion | None:
        at = next(index for index, one in enumerate(self._motions) if one is motion)
        return self._motions[at + 1] if at + 1 < len(self._motions) else None

    def _estimate(self, motion: Motion) -> MotionEstimate | None:
        """Return what the plan expects of a motion."""
        if self._step is None:
            return None
        for index, one in enumerate(self._motions):
            if one is motion and index < len(self._step.estimates):
                return self._step.estimates[index]
        return None

    def _expected(self, motion: Motion) -> ExpectedTurns | None:
        """Return the turns by which a motion is commanded, of a specimen as warm as it is."""
        return self._expected_of_cycle(motion, None)

    def _expected_of_cycle(self, motion: Motion, cycle: int | None) -> ExpectedTurns | None:
        """Return the turns that are expected of one cycle of a motion; of its usual ones if None."""
        if (estimate := self._estimate(motion)) is None:
            return None
        if isinstance(motion, Harmonic) and not self._is_measured:
            if cycle is None:
                return estimate.usual_turns(motion.cycles, self._warmer_K)
            return estimate.turns_of_cycle(cycle, motion.cycles, self._warmer_K)
        return estimate.turns_at(0.0, self._warmer_K)

    def _piston(self, stroke_mm: float, motion: Motion, *, most_kN: float = float("inf")) -> float:
        """Return where the piston is when the specimen has a stroke in a compression [mm]."""
        if self._terms is None:
            return stroke_mm
        known = self._terms.knowledge
        force_kN = min(known.force(stroke_mm, self._expected(motion)), most_kN)
        position_mm = piston_mm(stroke_mm, force_kN, known.give_mm_per_kN) + known.offset_mm
        return min(position_mm, self._terms.bounds.piston_max_mm)

    def _commanded_sine(self, motion: Harmonic) -> Harmonic:
        """Return the piston's sine [mm from first contact]; the ramp to it and the sine itself agree."""
        if self._known is not None and self._known[0] is motion:
            return self._known[1]
        if self._terms is None:
            return motion
        expected = self._expected(motion)
        share = first_loading(self._step, motion, self._estimate(motion))
        found = commanded_sine(motion, expected, share, self._terms.knowledge, self._terms.bounds)
        for text in found.said:
            self._once(text)
        piston = found.piston
        self._known = motion, replace(motion, mean_mm=piston.mean_mm, amplitude_mm=piston.amplitude_mm)
        return self._known[1]

    # --- what becomes of them -----------------------------------------------------------------------

    def begin_motion(self, motion: Motion, listeners: list[Callable[[Any], object]]) -> None:
        """Look at a motion of the step; before it is started, so that no sample is missed."""
        if self._terms is None or not self._is_of_step(motion):
            return
        if isinstance(motion, RampTo) and motion.target_mm > 0.0:
            self._look = RampCheck(motion, self._terms)
            listeners.append(self._look.take)
            return
        if not isinstance(motion, Harmonic | StaticCycles):
            return
        told, zero_mm = self.commanded(motion), self.zero_mm
        self._looked_at = motion
        expected_of = partial(self._expected_of_cycle, motion)
        order = MotionOrder(self._terms, self._voice, self._once, expected_of, self._compensates)
        if isinstance(motion, Harmonic) and isinstance(told, Harmonic):
            command = Sine(told.mean_mm - zero_mm, told.amplitude_mm)
            self._look = SineCorrector(motion, command, order, self._controller, zero_mm)
        elif isinstance(motion, StaticCycles) and isinstance(told, StaticCycles):
            self._look = StaticStrokeCheck(motion, told.stroke_limit_mm - zero_mm, order)
        if self._look is not None:
            listeners.append(self._look.take)

    def end_motion(self, listeners: list[Callable[[Any], object]]) -> None:
        """Look no longer; keep what was reached, and say if it is off."""
        if self._look is not None:
            listeners.remove(self._look.take)
            if (row := self._look.end()) is not None:
                self._keep(row, self._looked_at)
        self._look = self._known = self._looked_at = None

    def _keep(self, row: StrokeRow, motion: Motion | None) -> None:
        if self._terms is not None:
            row = replace(row, not_reached=row.compensated and row.is_off(self._terms.table))
        self.rows.append(row)
        self._voice.event("stroke", row.sentence(), **row.as_dict())
        if not row.compensated:
            if why := self._unlike_the_plan(row, motion):
                self._voice.warn(f"WARNING: {why}")
            return
        if row.not_reached:
            self._voice.warn(f"WARNING: {row.sentence()}")
        elif row.has_note:
            self._voice.message(f"note: {row.sentence()}")

    def _unlike_the_plan(self, row: StrokeRow, motion: Motion | None) -> str:
        """Return by how much a sine of the piston made the specimen do else than planned, empty if little."""
        estimate = None if motion is None else self._estimate(motion)
        if estimate is None or (turns := estimate.turns) is None or row.reached_amplitude_mm is None:
            return ""
        wanted = Sine.between(turns.lower_mm, turns.upper_mm)
        percent = 100.0 * (row.reached_amplitude_mm / max(wanted.amplitude_mm, 1e-9) - 1.0)
        off_mm = row.reached_mean_mm - wanted.mean_mm
        if abs(percent) <= PLANNED_PERCENT and abs(off_mm) <= PLANNED_MM:
            return ""
        return (
            f"{row.asked_mean_mm:.2f} ± {row.asked_amplitude_mm or 0.0:.2f} mm of the piston made "
            f"{row.reached_mean_mm:.2f} ± {row.reached_amplitude_mm:.2f} mm of the specimen, where the plan "
            f"expected {wanted.mean_mm:.2f} ± {wanted.amplitude_mm:.2f} mm: {off_mm:+.2f} mm, amplitude "
            f"{percent:+.2f} %; look at controller, draw wires and the stated machine_stiffness_kN_per_mm"
        )

    def judge_rest(self) -> bool:
        """Judge what has come of a motion that has ended; return whether there is more."""
        return self._look is not None and self._look.judge_rest()

    def look(self, cycles_done: int) -> None:
        """Look at the motion under way, once in every pass; correct it where it is off and can be changed."""
        if self._look is not None:
            self._look.look(cycles_done)
            if self._keep_learned is not None:
                self._keep_learned()

    @property
    def line(self) -> str:
        """What is asked, commanded and reached at present, or was in the last motion; empty before it."""
        row = None if self._look is None else self._look.row()
        if row is None and self.rows:
            row = self.rows[-1]
        return "" if row is None else row.sentence()


def from_zero(motion: Commandable, zero_mm: float) -> Commandable:
    """Return a motion counted from first contact as one of the piston, which touches at ``zero_mm``.

    A release ends where the force is gone, wherever that is.
    """
    match motion:
        case RampTo():
            return replace(motion, target_mm=motion.target_mm + zero_mm)
        case Harmonic():
            return replace(motion, mean_mm=motion.mean_mm + zero_mm)
        case StaticCycles():
            return replace(motion, stroke_limit_mm=motion.stroke_limit_mm + zero_mm)
    return motion
