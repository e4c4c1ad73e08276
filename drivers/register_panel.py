"""The controller's registers by name: reading the status, setting one, waiting for a status word."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from drivers import cia402
from drivers.interfaces import DeviceFault
from drivers.modbus_link import ModbusLink
from drivers.profile import Profile

FAULT_TEXTS = {
    0: "none",
    1: "watchdog: no heartbeat from the computer",
    2: "force limit of the device",
    3: "stroke limit of the device",
    4: "actuator",
}
"""Meaning of register ``fault_code``."""

_POLL_S = 0.002


class RegisterPanel:
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
        self._status_block = profile.block("status_word", "tick")

    def read_status(self) -> dict[str, Any]:
        """Get every status register by name, in one transaction.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        block = self._status_block
        return block.decode(self.link.read(block.address, block.words, "status"))

    def set(self, name: str, value: int) -> None:
        """Set one register.

        Raises
        ------
        DeviceFault
            If the wire fails.
        ValueError
            If the value does not fit the register.
        """
        self.link.write(self.profile.find(name).address, self.profile.encode(name, value), name)

    def demand_kept(self, first: str, last: str, written: Sequence[int]) -> None:
        """Read a window back and see that it holds what was written.

        Raises
        ------
        DeviceFault
            If the wire fails or it holds something else.
        """
        block = self.profile.block(first, last)
        kept = self.link.read(block.address, block.words, f"back {first}")
        if kept != list(written):
            raise self.fault(
                f"{first} … {last} read back as {block.decode(kept)} instead of {block.decode(written)}; "
                "look whether the device bounds them"
            )

    def wait(self, done: Callable[[dict[str, Any]], bool], timeout_s: float) -> dict[str, Any] | None:
        """Wait for a status that fulfils ``done``; return it, or None after ``timeout_s``.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        deadline_s = time.monotonic() + timeout_s
        while not done(values := self.read_status()):
            if time.monotonic() >= deadline_s:
                return None
            time.sleep(_POLL_S)
        return values

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

    def fault(self, problem: str) -> DeviceFault:
        """Return a fault that names device and address."""
        return DeviceFault(f"{self.link.name} at {self.link.address}: {problem}")
