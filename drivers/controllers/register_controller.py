"""What every controller behind registers can do: identity, state, commands, on and off."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from bufferstand.drivers.controllers import command_port as command
from bufferstand.drivers.controllers.actuator_switch import ActuatorSwitch
from bufferstand.drivers.controllers.identity import find_mismatch
from bufferstand.drivers.controllers.named_registers import NamedRegisters
from bufferstand.drivers.controllers.writer_lock import WriterLock
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
from bufferstand.drivers.interfaces import (
    ControllerStatus,
    EndReason,
    Finding,
    FindsOut,
    Identity,
    MotionState,
    WriterSeen,
)
from bufferstand.drivers.modbus import ModbusLink, ModbusRefusal
from bufferstand.drivers.register_maps import IDENTITY, SIMULATED, SIMULATED_SIGN, Profile
from bufferstand.foundation import (
    CommandRejected,
    ControllerMotion,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
    WireLost,
)


class RegisterController:
    """Identity, state, commands and switch of a controller over one Modbus link; all from one thread.

    Parameters
    ----------
    link : ModbusLink
        The wire; this object owns it.
    profile : Profile
        The register map.
    timeout_s : float
        Longest wait for the controller to judge a command or change its state [s].
    board : NoticeBoard, optional
        Where it is posted on this computer who gives commands.
    """

    def __init__(
        self,
        link: ModbusLink,
        profile: Profile,
        *,
        timeout_s: float = 0.5,
        board: NoticeBoard | None = None,
    ) -> None:
        self._link = link
        self._profile = profile
        self._panel = NamedRegisters(link, profile, timeout_s)
        self._lock = lock = WriterLock(self._panel, board=board)
        self._commands = command.CommandPort(self._panel, lock)
        self._switch = ActuatorSwitch(self._panel, lock)
        self._no_numbers: set[str] = set()
        self._version: int | None = None

    def identify(self) -> Identity:
        """Open the wire, check identity and test-value registers; get who answers.

        Raises
        ------
        DeviceFault
            If nobody answers, or what answers is not what the profile describes.
        """
        window = self._profile.span(IDENTITY)

        def read() -> list[int]:
            what = "identity and test values"
            return self._link.read(window.address, window.words, what, table=window.table)

        registers = self._panel.ask_again(read)
        if mismatch := find_mismatch(self._profile, window, registers):
            registers = self._panel.ask_again(read)  # the first reply may have been altered on its way
            mismatch = find_mismatch(self._profile, window, registers)
        if mismatch:
            raise self._panel.fault(mismatch)
        values = window.decode(registers)
        poll = self._profile.poll
        rate_Hz = float(values["sample_rate"] if poll is None else poll.rate_Hz)
        if not (math.isfinite(rate_Hz) and rate_Hz > 0.0):
            raise self._panel.fault(f"it states a sample rate of {rate_Hz} Hz; look at its configuration")
        facts, version = self._profile.facts, int(values["profile_version"])
        self._version = version
        shown = "" if version == self._profile.find("profile_version").expect else f" (the device: {version})"
        return Identity(
            device=facts.id,
            address=self._link.address,
            serial=str(values["serial"]),
            profile=f"{facts.id} edition {facts.edition}{shown} sha256 {self._profile.hash}",
            sample_rate_Hz=rate_Hz,
        )

    def findings(self) -> Sequence[Finding]:
        """Get what its link finds out by reads alone; empty where the documents say all.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._link.findings() if isinstance(self._link, FindsOut) else ()

    def says_simulated(self) -> bool:
        """Return whether the controller says of itself that it is a simulated one; nothing is written.

        A controller that has no such register, or refuses to show it, is a real one.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if not self._profile.has(SIMULATED):
            return False
        window = self._profile.span((SIMULATED,))
        try:
            words = self._link.read(window.address, window.words, "simulated or not", table=window.table)
        except ModbusRefusal:
            return False
        return window.decode(words)[SIMULATED] == SIMULATED_SIGN

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
        self._note_no_numbers(values)
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
            tick_us=int(values["tick"]) if "tick" in values else None,
            foreign_sequence=self._commands.find_foreign(int(values["echo_sequence"])),
        )

    def _note_no_numbers(self, values: Mapping[str, float]) -> None:
        """Say, when it begins, which of the momentary values is no number; the samples are not touched."""
        wrong = {
            name for name in ("force", "stroke", "position", "command") if not math.isfinite(values[name])
        }
        for name in sorted(wrong - self._no_numbers):
            self._link.note(
                f"register {name} of the controller holds {values[name]}, which is no number; "
                "look at its transducer and at the controller's own messages"
            )
        self._no_numbers = wrong

    def other_writer(self) -> int | None:
        """Return the number of another program that may give commands; nothing is written.

        Returns
        -------
        int or None
            0 where no other program may; None where the profile has no register ``writer``.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._lock.other_holder()

    def seen_writer(self) -> WriterSeen:
        """Get who else may give commands, and what tells whether that program lives; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._lock.seen()

    @property
    def in_charge(self) -> bool:
        """Whether this program has the right to give commands, as far as it knows."""
        return self._lock.held

    def look_at_lock(self) -> None:
        """See that the right to give commands is still this program's: one register is read.

        Raises
        ------
        NotInCharge
            If it is not.
        DeviceFault
            If the wire fails.
        """
        self._lock.confirm()

    def take_charge(self) -> None:
        """Take the right to give commands as at a start, also where it was lost; nothing is switched.

        Raises
        ------
        DeviceFault
            If another program has it, or the wire fails.
        """
        self._lock.take()
        self._commands.count_on()

    def changed_limits(self) -> str:
        """Return which limits are no longer those that were set, with both values; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._switch.changed_limits()

    def give_back(self) -> None:
        """Let another program give commands.

        Raises
        ------
        DeviceFault
            If the wire fails; the controller drops it by itself then.
        """
        self._lock.give_back()

    def feed_watchdog(self) -> None:
        """Write the heartbeat; without it the controller falls back to zero force by itself.

        Raises
        ------
        NotInCharge
            If this program has not the right to give commands; nothing is written then.
        DeviceFault
            If the wire fails.
        """
        self._switch.feed_watchdog()

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog, read them back, and switch the actuator on (it holds).

        A latched fault is reset first, as an event. An actuator that is on already stays on. When it comes on
        for the first time, a hold in one request is tried: whether a stop will take one is known then.

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
        was_off = self._switch.enable(
            force_limit_kN=force_limit_kN, stroke_limit_mm=stroke_limit_mm, watchdog_ms=watchdog_ms
        )
        if was_off:  # it holds: what stops later is tried before anything moves
            self._commands.try_at_once()

    @property
    def stops_at_once(self) -> bool:
        """Whether a hold takes a single request; tried when the actuator is first switched on."""
        return self._commands.stops_at_once

    @property
    def taken_us(self) -> int | None:
        """The device's clock when it showed that it has taken the last command [µs, modulo 2³²]."""
        return self._commands.taken_us

    @contextmanager
    def look_between(
        self, look: Callable[[], object], outlast: Callable[[WireLost], object] | None = None
    ) -> Iterator[None]:
        """Inside, ``look`` is called before each request of a command; what it raises ends the command.

        ``outlast`` is called where the wire is lost within one; when it returns the request is repeated.
        """
        panel = self._panel
        before = panel.between, panel.outlast
        panel.between, panel.outlast = look, outlast or panel.outlast
        try:
            yield
        finally:
            panel.between, panel.outlast = before

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:
        """Begin a motion; get its sequence number.

        Parameters
        ----------
        motion : ControllerMotion
            On the controller's own scale.
        hurry : bool
            Begin with the first request, and see afterwards what became of it; to stand still always does.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        code, parameters = _command_of(motion)
        at_once = hurry or isinstance(motion, StandStill)
        give = self._commands.give_at_once if at_once else self._commands.give
        return give(code, motion.text, **parameters)

    @property
    def can_adjust(self) -> bool:
        """Whether it can change a running sine: by the profile, for the edition that the device shows."""
        return self._version is not None and self._profile.adjusts(self._version)

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        """Bring the running sine to another mean and amplitude over one cycle; it stays the same motion.

        Parameters
        ----------
        mean_mm, amplitude_mm
            Mean stroke and half the range, from one cycle on.

        Raises
        ------
        CommandRejected
            If the controller cannot, or refuses; DeviceFault if the wire fails.
        """
        text = f"adjusting to {mean_mm:g} ± {amplitude_mm:g} mm"
        if not self.can_adjust:
            raise CommandRejected(f"{text} was not sent: this controller has no such command")
        self._commands.give(command.ADJUST, text, mean=mean_mm, amplitude=amplitude_mm)

    def prepare(self, release: Release) -> None:
        """Have a release armed, so that starting it takes a single request; another command ends that.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        code, parameters = _command_of(release)
        self._commands.prepare(code, release.text, **parameters)

    def reset_fault(self) -> None:
        """Reset a latched fault, where there is one; the valve stays off.

        Raises
        ------
        DeviceFault
            As :meth:`bufferstand.drivers.controllers.actuator_switch.ActuatorSwitch.reset_fault`.
        """
        self._switch.reset_fault()

    def disable(self) -> None:
        """Switch the actuator's valve off, and see that it is; the right to give commands is kept.

        Raises
        ------
        NotInCharge
            If this program has not that right; nothing is written then.
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


_STATIC_REGISTERS = {
    "speed": "speed_mm_per_s",
    "turning_force": "force_limit_kN",
    "turning_stroke": "stroke_limit_mm",
    "cycles": "cycles",
    "static_pause": "pause_s",
}
_SINE_REGISTERS = {
    "mean": "mean_mm",
    "amplitude": "amplitude_mm",
    "frequency": "frequency_Hz",
    "cycles": "cycles",
}
_COMMANDS: dict[type[ControllerMotion], tuple[int, dict[str, str]]] = {
    StandStill: (command.HOLD, {}),
    RampTo: (command.RAMP, {"target": "target_mm", "speed": "speed_mm_per_s"}),
    Harmonic: (command.HARMONIC, _SINE_REGISTERS),
    StaticCycles: (command.STATIC, _STATIC_REGISTERS),
    Release: (command.RELEASE, {"speed": "speed_mm_per_s"}),
}
"""Of each motion the value of ``command_code``, and which register takes which of its figures."""


def _command_of(motion: ControllerMotion) -> tuple[int, dict[str, float]]:
    """Return a motion as code and parameters by register name."""
    code, figures = _COMMANDS[type(motion)]
    return code, {register: getattr(motion, figure) for register, figure in figures.items()}
