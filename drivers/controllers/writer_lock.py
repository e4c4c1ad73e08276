"""One program at a time gives commands: the controller's lock, where its profile has one.

Who has it is told to other programs of this computer by a notice; without a register ``writer`` a locked
file does for the programs of this computer what the register does for all.
"""

from __future__ import annotations

import secrets
from contextlib import suppress

from bufferstand.drivers.controllers.named_registers import NamedRegisters
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
from bufferstand.drivers.interfaces import WriterSeen
from bufferstand.drivers.modbus import Exchange, ModbusRefusal
from bufferstand.drivers.register_maps import WATCHDOG_LEFT
from bufferstand.foundation import DeviceFault, NotInCharge

LOOK_S = 1.0
"""A heartbeat is written only if the lock was seen to be the own so recently [s of the wall]: a pause of this
program may have been another's time."""
ELSEWHERE = "a program that this computer knows nothing of"
"""A writer of whom nothing is posted on this one."""


class WriterLock:
    """The right to give commands to one controller.

    Parameters
    ----------
    panel : RegisterPanel
        The controller's registers.
    number : int, optional
        What this program calls itself, 1 … 65535; random without it.
    board : NoticeBoard, optional
        Where it is posted on this computer who gives commands.
    """

    def __init__(
        self, panel: NamedRegisters, number: int | None = None, board: NoticeBoard | None = None
    ) -> None:
        self._panel = panel
        self.number = number or 1 + secrets.randbelow(0xFFFF)
        self._board = board
        self._offered = panel.profile.has("writer")
        self._lost = ""
        self._seen_s = 0.0
        self._together = True
        self.held = False
        """Whether this program has the lock, by what it saw last."""

    def claim(self) -> None:
        """Take the lock if nobody has it; see that it is still the own if this program has it.

        Raises
        ------
        NotInCharge
            If this program had it and has lost it.
        DeviceFault
            If another program has it, or the wire fails.
        """
        if self.held:
            self.confirm()
            return
        self._demand_not_lost()
        if self._offered:
            if (holder := self._holder()) not in (0, self.number):
                raise self._taken(holder)
            with suppress(ModbusRefusal):  # another program was quicker: seen by reading
                self._panel.set("writer", self.number)
            self._panel.let_it_look()
            if (holder := self._holder()) != self.number:
                raise self._taken(holder)
        elif self._board is not None and not self._board.lock():
            raise self._taken(None)
        self.held, self._seen_s = True, self._panel.link.now_s()
        if self._board is not None:
            self._board.put(self.number)

    def claim_anew(self) -> None:
        """Take the lock as at a start, also where it was lost before; see :meth:`claim`.

        Raises
        ------
        DeviceFault
            If another program has it, or the wire fails.
        """
        self._lost = ""
        self.claim()

    def take(self) -> None:
        """Take the lock as at a start, whatever was known of it; see :meth:`claim`.

        Raises
        ------
        DeviceFault
            If another program has it, or the wire fails.
        """
        if self.held:
            with suppress(NotInCharge):
                self.confirm()
        self.claim_anew()

    def keep(self) -> None:
        """Take the lock if this program never had it; whoever hurries asks the controller nothing.

        Behind a pause of ``LOOK_S`` without a look it is asked all the same: a program that slept may have
        been dropped, and what it would stop is another's.

        Raises
        ------
        NotInCharge
            If it was lost.
        DeviceFault
            As :meth:`claim`.
        """
        if self.held:
            self.demand_recent()
        else:
            self.claim()

    def demand(self) -> None:
        """Demand that this program has the lock, by what it saw last; asks the controller nothing.

        Raises
        ------
        NotInCharge
            If it has not.
        """
        if not self.held:
            self._demand_not_lost()
            raise NotInCharge(
                f"{self._at}: this program has not the right to give it commands; nothing was sent"
            )

    def demand_recent(self) -> None:
        """Demand the lock by what was seen within ``LOOK_S``; the controller is asked where that is older.

        Raises
        ------
        NotInCharge
            If this program has it not.
        DeviceFault
            If the wire fails.
        """
        self.demand()
        if self._panel.link.now_s() - self._seen_s > LOOK_S:
            self.confirm()

    def feed(self, beat: int) -> None:
        """Write a heartbeat, with the lock seen in the same transaction where function 23 goes.

        Where the lock was not seen for ``LOOK_S`` it is looked at first. So nothing is fed behind a pause in
        which the controller may have dropped this program, and a lock that another has taken in between is
        noticed with the heartbeat that is under way.

        Parameters
        ----------
        beat : int
            Value of register ``watchdog_feed``.

        Raises
        ------
        NotInCharge
            If this program has it not.
        DeviceFault
            If the wire fails.
        """
        self.demand_recent()
        panel, link = self._panel, self._panel.link
        if not (self._offered and self._together and link.exchanges):
            panel.set("watchdog_feed", beat)
            return
        try:
            writer_at, feed_at = (panel.profile.find(name).address for name in ("writer", "watchdog_feed"))
            what = "a heartbeat, and who may give commands"
            (holder,) = link.exchange(Exchange(writer_at, 1, feed_at, (beat,), what))
        except ModbusRefusal:  # some take function 23 for their ring and status only
            self._together = False
            panel.set("watchdog_feed", beat)
            return
        if holder != self.number:
            self.confirm()  # read once more: the reply may have been altered on its way
        self._seen_s = self._panel.link.now_s()

    def confirm(self) -> None:
        """See that the lock is still this program's: one register is read.

        Raises
        ------
        NotInCharge
            If it is not; it stays lost until it is claimed anew.
        DeviceFault
            If the wire fails.
        """
        self.demand()
        if self._offered and self._holder() != self.number and (holder := self._holder()) != self.number:
            self._lose(holder)  # read twice: the first reply may have been altered on its way
            self._demand_not_lost()
        self._seen_s = self._panel.link.now_s()

    def _lose(self, holder: int) -> None:
        who = (
            f"{self._who(holder)} has taken over"
            if holder
            else "it has dropped this program's right to give commands (it was started anew, or got no "
            "heartbeat for 10 s)"
        )
        self.held, self._lost = False, f"{self._at}: {who}; nothing more is sent to it"
        if self._board is not None:
            self._board.remove()

    def _demand_not_lost(self) -> None:
        if self._lost:
            raise NotInCharge(self._lost)

    def other_holder(self) -> int | None:
        """Return the number of another program that has the lock; 0 where none has it, None without a lock.

        Reads one register; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if not self._offered:
            notice = None if self.held or self._board is None else self._board.find_locked()
            return None if notice is None else notice.writer
        holder = self._holder()
        return 0 if holder == self.number else holder

    def seen(self) -> WriterSeen:
        """Return who else has the lock, and what tells whether that program lives; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        number, panel = self.other_holder(), self._panel
        posted = self._board.find(number) if number and self._board is not None else None
        left_ms = panel.read_status().get(WATCHDOG_LEFT)
        return WriterSeen(
            number,
            self._who(number),
            None if posted is None else posted.lives,
            panel.read_back("watchdog_feed", "watchdog_feed")[0],
            panel.read_back("watchdog_time", "watchdog_time")[0] / 1000.0,
            None if left_ms is None else float(left_ms) / 1000.0,
        )

    def give_back(self) -> None:
        """Let another program have it; one that was lost already is let go of silently.

        Raises
        ------
        DeviceFault
            If the wire fails; the controller drops it by itself then.
        """
        was_held, self.held = self.held, False
        try:
            if was_held and self._offered and self._holder() == self.number:
                self._panel.set("writer", 0)
                self._panel.let_it_look()  # else who is next could write a number that hides the 0
        finally:
            if self._board is not None:
                self._board.remove()

    def _holder(self) -> int:
        register, link = self._panel.profile.find("writer"), self._panel.link
        return self._panel.ask_again(lambda: link.read(register.address, 1, "who may give commands"))[0]

    @property
    def _at(self) -> str:
        return f"{self._panel.link.name} at {self._panel.link.address}"

    def _who(self, holder: int | None) -> str:
        """Return another program in words; empty where there is none."""
        if not holder:
            return ""
        board = self._board
        notice = None if board is None else board.find(holder) if self._offered else board.find_locked()
        named = f"{ELSEWHERE}" if notice is None else notice.text
        return f"{named} (number {holder})"

    def _taken(self, holder: int | None) -> DeviceFault:
        if holder == 0:
            return self._panel.fault("it does not take register writer; look at the register profile")
        if holder is None:
            notice = None if self._board is None else self._board.find_locked()
            who = "another program of this computer" if notice is None else notice.text
            return self._panel.fault(f"another program gives it commands: {who}; end that program")
        return self._panel.fault(
            f"another program (number {holder}, this one is {self.number}) gives it commands: "
            f"{self._who(holder)}; end that program, or wait until the controller drops it (10 s after its "
            "last heartbeat)"
        )
