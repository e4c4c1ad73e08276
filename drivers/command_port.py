"""Commands to the controller: armed in one block, seen accepted, executed, seen accepted."""

from __future__ import annotations

import math
from collections.abc import Callable

from drivers import cia402
from drivers.interfaces import CommandRejected
from drivers.modbus_link import ModbusRefusal
from drivers.profile import COMMAND
from drivers.register_panel import RegisterPanel
from drivers.registers import Layout
from drivers.writer_lock import WriterLock

REJECT_TEXTS = {
    1: "unknown command",
    2: "not possible in the present state",
    3: "a parameter is out of range",
    4: "the command was not armed",
}
"""Meaning of register ``reject_code``."""

HOLD, RAMP, HARMONIC, STATIC, RELEASE = 1, 2, 3, 4, 5
"""Values of register ``command_code``."""

_KEYS = ("command_sequence", "command_code")


class CommandPort:
    """Gives numbered commands, so that one that is sent twice is done once.

    Parameters
    ----------
    panel : RegisterPanel
        The controller's registers.
    lock : WriterLock
        The right to give commands.
    """

    def __init__(self, panel: RegisterPanel, lock: WriterLock) -> None:
        self._panel = panel
        self._lock = lock
        self._block = panel.profile.span(COMMAND)
        self._parameters = [place.name for place in self._block.places if place.name not in _KEYS]
        self._sequence: int | None = None

    def give(self, code: int, text: str, **parameters: float) -> int:
        """Arm a command and execute it; return its sequence number.

        Parameters
        ----------
        code : int
            Value of register ``command_code``.
        text : str
            The command in words, for messages.
        **parameters : float
            By register name; the others are sent as 0.

        Raises
        ------
        CommandRejected
            If a parameter cannot be sent, or the controller refuses.
        DeviceFault
            If the wire fails, another program gives commands, the controller does not judge the command in
            time, or does not hold what was armed.
        """
        if self._sequence is None:
            self._sequence = int(self._panel.read_status()["echo_sequence"])
        sequence = self._sequence % 0xFFFF + 1  # 0 means “none yet”
        what = f"{text} (command {code}, sequence {sequence})"
        values: dict[str, float] = {**dict.fromkeys(self._parameters, 0.0), **parameters}
        if unfit := [name for name, value in values.items() if not math.isfinite(value)]:
            raise CommandRejected(f"{what} was not sent: {', '.join(unfit)} is no finite number")
        try:
            values = {"command_sequence": sequence, "command_code": code, **values}
            registers = self._block.encode(values)
        except ValueError as error:
            raise CommandRejected(f"{what} was not sent: {error}") from None
        self._note_rounding(what, values, self._block.decode(registers))
        self._lock.claim()
        self._sequence = sequence
        self._arm(registers, sequence, what)
        self._do(lambda: self._panel.set("execute", sequence), sequence, f"starting {what}")
        return sequence

    def _arm(self, registers: list[int], sequence: int, what: str) -> None:
        """Arm, and see that what the device holds is what was meant: it moves by these numbers."""
        panel, block = self._panel, self._block
        first, last = block.places[0].name, block.places[-1].name
        for attempt in (1, 2):
            self._do(lambda: panel.link.write(block.address, registers, what), sequence, f"arming {what}")
            kept = panel.read_back(first, last)
            if kept == registers:
                return
            if attempt == 1:
                panel.link.note(f"arming {what}: it reads back as {_shown(block, kept)}; armed once more")
        raise panel.fault(
            f"arming {what}: it reads back as {_shown(block, kept)}, twice; "
            "look whether the device bounds parameters, and at the cable"
        )

    def _note_rounding(self, what: str, meant: dict[str, float], sent: dict[str, float | int]) -> None:
        """Say where the register's resolution is coarser than what was meant."""
        for place in self._block.places:
            if place.scale != 1.0 and abs(sent[place.name] - meant[place.name]) > 1e-6 * place.scale:
                register = self._panel.profile.find(place.name)
                self._panel.link.note(
                    f"{what}: {place.name} {meant[place.name]:g} {register.unit} is sent as "
                    f"{sent[place.name]:g} (one count of the register is {place.scale:g} {register.unit})"
                )

    def _do(self, write: Callable[[], None], sequence: int, doing: str) -> None:
        """Write and see it accepted; a Modbus exception is a rejection with a reason of its own."""
        panel = self._panel
        try:
            write()
        except ModbusRefusal as refusal:
            reason = REJECT_TEXTS.get(int(panel.read_status()["reject_code"]), "it gave no reason")
            raise CommandRejected(
                f"{panel.link.name} refused {doing}: {reason} (Modbus exception {refusal.code})"
            ) from None
        values = panel.wait(lambda seen: int(seen["echo_sequence"]) == sequence, panel.timeout_s)
        if values is None:
            raise panel.fault(
                f"{doing}: not judged within {panel.timeout_s:g} s; "
                "look whether a second program gives it commands"
            )
        if code := int(values["reject_code"]):
            reason = REJECT_TEXTS.get(code, f"unknown reason {code}")
            state = cia402.state_name(int(values["status_word"]))
            raise CommandRejected(f"{panel.link.name} rejected {doing}: {reason} (it is “{state}”)")


def _shown(block: Layout, registers: list[int]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in block.decode(registers).items())
