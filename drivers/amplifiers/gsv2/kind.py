"""The kind “gsv2”."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.amplifiers.gsv2.amplifier import Gsv2Amplifier
from bufferstand.drivers.amplifiers.gsv2.settings import Gsv2AmplifierSettings
from bufferstand.drivers.amplifiers.gsv2.simulated import Gsv2Device
from bufferstand.drivers.amplifiers.settings import BITS_24
from bufferstand.drivers.instruments import InstrumentSite, NumberForm, SerialKind, WireDevice
from bufferstand.drivers.interfaces import Sensor


class Gsv2Kind(SerialKind[Gsv2AmplifierSettings]):
    """ME GSV-2: a stream of frames or of lines of text."""

    name = "gsv2"
    table = "amplifier"
    settings = Gsv2AmplifierSettings
    sources = ("ME-Meßsysteme, GSV-2AS manual, pp. 16, 18, 29, 38",)

    def driver(self, settings: Gsv2AmplifierSettings, site: InstrumentSite) -> Sensor:
        """Return its driver, not started yet."""
        return Gsv2Amplifier(site.folder / settings.port, settings, site.clock, site.stream)

    def form(self, settings: Gsv2AmplifierSettings, folder: Path) -> NumberForm:
        """Return its numbers: 24 bits about zero, whatever its frames carry of them."""
        del folder
        return NumberForm(-BITS_24[1], BITS_24[1], True, "i4", settings.rate_Hz)

    def ends(self, settings: Gsv2AmplifierSettings, folder: Path) -> tuple[float, float] | None:
        """Return what its frames can carry; a text carries what is set in the amplifier."""
        del folder
        return settings.gsv2.ends

    def simulated(self, settings: Gsv2AmplifierSettings) -> WireDevice:
        """Return a simulated one, set as the stand file says."""
        gsv2 = settings.gsv2
        codes = {} if gsv2.rate_code is None else {gsv2.rate_code: settings.rate_Hz}
        return Gsv2Device(
            settings.rate_Hz, frame=gsv2.frame, decimals=gsv2.decimals, unit="kN", rate_codes=codes
        )


KIND = Gsv2Kind()
