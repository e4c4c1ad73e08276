"""The controller's registers by name: reading the status, setting one, waiting for a status word."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from bufferstand.drivers.controllers import cia402
from bufferstand.drivers.modbus import Exchange, ModbusLink, ModbusRefusal
from bufferstand.drivers.register_maps import STATUS, Profile, crc_of, decode_value
from bufferstand.foundation import DeviceFault, WireLost

FAULT_TEXTS = {
    0: "none",
    1: "watchdog: no heartbeat from the computer",
    2: "force limit of the device",
    3: "stroke limit of the device",
    4: "actuator",
}
"""Meaning of register ``fault_code``."""

_POLL_S = 0.002

_Answer = TypeVar("_Answer")


def _nothing() -> None:
    pass


def _raise(lost: WireLost) -> None:
    raise lost


class NamedRegisters:
    """Named registers over one link.

    Parameters
    ----------
    link : ModbusLink
        The wire.
    profile : Profile
        The register map.
    timeout_s : float
        Longest wait for the device to show what it was told [s].
    """

    def __init__(self, link: ModbusLink, profile: Profile, timeout_s: float) -> None:
        self.link = link
        self.profile = profile
        self.timeout_s = timeout_s
        self._status_block = block = profile.span(STATUS)
        self._status_places = {place.name: place for place in block.places}
        self._numbered = profile.has("request_number") and self._status_block.table == "holding"
        self._number = 0
        self.between: Callable[[], object] = _nothing
        """Called before each request of a command, and before each look at what became of it."""
        self.outlast: Callable[[WireLost], object] = _raise
        """Called where the wire is lost within a command; once it returns, the request is repeated."""

    def read_status(self) -> dict[str, Any]:
        """Get every status register by name, in one transaction.

        Where the profile has ``request_number`` the request carries a new number, and only a snapshot that
        repeats it is taken; where it has ``status_check`` only one whose CRC fits. Without function 23 that
        number would take a round trip of its own: it is left out where the wire numbers requests itself.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._status_block.decode(self.ask_again(self._ask_status))

    @property
    def trips_of_status(self) -> int:
        """Round trips that a snapshot takes."""
        return self.link.trips_of_exchange if self._numbers else 1

    @property
    def _numbers(self) -> bool:
        """Whether a request for the status carries a number."""
        return self._numbered and (self.link.exchanges or self.link.mixes_up_replies)

    def _ask_status(self) -> list[int]:
        block = self._status_block
        if not self._numbers:
            return self.link.read(
                block.address, block.words, "status", table=block.table, check=self._altered
            )
        number = self._number = self._number % 0xFFFF + 1

        def doubt(registers: Sequence[int]) -> str:
            if found := self._altered(registers):
                return found
            echo = self._of_status("request_echo", registers)
            return "" if echo == number else f"it answers request {echo} instead of {number}: it is late"

        number_at = self.profile.find("request_number").address
        return self.link.exchange(
            Exchange(block.address, block.words, number_at, (number,), "status"), check=doubt
        )

    def _altered(self, registers: Sequence[int]) -> str:
        """Return what is wrong with a snapshot's CRC, as far as there is one."""
        place = self._status_places.get("status_check")
        if place is None or crc_of(registers[: place.offset]) == self._of_status(place.name, registers):
            return ""
        return "the snapshot's CRC does not fit its content: it was altered on its way"

    def _of_status(self, name: str, registers: Sequence[int]) -> float | int:
        """Return one value of a snapshot; all of them take four times as long."""
        place = self._status_places[name]
        order = place.word_order or self._status_block.word_order
        return decode_value(registers[place.offset : place.offset + place.words], place.kind, order)

    def ask_again(self, ask: Callable[[], _Answer]) -> _Answer:
        """Ask, and once more if the device refuses: a request that was altered on its way is refused, too.

        Only for what changes nothing. A second refusal is the device's own.

        Raises
        ------
        DeviceFault
            If the wire fails, or the device refuses twice.
        """
        try:
            return ask()
        except ModbusRefusal as refusal:
            self.link.note(f"{refusal}; asked once more")
            return ask()

    def persist(self, request: Callable[[], _Answer]) -> _Answer:
        """Make a request of a command; where the wire is lost and :attr:`outlast` returns, once more.

        For what does no harm twice: commands are numbered, and one that is sent twice is done once.

        Raises
        ------
        DeviceFault
            If the wire is lost for longer, or as the request does.
        """
        while True:
            try:
                return request()
            except WireLost as lost:
                self.outlast(lost)

    def set(self, name: str, value: int, *, hurry: bool = False) -> None:
        """Set one register; ``hurry`` as :meth:`bufferstand.drivers.modbus.link.ModbusLink.write`.

        Raises
        ------
        DeviceFault
            If the wire fails.
        ValueError
            If the value does not fit the register.
        """
        self.link.write(self.profile.find(name).address, self.profile.encode(name, value), name, hurry=hurry)

    def demand_kept(self, first: str, last: str, written: Sequence[int]) -> None:
        """Read a window back and see that it holds what was written.

        Raises
        ------
        DeviceFault
            If the wire fails or it holds something else.
        """
        block = self.profile.block(first, last)
        kept = self.read_back(first, last)
        if kept != list(written):
            kept = self.read_back(first, last)  # the first reply may have been altered
        if kept != list(written):
            raise self.fault(
                f"{first} … {last} read back as {block.decode(kept)} instead of {block.decode(written)}; "
                "look whether the device bounds them"
            )

    def read_back(self, first: str, last: str) -> list[int]:
        """Return what a window of writable registers holds.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        block = self.profile.block(first, last)
        return self.persist(
            lambda: self.ask_again(lambda: self.link.read(block.address, block.words, f"back {first}"))
        )

    def wait(self, done: Callable[[dict[str, Any]], bool], timeout_s: float) -> dict[str, Any] | None:
        """Wait for a status that fulfils ``done``; return it, or None after ``timeout_s``.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        deadline_s = self.link.now_s() + timeout_s
        self.between()
        while not done(values := self.persist(self.read_status)):
            if self.link.now_s() >= deadline_s:
                return None
            self.link.sleep(_POLL_S)
            self.between()
        return values

    def let_it_look(self) -> None:
        """Wait until a controller that looks at its registers once a scan has seen what was written.

        Its heart has beaten twice then: the first beat may be of a scan that had begun before. Nothing is
        waited for where it answers at once, and not for longer than a command.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        if not self.link.may_answer_early:
            return
        beats = {int(self.persist(self.read_status)["heartbeat"])}

        def beaten_twice(seen: dict[str, Any]) -> bool:
            beats.add(int(seen["heartbeat"]))
            return len(beats) > 2

        self.wait(beaten_twice, self.timeout_s)

    def wait_for_word(self, reached: Callable[[int], bool], timeout_s: float) -> bool:
        """Wait for a status word; return whether it came within ``timeout_s``.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self.wait(lambda values: reached(int(values["status_word"])), timeout_s) is not None

    def demand_state(self, reached: Callable[[int], bool], what: str) -> None:
        """Wait for a status word; what does not come in time is a fault.

        Parameters
        ----------
        reached : callable
            Whether a status word is the one waited for.
        what : str
            What is waited for, for the message.

        Raises
        ------
        DeviceFault
            If the wire fails or the time is over.
        """
        if self.wait_for_word(reached, self.timeout_s):
            return
        values = self.read_status()
        word, code = int(values["status_word"]), int(values["fault_code"])
        fault = f", fault {code} ({FAULT_TEXTS.get(code, 'unknown')})" if code else ""
        raise self.fault(
            f"did not show {what} within {self.timeout_s:g} s: it is “{cia402.state_name(word)}” "
            f"(status word 0x{word:04X}){fault}; look at emergency stop, interlocks and hydraulics"
        )

    def lost(self, problem: str) -> WireLost:
        """Return a fault of the wire that names device and address."""
        return WireLost(f"{self.link.name} at {self.link.address}: {problem}")

    def fault(self, problem: str) -> DeviceFault:
        """Return a fault that names device and address."""
        return DeviceFault(f"{self.link.name} at {self.link.address}: {problem}")
