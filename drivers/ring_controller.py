"""The actuator controller behind Modbus TCP: identity, sample ring, commands, on and off, watchdog."""

from __future__ import annotations

import math
from collections.abc import Sequence

from drivers import command_port as command
from drivers.actuator_switch import ActuatorSwitch
from drivers.interfaces import (
    ControllerStatus,
    EndReason,
    Identity,
    MotionState,
    SampleBlock,
    StreamFacts,
)
from drivers.modbus_link import ModbusLink
from drivers.profile import Profile
from drivers.register_panel import RegisterPanel
from drivers.ring_identity import find_mismatch
from drivers.ring_reader import DoubtfulBlock, RingReader
from foundation.channel import Channel
from foundation.clock import Clock

STREAM = "controller"


class RingController:
    """Controller of :mod:`drivers.interfaces` over one Modbus link; all methods from one thread.

    Parameters
    ----------
    link : ModbusLink
        The wire; this object owns it.
    profile : Profile
        The register map.
    channels : sequence of Channel
        One for each value of a ring sample.
    clock : Clock
        Stand time, for the stamps of reception.
    timeout_s : float
        Longest wait for the controller to judge a command or change its state [s].
    """

    facts: StreamFacts

    def __init__(
        self,
        link: ModbusLink,
        profile: Profile,
        channels: Sequence[Channel],
        clock: Clock,
        *,
        timeout_s: float = 0.5,
    ) -> None:
        self._link = link
        self._profile = profile
        self._clock = clock
        by_name = {channel.name: channel for channel in channels}
        order = [name for name, _ in profile.ring.sample if name != "tick"]
        self._channels = tuple(by_name[name] for name in order)
        self._panel = RegisterPanel(link, profile, timeout_s)
        self._commands = command.CommandPort(self._panel)
        self._switch = ActuatorSwitch(self._panel)
        self._reader: RingReader | None = None
        self.facts = StreamFacts(
            STREAM, "device", self._channels, 0.0, f"{profile.facts.id} at {link.address}"
        )

    def connect(self) -> Identity:
        """Open the wire, check identity and test-value registers; get who answers.

        Calling it again checks again and forgets nothing.

        Raises
        ------
        DeviceFault
            If nobody answers, or what answers is not what the profile describes.
        """
        window = self._profile.block("device_type", "sample_rate")
        registers = self._link.read(window.address, window.words, "identity and test values")
        if mismatch := find_mismatch(self._profile, window, registers):
            raise self._panel.fault(mismatch)
        values = window.decode(registers)
        rate_Hz = float(values["sample_rate"])
        if not (math.isfinite(rate_Hz) and rate_Hz > 0.0):
            raise self._panel.fault(f"it states a sample rate of {rate_Hz} Hz; look at its configuration")
        facts = self._profile.facts
        device = f"{facts.id} edition {facts.edition} at {self._link.address}, serial {values['serial']}"
        if self._reader is None:
            self._reader = RingReader(self._profile, rate_Hz)
        elif rate_Hz != self.facts.rate_Hz:
            raise self._panel.fault(f"its sample rate changed from {self.facts.rate_Hz:g} to {rate_Hz:g} Hz")
        self.facts = StreamFacts(STREAM, "device", self._channels, rate_Hz, device)
        return Identity(
            device=facts.id,
            address=self._link.address,
            serial=str(values["serial"]),
            profile=f"{facts.id} edition {facts.edition} sha256 {self._profile.hash}",
            sample_rate_Hz=rate_Hz,
        )

    def read_block(self) -> SampleBlock | None:
        """Get the next samples from the ring (None where there are none yet) and acknowledge the last.

        One transaction; a doubtful block is asked for once more.

        Raises
        ------
        DeviceFault
            If the wire fails, or two blocks running cannot be true.
        """
        reader = self._reader
        if reader is None:
            raise self._panel.fault("samples were asked for before connecting; call connect() first")
        ring = self._profile.ring
        for attempt in (1, 2):
            registers = self._link.exchange(
                read_address=ring.address,
                read_count=ring.registers,
                write_address=self._profile.find("ring_acknowledge").address,
                values=self._profile.encode("ring_acknowledge", reader.acknowledge),
                what="the sample ring",
            )
            received_s = self._clock.now_s()
            try:
                rows = reader.take(registers)
            except DoubtfulBlock as doubt:
                self._link.note(f"block of samples refused: {doubt}")
                if attempt == 2:
                    raise self._panel.fault(
                        f"two blocks of samples running cannot be true: {doubt}; "
                        "look at the controller's event log, and whether a second program talks to it"
                    ) from None
                continue
            break
        for event in reader.events:
            self._link.note(event)
        reader.events.clear()
        if rows is None:
            return None
        return SampleBlock(STREAM, rows.first_sequence, rows.time_us, rows.counts, rows.lost, received_s)

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot (one transaction).

        Raises
        ------
        DeviceFault
            If the wire fails, or the state is none that the profile knows.
        """
        values = self._panel.read_status()
        try:
            state, end_reason = MotionState(int(values["state"])), EndReason(int(values["end_reason"]))
        except ValueError as error:
            raise self._panel.fault(f"status registers: {error}; look at the register profile") from None
        return ControllerStatus(
            state=state,
            fault_code=int(values["fault_code"]),
            done_sequence=int(values["done_sequence"]),
            end_reason=end_reason,
            cycles_done=int(values["cycles_done"]),
            heartbeat=int(values["heartbeat"]),
            watchdog_trips=int(values["watchdog_trips"]),
            force_kN=float(values["force"]),
            stroke_mm=float(values["stroke"]),
            position_mm=float(values["position"]),
            command_mm=float(values["command"]),
        )

    def feed_watchdog(self) -> None:
        """Write the heartbeat; without it the controller falls back to zero force by itself.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        self._switch.feed_watchdog()

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog, read them back, and switch the actuator on (it holds).

        A latched fault is reset first, as an event. An actuator that is on already stays on.

        Parameters
        ----------
        force_limit_kN, stroke_limit_mm
            Limits that the device itself keeps.
        watchdog_ms : int
            Longest time without a heartbeat [ms], 1 to 65535.

        Raises
        ------
        CommandRejected
            If a value is none that can be sent.
        DeviceFault
            If the wire fails, the device keeps other values, or a state is not reached in time.
        """
        self._switch.enable(
            force_limit_kN=force_limit_kN, stroke_limit_mm=stroke_limit_mm, watchdog_ms=watchdog_ms
        )

    def start_hold(self) -> int:
        """Stop where it stands and hold; get the motion's sequence number.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        return self._commands.give(command.HOLD, "hold")

    def start_ramp(self, *, target_mm: float, speed_mm_per_s: float) -> int:
        """Move to a stroke at constant speed; get the motion's sequence number.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        text = f"ramp to {target_mm:g} mm at {speed_mm_per_s:g} mm/s"
        return self._commands.give(command.RAMP, text, target=target_mm, speed=speed_mm_per_s)

    def start_harmonic(self, *, mean_mm: float, amplitude_mm: float, frequency_Hz: float, cycles: int) -> int:
        """Sine about ``mean_mm`` (where it must stand already); get the motion's sequence number.

        Parameters
        ----------
        mean_mm, amplitude_mm
            Mean stroke and half the range.
        frequency_Hz : float
            Of the sine.
        cycles : int
            Cycles at full amplitude, besides one in and one out.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        text = f"{cycles} cycles of {mean_mm:g} ± {amplitude_mm:g} mm at {frequency_Hz:g} Hz"
        return self._commands.give(
            command.HARMONIC,
            text,
            mean=mean_mm,
            amplitude=amplitude_mm,
            frequency=frequency_Hz,
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
        """Compress from zero to a limit and unload at once, ``cycles`` times; get the sequence number.

        Parameters
        ----------
        speed_mm_per_s : float
            Of both branches.
        force_limit_kN, stroke_limit_mm
            It turns at whichever comes first.
        cycles : int
            How often.
        pause_s : float
            Between two cycles.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        text = f"{cycles} static cycles to {force_limit_kN:g} kN or {stroke_limit_mm:g} mm"
        return self._commands.give(
            command.STATIC,
            text,
            speed=speed_mm_per_s,
            turning_force=force_limit_kN,
            turning_stroke=stroke_limit_mm,
            cycles=cycles,
            static_pause=pause_s,
        )

    def start_release(self, *, speed_mm_per_s: float) -> int:
        """Ramp to zero force; get the motion's sequence number.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        return self._commands.give(
            command.RELEASE, f"release at {speed_mm_per_s:g} mm/s", speed=speed_mm_per_s
        )

    def disable(self) -> None:
        """Switch the actuator's valve off, and see that it is.

        Raises
        ------
        DeviceFault
            If the wire fails or the actuator stays on.
        """
        self._switch.disable()

    def events(self) -> Sequence[str]:
        """Get (and forget) what happened on the wire since the last call: retries, gaps."""
        return self._link.events()

    def close(self) -> None:
        """Let go of the wire; never raises."""
        self._link.close()
