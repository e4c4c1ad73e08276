"""A controller that a register profile describes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from bufferstand.drivers.controllers.identity import find_mismatch
from bufferstand.drivers.controllers.kind import ControllerKind, ControllerSite
from bufferstand.drivers.modbus import Candidate, Likeness, ModbusLink
from bufferstand.drivers.register_maps import IDENTITY, Profile, load_profile

_OWN_PROTOCOL = ("ring", "polling")
"""Shipped profiles whose registers are those on the wire."""


class RegistersKind(ControllerKind):
    """Modbus registers at the addresses of a profile: bufferstand's own protocol, on any PLC."""

    name = "registers"
    title = "a controller with Modbus registers that a register profile describes"
    settings = None
    profile = "ring"
    sources = ("docs/drivers.md: bufferstand's own register protocol, as a PLC or gateway has it",)
    confirmed = False

    def link(self, settings: Any, site: ControllerSite) -> ModbusLink:
        """Return the link: the registers are those on the wire."""
        del settings
        return ModbusLink(
            site.wire,
            device_id=site.device_id,
            timeout_s=site.timeout_s,
            read_write=site.profile.read_write,
        )

    def candidates(self) -> Iterator[Candidate]:
        """Yield the shipped profiles: each has test values that tell it."""
        for name in _OWN_PROTOCOL:
            profile = load_profile(name)
            title = profile.facts.description or profile.facts.id
            yield Candidate("profile", name, title, partial(_likeness, profile))


def _likeness(profile: Profile, link: ModbusLink) -> Likeness:
    window = profile.span(IDENTITY)
    registers = link.read(window.address, window.words, "identity", table=window.table)
    wrong = find_mismatch(profile, window, registers)
    return Likeness("does not fit", wrong) if wrong else Likeness("fits", "all its test values are there")


KIND = RegistersKind()
