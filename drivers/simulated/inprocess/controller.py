"""The simulated controller without wires, behind the interface that the acquisition sees."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.controllers import FAULT_RESET, RESET_FORCE_MAX_KN, SWITCH_OFF, missed_cycles, parted
from bufferstand.drivers.interfaces import ControllerStatus, Identity, SampleBlock, StreamFacts, WriterSeen
from bufferstand.drivers.simulated.inprocess.link import InProcessLink
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import RATE_HZ, Command, CommandCode, RejectReason, SimulatedDevice
from bufferstand.drivers.simulated.machine import SimulatedController as Machine
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import (
    CommandRejected,
    ControllerMotion,
    DeviceFault,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
    WireLost,
)

BLOCK = 1000
"""Most samples of one block."""

_FIELDS = {
    **{name: name for name in ("state", "fault_code", "done_sequence", "end_reason", "cycles_done")},
    **{name: name for name in ("heartbeat", "watchdog_trips")},
    **{name: f"{name}_mm" for name in ("stroke", "position", "command")},
    "force": "force_kN",
    "tick": "tick_us",
}
"""Where the status has a register."""
_REASONS = {
    RejectReason.UNKNOWN_COMMAND: "unknown command",
    RejectReason.WRONG_STATE: "not possible in the present state",
    RejectReason.OUT_OF_RANGE: "a parameter is out of range",
    RejectReason.NOT_ARMED: "the command was not armed",
}

_CODES: dict[type[ControllerMotion], CommandCode] = {
    StandStill: CommandCode.HOLD,
    RampTo: CommandCode.RAMP,
    Harmonic: CommandCode.HARMONIC,
    StaticCycles: CommandCode.STATIC,
    Release: CommandCode.RELEASE,
}


class InProcessController:
    """Controller of :mod:`bufferstand.drivers.interfaces` on a simulated device.

    Parameters
    ----------
    device : SimulatedDevice
    stand_file : StandFile
        For channels and timeout.
    clock : VirtualClock
        That moves the device.
    block : int
        Most samples of one block.
    """

    facts: StreamFacts

    def __init__(
        self, device: SimulatedDevice, stand_file: StandFile, clock: VirtualClock, block: int = BLOCK
    ) -> None:
        self._device = device
        self._clock = clock
        self._link = InProcessLink(device, clock, stand_file.controller.timeout_s)
        self._block = block
        self._next = 0
        self._parts: deque[SampleBlock] = deque()
        self._feeds = 0
        self._stuck: dict[str, Any] = {}
        self._nan_said = False
        self._last_us: int | None = None
        self._outlast: Callable[[WireLost], object] | None = None
        self.can_adjust = device.controller.capabilities.adjusts
        """Whether it can change a running sine."""
        self._identity = Identity(
            device="simulated controller",
            address="in process",
            serial=str(device.settings.seed),
            profile="none (in process)",
            sample_rate_Hz=RATE_HZ,
        )
        self.facts = StreamFacts(
            "controller",
            "device",
            stand_file.controller.channel,
            RATE_HZ,
            f"{self._identity.device}, {self._identity.address}",
            simulated=True,
        )

    def connect(self) -> Identity:
        """Get who answers.

        Raises
        ------
        DeviceFault
            If the link is lost (a simulated fault).
        """
        with self._link.asking():
            return self._identity

    def skip_backlog(self, *, anew: bool = False) -> None:  # noqa: ARG002 - it counts on
        """Go on near the newest sample."""
        self._next = max(self._next, self._device.ring.total - self._block)

    def read_block(self) -> SampleBlock | None:
        """Get the next samples (None where there are none yet).

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        if self._parts:
            return self._parts.popleft()
        with self._link.asking():
            first, columns = self._device.ring.window(self._next, self._block)
        ticks = columns.pop("tick")
        if ticks.size == 0:
            return None
        lost = first - self._next
        if lost:
            self._link.events.append(
                f"{lost} samples lost before sequence {first}: the ring was read too late"
            )
        self._next = first + ticks.size
        # Here the sequence is known without wrapping, and so is the time.
        sequence = np.arange(first, self._next, dtype=np.int64)
        time_us = self._device.time_us(sequence)
        missed = self._missed(time_us, lost)
        block = SampleBlock(
            "controller", first, time_us, columns, lost, self._clock.now_s(), more=ticks.size == self._block
        )
        head, *rest = parted(block, missed)
        self._parts.extend(rest)
        return head

    def delivery(self) -> None:
        """Return nothing: there is no wire."""

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot.

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        with self._link.asking():
            return self._with_faults(self._shown(self._device.controller))

    def says_simulated(self) -> bool:
        """Return that it is a simulated one."""
        return True

    def other_writer(self) -> None:
        """Return nothing: in process there is no second program, and no lock."""

    def seen_writer(self) -> WriterSeen:
        """Get that there is no lock, and nobody else."""
        return WriterSeen(None)

    in_charge = True
    """In process there is no second program."""

    def look_at_lock(self) -> None:
        """Do nothing: there is no lock that could be lost."""

    def take_charge(self) -> None:
        """Do nothing: there is no lock."""

    def changed_limits(self) -> str:
        """Return nothing: it was never started anew."""
        return ""

    def give_back(self) -> None:
        """Do nothing: there is nobody to give it to."""

    def _with_faults(self, status: ControllerStatus) -> ControllerStatus:
        """Let registers be stuck, or no numbers, by a simulated fault."""
        faults, now_s = self._device.faults, self._clock.now_s()
        wrong: dict[str, Any] = {}
        if stuck := faults.find("controller", "stuck", now_s):
            name = _FIELDS.get(stuck.name("register"), "")
            if name:
                wrong[name] = self._stuck.setdefault(name, getattr(status, name))
        else:
            self._stuck.clear()
        nan = faults.find("controller", "nan", now_s)
        if nan is not None:
            name = nan.name("register")
            wrong[_FIELDS.get(name, "force_kN")] = math.nan
            if not self._nan_said:
                self._link.events.append(
                    f"register {name} of the controller holds nan, which is no number; "
                    "look at its transducer and at the controller's own messages"
                )
        self._nan_said = nan is not None
        return replace(status, **wrong)

    def _shown(self, controller: Machine) -> ControllerStatus:
        return ControllerStatus(
            state=controller.state,
            fault_code=int(controller.fault),
            done_sequence=controller.done_sequence,
            end_reason=controller.end_reason,
            cycles_done=controller.cycles_done,
            heartbeat=self._device.heartbeat,
            watchdog_trips=controller.watchdog.trips,
            force_kN=self._device.measured_force_kN,
            stroke_mm=self._device.measured_stroke_mm,
            position_mm=self._device.actuator.position_mm,
            command_mm=controller.command_mm,
            tick_us=self._device.tick_us(self._clock.now_s()),
        )

    def feed_watchdog(self) -> None:
        """Write the heartbeat.

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        with self._link.asking():
            self._feeds += 1
            self._device.controller.watchdog.feed(self._feeds & 0xFFFF)

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog, reset a latched fault, switch the actuator on.

        Raises
        ------
        CommandRejected
            If a limit is beyond the stand's.
        DeviceFault
            If the link is lost, or its own force is no number.
        """
        controller = self._device.controller
        with self._link.asking():
            kept = controller.set_force_limit(force_limit_kN) and controller.set_stroke_limit(stroke_limit_mm)
        if not kept:
            raise CommandRejected(
                f"the controller refused limits of {force_limit_kN:g} kN and {stroke_limit_mm:g} mm: "
                f"the stand has {controller.capabilities.force_max_kN:g} kN and "
                f"{controller.capabilities.stroke_max_mm:g} mm"
            )
        controller.watchdog.set_time(watchdog_ms)
        self.feed_watchdog()
        self.reset_fault()
        if not math.isfinite(shown_kN := self.status().force_kN):
            raise DeviceFault(f"the simulated controller was not switched on: its own force reads {shown_kN}")
        controller.control(0x000F)

    def reset_fault(self) -> None:
        """Reset a latched fault, where there is one; the valve stays off.

        Raises
        ------
        DeviceFault
            If the valve is still on or force is left, or the link is lost.
        """
        controller, force_kN = self._device.controller, self._device.measured_force_kN
        with self._link.asking():
            code = int(controller.fault)
            if not code:
                return
            if controller.valve_on or not abs(force_kN) <= RESET_FORCE_MAX_KN:
                valve = "on" if controller.valve_on else "off"
                raise DeviceFault(
                    f"the simulated controller: fault {code} was not reset: the force is {force_kN:.1f} kN, "
                    f"the valve {valve}; unload the specimen and start again"
                )
            controller.control(SWITCH_OFF)
            controller.control(FAULT_RESET)
            controller.control(SWITCH_OFF)
        self._link.events.append(f"fault {code} of the controller was reset")

    stops_at_once = True
    """There is no wire."""

    @property
    def taken_us(self) -> int:
        """The device's clock: a command is taken when it is given [µs, modulo 2³²]."""
        return self._device.tick_us(self._clock.now_s())

    @contextmanager
    def look_between(
        self,
        look: Callable[[], object],  # noqa: ARG002 - a command takes no time
        outlast: Callable[[WireLost], object] | None = None,
    ) -> Iterator[None]:
        """Inside, ``outlast`` is called where a command meets a lost link; it is given again afterwards."""
        before, self._outlast = self._outlast, outlast
        try:
            yield
        finally:
            self._outlast = before

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:  # noqa: ARG002 - no wire
        """Begin a motion; get its sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        figures = asdict(motion)
        if isinstance(motion, StaticCycles):
            figures["turning_force_kN"] = figures.pop("force_limit_kN")
            figures["turning_stroke_mm"] = figures.pop("stroke_limit_mm")
        return self._give(motion.text, _CODES[type(motion)], **figures)

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        """Bring the running sine to another mean and amplitude over one cycle.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        text = f"adjusting to {mean_mm:g} ± {amplitude_mm:g} mm"
        self._give(text, CommandCode.ADJUST, mean_mm=mean_mm, amplitude_mm=amplitude_mm)

    def prepare(self, release: Release) -> None:
        """Do nothing: a release takes one call as it is."""

    def disable(self) -> None:
        """Switch the actuator's valve off.

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        with self._link.asking():
            self._device.controller.control(0x0000)

    def events(self) -> Sequence[str]:
        """Get (and forget) what happened since the last call."""
        kept, self._link.events = self._link.events, []
        return kept

    def close(self) -> None:
        """Let go: nothing to do."""

    def _missed(self, time_us: NDArray[np.int64], lost: int) -> list[tuple[int, int]]:
        """Return where cycles were missed; refuse a clock that jumps, as the driver of a ring does."""
        period_us = 1e6 / RATE_HZ
        last_us = int(time_us[0]) - period_us * (lost + 1) if self._last_us is None else self._last_us
        steps = np.diff(time_us, prepend=last_us + lost * period_us)
        self._last_us = int(time_us[-1])
        missed: list[tuple[int, int]] = []
        for row in np.flatnonzero(np.abs(steps - period_us) > 0.5 * period_us):
            cycles = missed_cycles(float(steps[row]), period_us)
            if cycles is None:
                raise DeviceFault(
                    "the simulated controller: two blocks of samples running cannot be true: the tick steps "
                    f"by {steps[row]:.0f} µs, {period_us:g} µs would be right; look at the faults that were "
                    "given"
                )
            missed.append((int(row), cycles))
        return missed

    def _give(self, text: str, code: CommandCode, **parameters: float) -> int:
        while True:
            try:
                return self._give_once(text, code, **parameters)
            except WireLost as lost:  # nothing of it was done
                if self._outlast is None:
                    raise
                self._outlast(lost)

    def _give_once(self, text: str, code: CommandCode, **parameters: float) -> int:
        controller = self._device.controller
        sequence = controller.echo_sequence % 0xFFFF + 1  # 0 means “none yet”
        command = Command(sequence, int(code), **parameters)  # type: ignore[arg-type]
        with self._link.asking():
            verdicts = (controller.arm(command), controller.execute(sequence))
        for verdict in verdicts:
            if verdict is not RejectReason.ACCEPTED:
                raise CommandRejected(f"the simulated controller rejected {text}: {_REASONS[verdict]}")
        return sequence
