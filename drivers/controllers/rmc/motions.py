"""Motions on an RMC: its commands have neither number nor answer, so both are kept here.

A command is judged before it is sent (an RMC obeys what would do harm), and seen to be taken afterwards: a
move by the commanded position, a sine by its status block, into which -1 was written before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from bufferstand.drivers.controllers.rmc.axis import AxisStatus, RmcAxis
from bufferstand.drivers.controllers.rmc.settings import ChangeCodes
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.foundation import WireLost

ACCEPTED, UNKNOWN, WRONG_STATE, OUT_OF_RANGE, NOT_ARMED = range(5)
"""Values of register ``reject_code``."""
HOLD, RAMP, HARMONIC, STATIC, RELEASE, ADJUST = range(1, 7)
"""Values of register ``command_code``."""
AT_MEAN_mm, AT_ZERO_mm, SAME_mm = 0.5, 1.0, 2e-3
FLOAT32_SLACK = 1e-6
NOT_BEGUN = -1.0
FIRST_AND_LAST = 2
"""Cycles that a sine has besides: in their first and last quarter an RMC ramps the frequency (p. 777), so
they are no cycles of the sine that was asked for."""


@dataclass(frozen=True)
class MotionBounds:
    """What may be sent to the axis.

    Parameters
    ----------
    speed_max_mm_per_s, frequency_max_Hz : float
        Of the stand.
    clear_mm : float
        Lowest position.
    """

    speed_max_mm_per_s: float
    frequency_max_Hz: float
    clear_mm: float


class SineBlock(Protocol):
    """What the controller's variables have to do with a motion: the status block of Sine Start, the turn."""

    @property
    def number(self) -> int:
        """Of its first register, as a command names it."""
        ...

    def reset(self) -> None:
        """Write that no sine has begun."""
        ...

    def cycles(self) -> float:
        """Get how many cycles are done; ``NOT_BEGUN`` before the first."""
        ...

    def set_turn(self, force_kN: float, speed_mm_per_s: float) -> None:
        """Write where a static stroke turns back by itself, and how fast; at 0 kN nowhere."""
        ...

    def has_turned(self) -> bool:
        """Whether the watchdog program has turned since."""
        ...


@dataclass
class Motion:
    """A motion that runs: what it is, and which leg of it."""

    sequence: int
    code: int
    values: Mapping[str, float]
    leg: str
    cycles_done: int = 0
    end: EndReason = EndReason.NONE
    since_s: float = field(default=0.0)

    @property
    def state(self) -> MotionState:
        """What the controller does meanwhile."""
        states = {RAMP: MotionState.RAMPING, HARMONIC: MotionState.WAVEFORM, STATIC: MotionState.RAMPING}
        return states.get(self.code, MotionState.RELEASING if self.code == RELEASE else MotionState.HOLDING)


class MotionPort:
    """Takes numbered commands and makes them commands of an RMC.

    Parameters
    ----------
    axis : RmcAxis
    block : SineBlock
    bounds : MotionBounds
    change : ChangeCodes or None
        Without them no running sine is changed.
    now_s, sleep : callable
        Clock of the wire [s].
    note : callable
        Takes what is to be said.
    patience_s : float
        Longest wait for a command to be taken [s].
    """

    def __init__(
        self,
        axis: RmcAxis,
        block: SineBlock,
        bounds: MotionBounds,
        change: ChangeCodes | None,
        *,
        now_s: Callable[[], float],
        sleep: Callable[[float], None],
        note: Callable[[str], None],
        patience_s: float,
    ) -> None:
        self._axis, self._block, self._bounds, self._change = axis, block, bounds, change
        self._now_s, self._sleep, self._note, self._patience_s = now_s, sleep, note, patience_s
        self._armed: dict[str, float] | None = None
        self._executed = 0
        self._sent: tuple[Motion, Callable[[AxisStatus], bool]] | None = None
        self.motion: Motion | None = None
        self.stroke_limit_mm = self.force_limit_kN = 0.0
        self.echo = self.reject = self.done = self.cycles_done = 0
        self.end = EndReason.NONE

    def arm(self, values: dict[str, float], status: AxisStatus, *, ready: bool) -> None:
        """Judge a command and keep it."""
        self.echo = int(values["command_sequence"])
        self.reject = self._judge(values, status, ready=ready)
        self._armed = values if self.reject == ACCEPTED else None

    def execute(self, sequence: int, status: AxisStatus, *, ready: bool) -> None:
        """Begin the armed command of that number; one that has begun is not begun again."""
        self.echo, armed = sequence, self._armed
        if self._was_taken(sequence, status):
            return
        if armed is None or int(armed["command_sequence"]) != sequence:
            self.reject = ACCEPTED if sequence == self._executed else NOT_ARMED
            return
        self.reject = self._judge(armed, status, ready=ready)
        if self.reject != ACCEPTED:
            self._armed = None
            return
        code = int(armed["command_code"])
        if code == ADJUST:
            self._adjust(armed)
        elif not self._begin(Motion(sequence, code, armed, "begin"), status):
            self.reject = WRONG_STATE
        self._armed, self._executed = None, sequence

    def _was_taken(self, sequence: int, status: AxisStatus) -> bool:
        """Whether a command whose reply was lost was taken all the same; it runs then."""
        sent, self._sent = self._sent, None
        if sent is None or sent[0].sequence != sequence or not sent[1](status):
            return False
        self.motion, self.reject = sent[0], ACCEPTED
        self._armed, self._executed = None, sequence
        return True

    def _judge(self, values: Mapping[str, float], status: AxisStatus, *, ready: bool) -> int:
        code, running = int(values["command_code"]), self.motion
        if code not in range(HOLD, ADJUST + 1) or (code == ADJUST and self._change is None):
            return UNKNOWN
        if not ready or not int(values["command_sequence"]):
            return WRONG_STATE
        if code == ADJUST:
            return ACCEPTED if running is not None and running.leg == "sine" else WRONG_STATE
        if not self._in_range(code, values):
            return OUT_OF_RANGE
        return ACCEPTED if self._stands_for(code, values, status) else WRONG_STATE

    def _stands_for(self, code: int, values: Mapping[str, float], status: AxisStatus) -> bool:
        """Return whether a motion may begin: nothing moves, and it stands where it must."""
        if code in (HOLD, RELEASE):
            return True
        if self.motion is not None:
            return False
        if code == HARMONIC:
            return abs(status.target_mm - values["mean"]) <= AT_MEAN_mm
        clear_mm = self._bounds.clear_mm  # where a release has left it
        return code == RAMP or clear_mm - AT_ZERO_mm <= status.target_mm <= AT_ZERO_mm

    def _in_range(self, code: int, values: Mapping[str, float]) -> bool:
        more, bounds = 1.0 + FLOAT32_SLACK, self._bounds
        top_mm = self.stroke_limit_mm * more
        if code == HOLD:
            return True
        if code == HARMONIC:
            mean, amplitude, frequency = values["mean"], values["amplitude"], values["frequency"]
            return (
                0.0 < amplitude <= mean * more
                and mean + amplitude <= top_mm
                and 0.0 < frequency <= bounds.frequency_max_Hz * more
                and 2.0 * math.pi * frequency * amplitude <= bounds.speed_max_mm_per_s * more
                and values["cycles"] >= 1
            )
        if not 0.0 < values["speed"] <= bounds.speed_max_mm_per_s * more:
            return False
        if code == RAMP:
            return bounds.clear_mm <= values["target"] <= top_mm
        if code == STATIC:
            force_fits = 0.0 < values["turning_force"] <= self.force_limit_kN * more
            return force_fits and 0.0 < values["turning_stroke"] <= top_mm and values["cycles"] >= 1
        return True

    # --- beginning ----------------------------------------------------------------------------------

    def _begin(self, motion: Motion, status: AxisStatus) -> bool:
        """Send a motion's first command; return whether it was seen to be taken."""
        if self.motion is not None and self.motion.code == STATIC:
            self._block.set_turn(0.0, 0.0)
        self._finish(EndReason.COMMANDED)
        values, self.cycles_done = motion.values, 0
        if motion.code == HOLD:
            motion.leg = "stop"
            self._axis.stop()
            taken = True  # seen at its end: nothing of the status tells before
        elif motion.code == HARMONIC and abs(status.target_mm - values["mean"]) <= SAME_mm:
            taken = self._sine(motion)
        elif motion.code == HARMONIC:
            motion.leg = "to the mean"
            taken = self._move(values["mean"], min(10.0, self._bounds.speed_max_mm_per_s), motion)
        elif motion.code == STATIC:
            motion.leg = "to zero"
            taken = self._move(0.0, values["speed"], motion)
        else:
            motion.leg = "move"
            target_mm = values["target"] if motion.code == RAMP else self._bounds.clear_mm
            taken = self._move(target_mm, values["speed"], motion)
        if taken:
            if self.done == motion.sequence:
                self.done = 0  # an earlier user's number
            self.motion = motion
        return taken

    def _move(self, target_mm: float, speed_mm_per_s: float, motion: Motion | None = None) -> bool:
        def taken(status: AxisStatus) -> bool:
            return abs(status.requested_mm - target_mm) <= SAME_mm

        return self._give(lambda: self._axis.move(target_mm, speed_mm_per_s), taken, "a move", motion)

    def _sine(self, motion: Motion) -> bool:
        values, motion.leg = motion.values, "sine"
        cycles = values["cycles"] + FIRST_AND_LAST
        self._block.reset()

        def send() -> None:
            mean, amplitude, frequency = values["mean"], values["amplitude"], values["frequency"]
            self._axis.sine(mean, amplitude, frequency, cycles, self._block.number)

        return self._give(send, lambda _: self._block.cycles() != NOT_BEGUN, "a sine", motion)

    def _give(
        self,
        send: Callable[[], None],
        taken: Callable[[AxisStatus], bool],
        what: str,
        motion: Motion | None,
    ) -> bool:
        """Send a command once, and see it taken; where its reply is lost, what it does tells."""
        if motion is not None:
            self._sent = motion, taken  # for whoever asks once more behind a wire that was lost
        try:
            send()
        except WireLost as lost:
            self._note(f"{lost}; whether it was taken is seen by what the axis does")
        found = self._wait(taken, what)
        self._sent = None
        return found

    def _wait(self, taken: Callable[[AxisStatus], bool], what: str) -> bool:
        """Wait until a command is seen to be taken; what is not is told, with the RMC's own error number."""
        until_s = self._now_s() + self._patience_s
        while not taken(status := self._axis.look()):
            if self._now_s() >= until_s:
                self._axis.stop()
                self._note(
                    f"{what} was not taken within {self._patience_s:g} s: the axis shows error "
                    f"{status.last_error:g}, commanded position {status.requested_mm:g} mm; stopped; look at "
                    "its travel limits and the event log of RMCTools"
                )
                return False
            self._sleep(0.002)
        return True

    def _adjust(self, values: Mapping[str, float]) -> None:
        assert self._change is not None
        for which, value in (
            (self._change.amplitude, values["amplitude"]),
            (self._change.offset, values["mean"]),
        ):
            self._axis.change(which, value, self._change.ramp_cycles, 1.0)

    # --- going on -----------------------------------------------------------------------------------

    def look(self, status: AxisStatus, cause: EndReason) -> None:
        """Let the running motion go on, or end.

        Parameters
        ----------
        status : AxisStatus
        cause : EndReason
            Why the controller itself has ended it; NONE where it has not.
        """
        motion = self.motion
        if motion is None:
            return
        if cause is not EndReason.NONE:
            self._finish(cause)
        elif not status.enabled:
            self._finish(EndReason.COMMANDED)
        elif motion.code == STATIC:
            self._turn(motion, status)
        elif motion.leg == "to the mean":
            if status.done and not self._sine(motion):
                self._finish(EndReason.COMMANDED)
        else:
            if motion.leg == "sine":
                done = int(self._block.cycles()) - FIRST_AND_LAST // 2
                self.cycles_done = min(int(motion.values["cycles"]), max(0, done))
            if status.done:
                self._finish(EndReason.REACHED)

    def _turn(self, motion: Motion, status: AxisStatus) -> None:
        """Take a static cycle on: the program turns it at the force, this here at the stroke."""
        values, now_s = motion.values, self._now_s()
        if motion.leg == "to zero" and status.done:
            self._out(motion)
        elif motion.leg == "out":
            by_force = self._block.has_turned()
            if not by_force and status.done:  # at the turning stroke
                self._block.set_turn(0.0, values["speed"])
                self._move(0.0, values["speed"])
            if by_force or status.done:
                motion.end = EndReason.FORCE_LIMIT if by_force else EndReason.REACHED
                motion.leg = "back"
        elif motion.leg == "back" and status.done:
            motion.cycles_done += 1
            self.cycles_done = motion.cycles_done
            if motion.cycles_done >= values["cycles"]:
                self._finish(motion.end)
            else:
                motion.leg, motion.since_s = "pause", now_s
        elif motion.leg == "pause" and now_s - motion.since_s >= values["static_pause"]:
            self._out(motion)

    def _out(self, motion: Motion) -> None:
        """Begin a static stroke: the watchdog program turns it at the force, within one of its loops."""
        values, motion.leg = motion.values, "out"
        self._block.set_turn(values["turning_force"], values["speed"])
        self._move(values["turning_stroke"], values["speed"])

    def _finish(self, why: EndReason) -> None:
        if self.motion is not None:
            self.done, self.end, self.motion = self.motion.sequence, why, None
