"""The kind “rmc”."""

from __future__ import annotations

from typing import Any

from bufferstand.drivers.controllers.kind import ControllerKind, ControllerSite
from bufferstand.drivers.controllers.rmc.link import RmcLink
from bufferstand.drivers.controllers.rmc.motions import MotionBounds
from bufferstand.drivers.controllers.rmc.settings import RmcSettings
from bufferstand.drivers.modbus import ModbusLink


class RmcKind(ControllerKind):
    """Delta's electro-hydraulic motion controllers RMC75 and RMC150."""

    name = "rmc"
    title = "Delta RMC75 or RMC150 motion controller by Modbus TCP, with the watchdog program"
    settings = RmcSettings
    profile = "rmc"
    sources = (
        (
            "RMC70/150 and RMCTools User Manual 3.62 (14 January 2016), pp. 187-192 (plots), 718-784 "
            "(commands), 864-899 (status), 1041, 1110, 1138 (registers)"
        ),
        "RMCTools web help: RMC Commands Overview, Command List, RMC75 Registers Files 40-47",
    )
    confirmed = False

    def link(self, settings: Any, site: ControllerSite) -> ModbusLink:
        """Return the gateway to one."""
        assert isinstance(settings, RmcSettings)
        bounds = MotionBounds(site.speed_max_mm_per_s, site.frequency_max_Hz, settings.clear_mm)
        return RmcLink(
            site.wire,
            site.profile,
            settings,
            bounds,
            now_s=site.now_s,
            device_id=site.device_id,
            timeout_s=site.timeout_s,
        )


KIND = RmcKind()
