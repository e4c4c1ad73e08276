"""Commands to the controller: armed in one block, seen accepted, executed, seen accepted.

A command that stops is quicker: block and ``execute`` go in one request, and what became of it is seen
afterwards.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from bufferstand.drivers.controllers import cia402
from bufferstand.drivers.controllers.named_registers import NamedRegisters
from bufferstand.drivers.controllers.writer_lock import WriterLock
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.modbus import ModbusRefusal
from bufferstand.drivers.register_maps import COMMAND, Layout
from bufferstand.foundation import CommandRejected, DeviceFault

REJECT_TEXTS = {
    1: "unknown command",
    2: "not possible in the present state",
    3: "a parameter is out of range",
    4: "the command was not armed",
}
"""Meaning of register ``reject_code``."""

HOLD, RAMP, HARMONIC, STATIC, RELEASE, ADJUST = 1, 2, 3, 4, 5, 6
"""Values of register ``command_code``."""

_KEYS = ("command_sequence", "command_code")
_REMEMBERED = 8
"""So many numbers of commands are remembered as own: a snapshot may be older than the last ones given."""
_BEGUN = {HOLD: MotionState.HOLDING, RELEASE: MotionState.RELEASING}
"""What the controller does once a command that stops is executed."""


@dataclass(frozen=True)
class _Ready:
    """A command that is to be armed while another motion runs, and waits to be executed."""

    code: int
    parameters: dict[str, float]
    sequence: int
    text: str
    registers: list[int]


class CommandPort:
    """Gives numbered commands, so that one that is sent twice is done once.

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
        self._block = panel.profile.span(COMMAND)
        self._parameters = [place.name for place in self._block.places if place.name not in _KEYS]
        self._sequence: int | None = None
        self._given: deque[int] = deque(maxlen=_REMEMBERED)
        self._ready: _Ready | None = None
        self._armed: list[int] | None = None  # the block that the device took last and has not executed
        self._is_kept = False  # whether it was seen to hold that block
        self.taken_us: int | None = None
        """The device's clock when it showed that it has taken the last command [µs, modulo 2³²]."""
        beside = panel.profile.find("execute").address == self._block.address + self._block.words
        self._at_once: bool | None = None if beside else False

    @property
    def stops_at_once(self) -> bool:
        """Whether a whole command goes in one request; so it is taken until it was tried, or if it was."""
        return self._at_once is not False

    def try_at_once(self) -> None:
        """See whether the device takes a whole command in one request, by a hold; for one that holds.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if self._at_once is not None:
            return
        panel, link = self._panel, self._panel.link
        sequence, what, registers = self._numbered(HOLD, "hold", {})
        refused = ""
        try:
            link.write(self._block.address, [*registers, sequence], f"{what} in one request")
        except ModbusRefusal as refusal:
            refused = f" (Modbus exception {refusal.code})"
        else:
            done = panel.wait(lambda seen: int(seen["done_sequence"]) == sequence, panel.timeout_s)
            self._at_once = done is not None
        if not self._at_once:
            self._at_once = False
            link.note(
                f"{link.name} does not take a command and its execution in one request{refused}: a stop "
                "releases at once, where another controller would hold first"
            )

    def give_at_once(self, code: int, text: str, **parameters: float) -> int:
        """Give a command that stops (hold, release) with the first request; return its sequence number.

        What is ready is executed; else block and ``execute`` go in one request, where the device is not
        known to refuse that, or in two without a look between them. Afterwards it is seen that the command
        was judged, that it has begun and that the device holds what was meant; it is given anew if not.
        A reply is waited for only as long as replies usually take, and nothing is sent twice: whoever
        hurries gives another command then.

        Raises
        ------
        CommandRejected, DeviceFault
            As :meth:`give`.
        """
        self._lock.keep()
        if ready := self._find_ready(code, parameters):
            kept, what = self._is_kept, f"{text} (command {code}, sequence {ready.sequence})"
            with suppress(CommandRejected):  # the device has dropped it since: it is given anew
                self._execute(ready.sequence, what, hurry=True)
                if kept or self._holds(ready.registers, what):
                    return ready.sequence
        sequence, what, registers = self._numbered(code, text, parameters)
        self._send(sequence, what, registers)
        values = self._judged(sequence, what)
        if int(values["state"]) != _BEGUN[code] and int(values["done_sequence"]) != sequence:
            self._execute(sequence, what)
        if self._holds(registers, what):
            return sequence
        return self.give(code, text, **parameters)

    def _holds(self, registers: list[int], what: str) -> bool:
        """Return whether the device holds what was meant by a command that it executes already."""
        if (kept := self._read_back()) == registers:
            return True
        self._panel.link.note(f"{what}: it reads back as {_shown(self._block, kept)}; given anew")
        return False

    def _read_back(self) -> list[int]:
        self._panel.between()
        return self._panel.read_back(self._block.places[0].name, self._block.places[-1].name)

    def _find_ready(self, code: int, parameters: dict[str, float]) -> _Ready | None:
        """Return the command that is ready if it is this one and nothing was armed since."""
        ready = self._ready
        if ready is None or ready.registers != self._armed:
            return None
        return ready if (ready.code, ready.parameters) == (code, parameters) else None

    def _send(self, sequence: int, what: str, registers: list[int]) -> None:
        """Send block and ``execute``, in one request if the device may take that."""
        panel, address = self._panel, self._block.address
        self._armed = None
        if self._at_once is not False:
            try:
                panel.link.write(address, [*registers, sequence], what, hurry=True)
            except ModbusRefusal as refusal:
                if self._at_once:
                    raise self._refused(refusal, what) from None
            else:
                return
        try:
            panel.link.write(address, registers, what, hurry=True)
            panel.set("execute", sequence, hurry=True)
        except ModbusRefusal as refusal:
            raise self._refused(refusal, what) from None

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
        ready = self._ready
        if self._is_kept and (same := self._find_ready(code, parameters)):
            what = f"{text} (command {code}, sequence {same.sequence})"
            with suppress(CommandRejected):  # the device has dropped it since: it is armed anew
                self._execute(same.sequence, what)
                return same.sequence
        sequence, what, registers = self._numbered(code, text, parameters)
        self._panel.between()
        self._panel.persist(self._lock.claim)
        self._arm(registers, sequence, what)
        self._execute(sequence, what)
        if ready is not None and code == ADJUST:  # the motion goes on: what was ready for it is so again
            self.prepare(ready.code, ready.text, **ready.parameters)
        else:
            self._ready = None
        return sequence

    def prepare(self, code: int, text: str, **parameters: float) -> None:
        """Arm a command so that giving it later takes a single request; any other one given takes its place.

        It can be given as soon as the device has taken the block, also before that was read back.

        Raises
        ------
        CommandRejected, DeviceFault
            As :meth:`give`.
        """
        sequence, what, registers = self._numbered(code, text, parameters)
        self._panel.persist(self._lock.keep)
        self._ready = _Ready(code, parameters, sequence, text, registers)
        try:
            self._arm(registers, sequence, what)
        except DeviceFault:
            self._ready = None
            raise

    def _numbered(self, code: int, text: str, parameters: dict[str, float]) -> tuple[int, str, list[int]]:
        """Return the next sequence number, the command for messages, and its block."""
        if self._sequence is None:
            self._sequence = int(self._panel.persist(self._panel.read_status)["echo_sequence"])
            self._given.append(self._sequence)
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
        self._sequence = sequence
        self._given.append(sequence)
        return sequence, what, registers

    def count_on(self) -> None:
        """Count on from the command that the device took last, whoever gave it: the right to is had again.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if self._given:
            self._sequence = int(self._panel.persist(self._panel.read_status)["echo_sequence"])
            self._given.append(self._sequence)

    def find_foreign(self, echoed: int) -> int | None:
        """Return the number of the command that the device took last if this program has not given it.

        Parameters
        ----------
        echoed : int
            Register ``echo_sequence`` of a snapshot; 0 for none yet.

        Returns
        -------
        int or None
            None also where this program gives no commands by now.
        """
        own = not self._lock.held or not self._given or echoed in self._given
        return None if own or not echoed else echoed

    def _execute(self, sequence: int, what: str, *, hurry: bool = False) -> None:
        self._armed = None
        self._do(lambda: self._panel.set("execute", sequence, hurry=hurry), sequence, f"starting {what}")

    def _arm(self, registers: list[int], sequence: int, what: str) -> None:
        """Arm, and see that what the device holds is what was meant: it moves by these numbers."""
        panel, block = self._panel, self._block

        def write() -> None:
            self._armed, self._is_kept = None, False
            panel.link.write(block.address, registers, what)
            self._armed = registers

        for attempt in (1, 2):
            self._do(write, sequence, f"arming {what}")
            kept = self._read_back()
            if kept == registers:
                self._is_kept = True
                return
            self._armed = None
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
        self._panel.between()
        try:
            self._panel.persist(write)
        except ModbusRefusal as refusal:
            raise self._refused(refusal, doing) from None
        self._judged(sequence, doing)

    def _refused(self, refusal: ModbusRefusal, doing: str) -> CommandRejected:
        panel = self._panel
        reason = REJECT_TEXTS.get(int(panel.read_status()["reject_code"]), "it gave no reason")
        return CommandRejected(
            f"{panel.link.name} refused {doing}: {reason} (Modbus exception {refusal.code})"
        )

    def _judged(self, sequence: int, doing: str) -> dict[str, Any]:
        """Return the status that shows a command judged and accepted."""
        panel = self._panel
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
        self.taken_us = int(values["tick"]) if "tick" in values else None
        return values


def _shown(block: Layout, registers: list[int]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in block.decode(registers).items())
