"""A controller that a register profile describes."""

from __future__ import annotations

from typing import Any

from bufferstand.drivers.controllers.kind import ControllerKind, ControllerSite
from bufferstand.drivers.modbus import ModbusLink


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


KIND = RegistersKind()
