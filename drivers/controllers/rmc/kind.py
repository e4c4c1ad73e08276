"""The kind “rmc”."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from bufferstand.drivers.controllers.kind import ControllerKind, ControllerSite
from bufferstand.drivers.controllers.rmc.addresses import MODELS, PRODUCT
from bufferstand.drivers.controllers.rmc.link import RmcLink
from bufferstand.drivers.controllers.rmc.motions import MotionBounds
from bufferstand.drivers.controllers.rmc.settings import RmcSettings
from bufferstand.drivers.modbus import Candidate, Likeness, ModbusLink
from bufferstand.drivers.register_maps import decode_value


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

    def candidates(self) -> Iterator[Candidate]:
        """Yield one: what its product register holds tells the models apart."""
        yield Candidate("controller", self.name, self.title, _likeness)


def _likeness(link: ModbusLink) -> Likeness:
    """Look at %MD7.0, the product (User Manual p. 1110), in either word order."""
    words = link.read(PRODUCT.wire, 2, "product")
    known = {float(one.product): one.name for one in MODELS.values() if one.product is not None}
    for order in ("big", "little"):
        shown = float(decode_value(words, "f32", order))
        if shown in known:
            return Likeness("fits", f"{PRODUCT} says {known[shown]}, word_order = “{order}”")
    raw = " ".join(f"0x{one:04X}" for one in words)
    return Likeness("does not fit", f"{PRODUCT} holds {raw}, the product of no RMC that is known here")


KIND = RmcKind()
