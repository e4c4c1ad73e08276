"""The simulated controller without wires, behind the interface that the acquisition sees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces import (
    CommandRejected,
    ControllerStatus,
    DeviceFault,
    Identity,
    SampleBlock,
    StreamFacts,
)
from drivers.modbus_link import EXCEPTION_TEXTS
from drivers.simulated.commands import Code, Command, Fault, Reject
from drivers.simulated.controller import Controller as Machine
from drivers.simulated.device import RATE_HZ, SimulatedDevice
from drivers.simulated.virtual_clock import VirtualClock
from drivers.stand_file import StandFile

BLOCK = 1000
"""Most samples of one block."""

_LOSING = ("drop", "corrupt", "reorder", "delay", "request-drop", "request-corrupt")
"""Faults of frames after which the driver of a real controller asks once more."""
_FIELDS = {
    **{name: name for name in ("state", "fault_code", "done_sequence", "end_reason", "cycles_done")},
    **{name: name for name in ("heartbeat", "watchdog_trips")},
    **{name: f"{name}_mm" for name in ("stroke", "position", "command")},
    "force": "force_kN",
    "tick": "tick_us",
}
"""Where the status has a register."""
_REASONS = {
    Reject.UNKNOWN_COMMAND: "unknown command",
    Reject.WRONG_STATE: "not possible in the present state",
    Reject.OUT_OF_RANGE: "a parameter is out of range",
    Reject.NOT_ARMED: "the command was not armed",
}


class InProcessController:
    """Controller of :mod:`drivers.interfaces` on a simulated device.

    Parameters
    ----------
    device : SimulatedDevice
    stand_file : StandFile
        For channels and timeout.
    clock : VirtualClock
        That moves the device.
    """

    facts: StreamFacts

    def __init__(self, device: SimulatedDevice, stand_file: StandFile, clock: VirtualClock) -> None:
        self._device = device
        self._clock = clock
        self._timeout_s = stand_file.controller.timeout_s
        self._next = 0
        self._feeds = 0
        self._events: list[str] = []
        self._stuck: dict[str, Any] = {}
        self._nan_said = False
        self._last_us: int | None = None
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
        )

    def connect(self) -> Identity:
        """Get who answers.

        Raises
        ------
        DeviceFault
            If the link is lost (a simulated fault).
        """
        self._reach()
        return self._identity

    def skip_backlog(self) -> None:
        """Go on near the newest sample."""
        self._next = max(self._next, self._device.ring.total - BLOCK)

    def read_block(self) -> SampleBlock | None:
        """Get the next samples (None where there are none yet).

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        self._reach()
        first, columns = self._device.ring.window(self._next, BLOCK)
        ticks = columns.pop("tick")
        if ticks.size == 0:
            return None
        lost = first - self._next
        if lost:
            self._events.append(f"{lost} samples lost before sequence {first}: the ring was read too late")
        self._next = first + ticks.size
        # Here the sequence is known without wrapping, and so is the time.
        sequence = np.arange(first, self._next, dtype=np.int64)
        time_us = self._device.time_us(sequence)
        self._demand_even(time_us, lost)
        return SampleBlock("controller", first, time_us, columns, lost, self._clock.now_s())

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot.

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        self._reach()
        controller = self._device.controller
        return self._with_faults(self._shown(controller))

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
                self._events.append(
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
        self._reach()
        self._feeds += 1
        self._device.controller.watchdog.feed(self._feeds & 0xFFFF)

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog, reset a latched fault, switch the actuator on.

        Raises
        ------
        CommandRejected
            If a limit is beyond the stand's.
        DeviceFault
            If the link is lost.
        """
        self._reach()
        controller = self._device.controller
        if not (controller.set_force_limit(force_limit_kN) and controller.set_stroke_limit(stroke_limit_mm)):
            raise CommandRejected(
                f"the controller refused limits of {force_limit_kN:g} kN and {stroke_limit_mm:g} mm: "
                f"the stand has {controller.capabilities.force_max_kN:g} kN and "
                f"{controller.capabilities.stroke_max_mm:g} mm"
            )
        controller.watchdog.set_time(watchdog_ms)
        self.feed_watchdog()
        if controller.fault is not Fault.NONE:
            self._events.append(f"fault {int(controller.fault)} of the controller was reset")
            controller.control(0x0000)
            controller.control(0x0080)
        controller.control(0x000F)

    def start_hold(self) -> int:
        """Stop where it stands and hold; get the motion's sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        return self._give("hold", Code.HOLD)

    def start_ramp(self, *, target_mm: float, speed_mm_per_s: float) -> int:
        """Move to a stroke at constant speed; get the motion's sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        text = f"ramp to {target_mm:g} mm at {speed_mm_per_s:g} mm/s"
        return self._give(text, Code.RAMP, target_mm=target_mm, speed_mm_per_s=speed_mm_per_s)

    def start_harmonic(self, *, mean_mm: float, amplitude_mm: float, frequency_Hz: float, cycles: int) -> int:
        """Sine about ``mean_mm``, where it must stand already; get the motion's sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        return self._give(
            f"{cycles} cycles of {mean_mm:g} ± {amplitude_mm:g} mm at {frequency_Hz:g} Hz",
            Code.HARMONIC,
            mean_mm=mean_mm,
            amplitude_mm=amplitude_mm,
            frequency_Hz=frequency_Hz,
            cycles=cycles,
        )

    def start_static(
        self,
        *,
        speed_mm_per_s: float,
        force_limit_kN: float,
        stroke_limit_mm: float,
        cycles: int,
        pause_s: float,
    ) -> int:
        """Compress from zero at constant speed to a limit and unload at once; get the sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        return self._give(
            f"{cycles} static cycles to {force_limit_kN:g} kN or {stroke_limit_mm:g} mm",
            Code.STATIC,
            speed_mm_per_s=speed_mm_per_s,
            turning_force_kN=force_limit_kN,
            turning_stroke_mm=stroke_limit_mm,
            cycles=cycles,
            pause_s=pause_s,
        )

    def start_release(self, *, speed_mm_per_s: float) -> int:
        """Ramp to zero force; get the motion's sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            If the controller refuses; if the link is lost.
        """
        return self._give(f"release at {speed_mm_per_s:g} mm/s", Code.RELEASE, speed_mm_per_s=speed_mm_per_s)

    def disable(self) -> None:
        """Switch the actuator's valve off.

        Raises
        ------
        DeviceFault
            If the link is lost.
        """
        self._reach()
        self._device.controller.control(0x0000)

    def events(self) -> Sequence[str]:
        """Get (and forget) what happened since the last call."""
        kept, self._events = self._events, []
        return kept

    def close(self) -> None:
        """Let go: nothing to do."""

    def _reach(self) -> None:
        """Fail as a real link does: after its timeout, during which the stand goes on."""
        faults, now_s = self._device.faults, self._clock.now_s
        if faults.find("controller", "lost", now_s()):
            self._clock.sleep(2.0 * self._timeout_s)
            raise DeviceFault(
                "the simulated controller does not answer: its link is lost (a simulated fault); "
                "look at the faults that were given"
            )
        if fault := faults.strikes("controller", "exception", now_s()):
            code = int(fault.number("code"))
            raise DeviceFault(
                f"the simulated controller refused with Modbus exception {code} "
                f"({EXCEPTION_TEXTS.get(code, 'unknown')}); look at the faults that were given"
            )
        for attempt in (1, 2):
            struck = next((kind for kind in _LOSING if self._loses(kind)), None)
            if struck is None:
                return
            self._clock.sleep(self._timeout_s)
            further = "sent once more on a new connection" if attempt == 1 else "given up"
            self._events.append(f"no true reply ({struck}, a simulated fault); connection closed, {further}")
        raise DeviceFault(
            "the simulated controller: no true reply, twice; look at the faults that were given"
        )

    def _loses(self, kind: str) -> bool:
        """Return whether a fault of that kind keeps a reply from coming in time."""
        fault = self._device.faults.strikes("controller", kind, self._clock.now_s())
        if fault is not None and kind == "delay" and fault.number("delay_s") <= self._timeout_s:
            self._clock.sleep(fault.number("delay_s"))
            return False
        return fault is not None

    def _demand_even(self, time_us: NDArray[np.int64], lost: int) -> None:
        """Refuse samples whose clock does not step by the sample period, as the driver of a ring does."""
        period_us = 1e6 / RATE_HZ
        steps = (time_us[1:] - time_us[:-1]).astype(np.float64)
        if self._last_us is not None:
            steps = np.append(int(time_us[0]) - self._last_us - lost * period_us, steps)
        self._last_us = int(time_us[-1])
        bad = steps[np.abs(steps - period_us) > 0.5 * period_us]
        if bad.size:
            raise DeviceFault(
                "the simulated controller: two blocks of samples running cannot be true: the tick steps by "
                f"{bad[0]:.0f} µs, {period_us:g} µs would be right; look at the faults that were given"
            )

    def _give(self, text: str, code: Code, **parameters: float) -> int:
        self._reach()
        controller = self._device.controller
        sequence = controller.echo_sequence % 0xFFFF + 1  # 0 means “none yet”
        command = Command(sequence, int(code), **parameters)  # type: ignore[arg-type]
        for verdict in (controller.arm(command), controller.execute(sequence)):
            if verdict is not Reject.ACCEPTED:
                raise CommandRejected(f"the simulated controller rejected {text}: {_REASONS[verdict]}")
        return sequence
