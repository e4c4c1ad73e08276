"""The controller's state machine, as the register profile ``ring`` describes it; it knows no wires.

Commands are armed, judged and then executed; motions end by themselves, by a command, by the device's own
limits or by the watchdog, which runs on wall time and leads to zero force with the valve off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.simulated.machine.commands import (
    AT_MEAN_MM,
    AT_ZERO_MM,
    ENABLE_OPERATION,
    ENABLE_VOLTAGE,
    FAULT_RESET,
    FLOAT32_SLACK,
    KNOWN_CODES,
    QUICK_STOP_OFF,
    SWITCH_ON,
    Capabilities,
    Command,
    CommandCode,
    ControllerFault,
    RejectReason,
    StatusBit,
    in_range,
)
from bufferstand.drivers.simulated.machine.motions import (
    HarmonicMotion,
    HoldMotion,
    Motion,
    RampMotion,
    ReleaseMotion,
    StaticMotion,
)
from bufferstand.drivers.simulated.machine.watchdog import Watchdog


class SimulatedController:
    """Judges commands, makes them motions, watches limits.

    Parameters
    ----------
    capabilities : Capabilities
    dt_s : float
        Sample period in the controller's own time [s].
    wall_s : callable
        Monotonic wall time [s], for the watchdog.
    """

    def __init__(self, capabilities: Capabilities, dt_s: float, wall_s: Callable[[], float]) -> None:
        self.capabilities = capabilities
        self._dt_s = dt_s
        self.watchdog = Watchdog(wall_s)
        self._force_limit_kN = capabilities.force_max_kN
        self._stroke_limit_mm = capabilities.stroke_max_mm
        self._set_trips()
        self._control_word = 0
        self._armed: Command | None = None
        self._executed: Command | None = None
        self._motion: Motion = HoldMotion(0, 0.0)
        self._running = False
        self._rate_mm = 0.0
        self._force_kN = 0.0
        self.valve_on = False
        self.state = MotionState.OFF
        self.fault = ControllerFault.NONE
        self.echo_sequence = 0
        self.reject = RejectReason.ACCEPTED
        self.done_sequence = 0
        self.end_reason = EndReason.NONE
        self.cycles_done = 0
        self.command_mm = 0.0
        self.position_mm = 0.0

    # --- every sample -------------------------------------------------------------------------------

    def step(self, force_kN: float, position_mm: float) -> float:
        """Take one sample of the controller's own transducers; return the next command [mm]."""
        self._force_kN = force_kN
        self.position_mm = position_mm
        if not self.valve_on:
            self.command_mm = position_mm
            return position_mm
        if self.fault is ControllerFault.NONE:
            if force_kN > self._trip_kN:
                self._trip(ControllerFault.FORCE_LIMIT, EndReason.DEVICE_LIMIT)
            elif position_mm > self._trip_mm:
                self._trip(ControllerFault.STROKE_LIMIT, EndReason.DEVICE_LIMIT)
        motion = self._motion
        before = self.command_mm
        command = self.command_mm = motion.advance(force_kN, position_mm)
        self._rate_mm = command - before
        if self._running:
            self.cycles_done = motion.cycles_done
            if motion.end is not EndReason.NONE:
                self._arrive(motion)
        return command

    def still_samples(self) -> int:
        """Return for how many samples the command is sure to stay as it is, valve on."""
        return self._motion.still_samples() if self.valve_on and self._rate_mm == 0.0 else 0

    def skip(self, samples: int) -> None:
        """Let samples pass at once, not more than ``still_samples()``."""
        self._motion.skip(samples)

    def look_at_watchdog(self) -> None:
        """Let wall time count; fall back to zero force if the heartbeat is missing."""
        if self.watchdog.look() and self.valve_on and self.fault is ControllerFault.NONE:
            self.watchdog.trips += 1
            self._trip(ControllerFault.WATCHDOG, EndReason.WATCHDOG)

    def fail(self, fault: ControllerFault) -> None:
        """Give up for a reason of its own (a simulated fault): fall back to zero force, valve off."""
        if self.fault is ControllerFault.NONE:
            self._trip(fault, EndReason.DEVICE_LIMIT)
            if not self.valve_on:
                self._arrive(self._motion)

    # --- commands -----------------------------------------------------------------------------------

    def arm(self, command: Command) -> RejectReason:
        """Judge a command and keep it for :meth:`execute`.

        The same command once more, while it is being executed, is a repeated request and changes nothing.
        """
        self.echo_sequence = command.sequence
        if self._running and command == self._executed:
            self.reject = RejectReason.ACCEPTED
            return self.reject
        self.reject = self._judge(command)
        self._armed = command if self.reject is RejectReason.ACCEPTED else None
        return self.reject

    def execute(self, sequence: int) -> RejectReason:
        """Start the armed command of that sequence; a repeated request for a started one changes nothing."""
        command = self._armed
        self.echo_sequence = sequence
        if command is None or command.sequence != sequence:
            repeated = self._executed is not None and self._executed.sequence == sequence
            self.reject = RejectReason.ACCEPTED if repeated else RejectReason.NOT_ARMED
            return self.reject
        self.reject = self._judge(command)
        self._armed = None
        if self.reject is RejectReason.ACCEPTED:
            self._executed = command
            if command.code == CommandCode.ADJUST and isinstance(self._motion, HarmonicMotion):
                self._motion.adjust(command.mean_mm, command.amplitude_mm)
            else:
                self._start(self._motion_of(command))
        return self.reject

    def set_force_limit(self, limit_kN: float) -> bool:
        """Set the device's force limit [kN]; return whether it was acceptable (0 < limit <= the stand's)."""
        accepted = 0.0 < limit_kN <= self.capabilities.force_max_kN * (1.0 + FLOAT32_SLACK)
        if accepted:
            self._force_limit_kN = limit_kN
            self._set_trips()
        return accepted

    def set_stroke_limit(self, limit_mm: float) -> bool:
        """Set the device's stroke limit [mm]; return whether it was acceptable (0 < limit <= the stand's)."""
        accepted = 0.0 < limit_mm <= self.capabilities.stroke_max_mm * (1.0 + FLOAT32_SLACK)
        if accepted:
            self._stroke_limit_mm = limit_mm
            self._set_trips()
        return accepted

    def control(self, word: int) -> None:
        """Take a control word: switch on or off, quick stop, fault reset on the rising edge of bit 7."""
        edge = word & ~self._control_word
        self._control_word = word
        if edge & FAULT_RESET and self.state is MotionState.FAULT:
            self.fault = ControllerFault.NONE
            self.state = MotionState.OFF
        operate = word & SWITCH_ON and word & ENABLE_VOLTAGE and word & ENABLE_OPERATION
        if not operate:
            self._switch_off()
        elif not word & QUICK_STOP_OFF:
            self._quick_stop()
        elif not self.valve_on and self.fault is ControllerFault.NONE:
            self.valve_on = True
            self.watchdog.restart()
            self.command_mm = self.position_mm
            self._rate_mm = 0.0
            self._motion = HoldMotion(0, self.position_mm)
            self.state = MotionState.HOLDING

    @property
    def status_word(self) -> int:
        """The status word, bits as CiA 402."""
        word = int(StatusBit.REMOTE)
        if self._control_word & QUICK_STOP_OFF:
            word |= StatusBit.QUICK_STOP_INACTIVE
        if self.fault is not ControllerFault.NONE:
            word |= StatusBit.FAULT
        if self.valve_on:
            word |= StatusBit.READY | StatusBit.SWITCHED_ON | StatusBit.ENABLED | StatusBit.VOLTAGE
        elif self.state is MotionState.READY:
            word |= StatusBit.READY | StatusBit.VOLTAGE
            if self._control_word & SWITCH_ON:
                word |= StatusBit.SWITCHED_ON
        elif self.fault is ControllerFault.NONE:
            word |= StatusBit.SWITCH_ON_DISABLED
        if not self._running and self.end_reason is EndReason.REACHED:
            word |= StatusBit.TARGET_REACHED
        if self._force_kN >= self._force_limit_kN or self.position_mm >= self._stroke_limit_mm:
            word |= StatusBit.LIMIT_ACTIVE
        return word

    @property
    def force_limit_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Force limit in force [kN]."""
        return self._force_limit_kN

    @property
    def stroke_limit_mm(self) -> float:
        """Stroke limit in force [mm]."""
        return self._stroke_limit_mm

    # --- inside -------------------------------------------------------------------------------------

    def _set_trips(self) -> None:
        self._trip_kN = self._force_limit_kN * self.capabilities.force_trip_ratio
        self._trip_mm = self._stroke_limit_mm + self.capabilities.stroke_trip_mm

    def _start(self, motion: Motion) -> None:
        self._finish(EndReason.COMMANDED)
        if self.done_sequence == motion.sequence:
            self.done_sequence = 0  # an earlier user's number: it must not look done before it has begun
        self._motion = motion
        self._running = True
        self.state = motion.state
        self.cycles_done = 0
        if isinstance(motion, HoldMotion) and motion.stands_at(self.position_mm):
            # Nothing is left to do. A stand that waits for its reader may make no next sample to say so.
            self._arrive(motion)

    def _finish(self, why: EndReason) -> None:
        """Note that the running motion has ended; why a commanded one did outlasts the fallback after it."""
        if self._running:
            self._running = False
            if self._motion.sequence:
                self.end_reason = why
                self.done_sequence = self._motion.sequence

    def _arrive(self, motion: Motion) -> None:
        self._finish(motion.end)
        self._motion = HoldMotion(0, self.command_mm)
        self.state = MotionState.HOLDING
        if self.fault is not ControllerFault.NONE:
            self.valve_on = False
            self.state = MotionState.FAULT

    def _trip(self, fault: ControllerFault, why: EndReason) -> None:
        """Give up: note why, then retract to zero force."""
        self._finish(why)
        self.fault = fault
        self._armed = None
        step = self.capabilities.fallback_speed_mm_per_s * self._dt_s
        self._motion = ReleaseMotion(0, self.command_mm, step)
        self._running = True
        self.state = MotionState.RELEASING

    def _switch_off(self) -> None:
        if self.valve_on:
            self._finish(EndReason.COMMANDED)
            self._motion = HoldMotion(0, self.position_mm)
            self.valve_on = False
        self._armed = None
        if self.fault is not ControllerFault.NONE:
            self.state = MotionState.FAULT
        else:
            powered = self._control_word & ENABLE_VOLTAGE and self._control_word & QUICK_STOP_OFF
            self.state = MotionState.READY if powered else MotionState.OFF

    def _quick_stop(self) -> None:
        self._armed = None
        if self.valve_on and self.fault is ControllerFault.NONE:
            self._finish(EndReason.COMMANDED)
            self._motion = HoldMotion(0, self.command_mm)
            self.state = MotionState.HOLDING

    def _motion_of(self, command: Command) -> Motion:
        sequence, at = command.sequence, self.command_mm
        step = command.speed_mm_per_s * self._dt_s
        match command.code:
            case CommandCode.HOLD:
                return HoldMotion(sequence, at, self._rate_mm, self._deceleration_mm())
            case CommandCode.RAMP:
                return RampMotion(sequence, at, command.target_mm, step)
            case CommandCode.HARMONIC:
                return HarmonicMotion(
                    sequence,
                    command.mean_mm,
                    command.amplitude_mm,
                    command.frequency_Hz,
                    command.cycles,
                    self._dt_s,
                )
            case CommandCode.STATIC:
                return StaticMotion(
                    sequence,
                    at,
                    step,
                    command.turning_force_kN,
                    command.turning_stroke_mm,
                    command.cycles,
                    round(command.pause_s / self._dt_s),
                )
            case _:
                return ReleaseMotion(sequence, at, step)

    def _deceleration_mm(self) -> float:
        """Change of the command's rate per sample with which a hold begins: other motions than a sine stop at
        once, as they start.
        """
        return self._motion.deceleration_mm() if isinstance(self._motion, HarmonicMotion) else 0.0

    # --- judging ------------------------------------------------------------------------------------

    def _judge(self, command: Command) -> RejectReason:
        if command.code not in KNOWN_CODES or (
            command.code == CommandCode.ADJUST and not self.capabilities.adjusts
        ):
            return RejectReason.UNKNOWN_COMMAND
        operational = (
            self.valve_on and self.fault is ControllerFault.NONE and self._control_word & QUICK_STOP_OFF
        )
        if not operational or command.sequence == 0:
            return RejectReason.WRONG_STATE
        if command.code == CommandCode.ADJUST:
            return self._judge_adjusting(command)
        if not in_range(command, self.capabilities, self._force_limit_kN, self._stroke_limit_mm):
            return RejectReason.OUT_OF_RANGE
        return RejectReason.ACCEPTED if self._ready_for(command) else RejectReason.WRONG_STATE

    def _ready_for(self, command: Command) -> bool:
        """Return whether a motion may begin: nothing moves, and it stands where it must."""
        if command.code in {CommandCode.RAMP, CommandCode.HARMONIC, CommandCode.STATIC} and self._running:
            return False  # a motion in progress is ended by hold or release only
        if command.code == CommandCode.HARMONIC:
            return abs(self.command_mm - command.mean_mm) <= AT_MEAN_MM
        return command.code != CommandCode.STATIC or abs(self.command_mm) <= AT_ZERO_MM

    def _judge_adjusting(self, command: Command) -> RejectReason:
        """Judge a change of the running sine: as a sine, and by the speed on the way."""
        motion = self._motion
        if not (self._running and isinstance(motion, HarmonicMotion) and motion.adjustable):
            return RejectReason.WRONG_STATE
        mean_mm, amplitude_mm = command.mean_mm, command.amplitude_mm
        as_sine = replace(command, code=int(CommandCode.HARMONIC), frequency_Hz=motion.frequency_Hz, cycles=1)
        speed = motion.peak_speed_mm_per_s(mean_mm, amplitude_mm)
        fits = in_range(as_sine, self.capabilities, self._force_limit_kN, self._stroke_limit_mm)
        if not fits or speed > self.capabilities.speed_max_mm_per_s * (1.0 + FLOAT32_SLACK):
            return RejectReason.OUT_OF_RANGE
        return RejectReason.ACCEPTED
