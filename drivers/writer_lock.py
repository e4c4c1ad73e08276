"""One program at a time gives commands: the controller's lock, where its profile has one."""

from __future__ import annotations

import secrets

from drivers.interfaces import DeviceFault
from drivers.modbus_link import ModbusRefusal
from drivers.register_panel import RegisterPanel


class WriterLock:
    """The right to give commands to one controller; without register ``writer`` everybody has it.

    Parameters
    ----------
    panel : RegisterPanel
        The controller's registers.
    number : int, optional
        What this program calls itself, 1 … 65535; random without it.
    """

    def __init__(self, panel: RegisterPanel, number: int | None = None) -> None:
        self._panel = panel
        self.number = number or 1 + secrets.randbelow(0xFFFF)
        self._offered = panel.profile.has("writer")
        self._held = False

    def claim(self) -> None:
        """Take the lock, or keep it.

        Raises
        ------
        DeviceFault
            If another program has it, or the wire fails.
        """
        if not self._offered:
            return
        refused = False
        try:
            self._panel.set("writer", self.number)
        except ModbusRefusal:
            refused = True
        if refused or not self._held:
            holder = self._holder()
            self._held = holder == self.number
            if not self._held:
                raise self._taken(holder)

    def keep(self) -> None:
        """Take the lock if this program does not have it: whoever hurries does not ask again.

        Raises
        ------
        DeviceFault
            As :meth:`claim`.
        """
        if not self._held:
            self.claim()

    def other_holder(self) -> int | None:
        """Return the number of another program that has the lock; 0 where none has it, None without a lock.

        Reads one register; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if not self._offered:
            return None
        holder = self._holder()
        return 0 if holder == self.number else holder

    def give_back(self) -> None:
        """Let another program have it; one that was lost already is let go of silently.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        self._held = False
        if self._offered and self._holder() == self.number:
            self._panel.set("writer", 0)

    def _holder(self) -> int:
        register, link = self._panel.profile.find("writer"), self._panel.link
        return self._panel.ask_again(lambda: link.read(register.address, 1, "who may give commands"))[0]

    def _taken(self, holder: int) -> DeviceFault:
        if not holder:
            return self._panel.fault("it does not take register writer; look at the register profile")
        return self._panel.fault(
            f"another program (number {holder}, this one is {self.number}) gives it commands; "
            "end that program, or wait until the controller drops it (10 s after its last heartbeat)"
        )
