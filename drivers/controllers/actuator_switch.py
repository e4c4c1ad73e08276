"""Switching the actuator on and off: limits, watchdog, fault reset, and the CiA 402 states on the way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from bufferstand.drivers.controllers import cia402
from bufferstand.drivers.controllers.named_registers import FAULT_TEXTS, NamedRegisters
from bufferstand.drivers.controllers.writer_lock import WriterLock
from bufferstand.drivers.register_maps import LIMITS
from bufferstand.foundation import CommandRejected, DeviceFault

_INTERMEDIATE_S = 0.1


class ActuatorSwitch:
    """The actuator's valve, limits and watchdog.

    Parameters
    ----------
    panel : RegisterPanel
        The controller's registers.
    lock : WriterLock
        The right to give commands.
    """

    def __init__(self, panel: NamedRegisters, lock: WriterLock) -> None:
        self._panel = panel
        self._lock = lock
        self._limits = panel.profile.span(LIMITS)
        self._beat: int | None = None
        self._set: Sequence[int] = ()

    def feed_watchdog(self) -> None:
        """Write a heartbeat that differs from the last, as
        :meth:`bufferstand.drivers.controllers.writer_lock.WriterLock.feed`.

        Raises
        ------
        NotInCharge
            If this program has not the right to give commands; nothing is written then.
        DeviceFault
            If the wire fails.
        """
        self._lock.demand()
        if self._beat is None:
            register = self._panel.profile.find("watchdog_feed")
            link = self._panel.link
            self._beat = self._panel.ask_again(lambda: link.read(register.address, 1, "the last heartbeat"))[
                0
            ]
        self._beat = (self._beat + 1) % 0x10000
        self._lock.feed(self._beat)

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> bool:
        """Set limits and watchdog, read them back, reset a latched fault, switch on.

        Parameters
        ----------
        force_limit_kN, stroke_limit_mm
            Limits that the device itself keeps.
        watchdog_ms : int
            Longest time without a heartbeat [ms], 1 to 65535.

        Returns
        -------
        bool
            Whether it was off before.

        Raises
        ------
        CommandRejected
            If a value is none that can be sent.
        DeviceFault
            If the wire fails, another program gives commands, the device keeps other values, a state is
            not reached in time, its own force is no number, or a fault may not be reset
            (:meth:`reset_fault`).
        """
        panel = self._panel
        if not 0 < watchdog_ms <= 0xFFFF:
            raise CommandRejected(f"watchdog of {watchdog_ms} ms was not sent: 1 to 65535 ms can be")
        if not (0 < force_limit_kN < math.inf and 0 < stroke_limit_mm < math.inf):
            raise CommandRejected(
                f"limits of {force_limit_kN} kN and {stroke_limit_mm} mm were not sent: they must be positive"
            )
        limits = self._limits.encode({"force_limit": force_limit_kN, "stroke_limit": stroke_limit_mm})
        self._lock.claim_anew()
        panel.set("watchdog_time", watchdog_ms)
        panel.link.write(self._limits.address, limits, "limits")
        panel.let_it_look()  # it may put back what is more than it can
        panel.demand_kept(
            "watchdog_time", "watchdog_time", panel.profile.encode("watchdog_time", watchdog_ms)
        )
        panel.demand_kept(self._limits.places[0].name, self._limits.places[-1].name, limits)
        self._set = limits
        self.feed_watchdog()
        values = panel.read_status()
        if int(values["status_word"]) & cia402.FAULT_BIT:
            self._reset(values)
            values = panel.read_status()
        if not math.isfinite(values["force"]):
            raise self._panel.fault(
                f"it was not switched on: its own force reads {values['force']}, which is no number, and its "
                "force limit goes by that; look at its transducer and its own messages"
            )
        *before, last = cia402.SWITCH_ON
        was_off = not last.reached(int(values["status_word"]))
        if was_off:  # if it is on, the earlier words would switch it off
            for step in before:
                panel.set("control_word", step.control_word)
                panel.wait_for_word(step.reached, _INTERMEDIATE_S)
        panel.set("control_word", last.control_word)
        panel.demand_state(last.reached, f"“{last.name}” after control word 0x{last.control_word:04X}")
        return was_off

    def changed_limits(self) -> str:
        """Return which limits are no longer those that were set, with both values; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if not self._set:
            return ""
        first, last = self._limits.places[0].name, self._limits.places[-1].name
        before = self._limits.decode(self._set)
        now = self._limits.decode(self._panel.read_back(first, last))
        changed = (name for name, value in now.items() if value != before[name])
        return ", ".join(f"{name} {before[name]:g} → {now[name]:g}" for name in changed)

    def disable(self) -> None:
        """Switch off, and see that it is; the lock is kept.

        Raises
        ------
        NotInCharge
            If this program has not the right to give commands; nothing is written then.
        DeviceFault
            If the wire fails or the actuator stays on.
        """
        self._lock.demand_recent()
        self._panel.set("control_word", cia402.SWITCH_OFF)
        self._panel.demand_state(
            lambda word: not word & cia402.OPERATION_BIT, "the actuator off after control word 0x0000"
        )

    def reset_fault(self) -> None:
        """Reset a latched fault, where there is one; the valve stays off.

        Raises
        ------
        DeviceFault
            If the wire fails, another program gives commands, the valve is still on or force is on the
            specimen (nothing is reset then), or the fault stays.
        """
        values = self._panel.read_status()
        if not int(values["status_word"]) & cia402.FAULT_BIT:
            return
        had = self._lock.held
        self._lock.claim()
        self._reset(values)
        self._panel.set("control_word", cia402.SWITCH_OFF)
        if not had:
            with suppress(DeviceFault):  # it is off; the lock frees itself in time
                self._lock.give_back()

    def _reset(self, values: Mapping[str, Any]) -> None:
        """Reset the fault of a snapshot, once its valve is off and no force is left."""
        code = int(values["fault_code"])
        text = FAULT_TEXTS.get(code, f"unknown fault {code}")
        off = self._panel.wait(
            lambda seen: not int(seen["status_word"]) & cia402.OPERATION_BIT, self._panel.timeout_s
        )
        if off is None:
            raise self._panel.fault(
                f"fault {code} ({text}) was not reset: the valve is still on, it takes the force away; "
                "wait until it is off and start again"
            )
        force_kN = float(off["force"])
        if not abs(force_kN) <= cia402.RESET_FORCE_MAX_KN:
            raise self._panel.fault(
                f"fault {code} ({text}) was not reset: the force is {force_kN:.1f} kN, and at most "
                f"{cia402.RESET_FORCE_MAX_KN:g} kN may be left; unload the specimen and start again"
            )
        self._panel.set("control_word", cia402.SWITCH_OFF)
        self._panel.set("control_word", cia402.FAULT_RESET)
        self._panel.demand_state(lambda word: not word & cia402.FAULT_BIT, f"reset of fault {code} ({text})")
        self._panel.link.note(f"fault {code} ({text}) of the {self._panel.link.name} was reset")
