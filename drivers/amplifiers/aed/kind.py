"""The kind “aed”."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.amplifiers.aed.amplifier import AedAmplifier
from bufferstand.drivers.amplifiers.aed.settings import AedAmplifierSettings
from bufferstand.drivers.amplifiers.aed.simulated import AedDevice
from bufferstand.drivers.amplifiers.settings import BITS_24
from bufferstand.drivers.instruments import InstrumentSite, NumberForm, SerialAddress, SerialKind, WireDevice
from bufferstand.drivers.interfaces import Sensor


class AedKind(SerialKind[AedAmplifierSettings]):
    """HBM AED: commands in text, values in text or binary."""

    name = "aed"
    table = "amplifier"
    settings = AedAmplifierSettings
    sources = ("HBM, AD104-R2/R5 operating instructions, pp. 20-24, 37-39",)

    def driver(self, settings: AedAmplifierSettings, site: InstrumentSite) -> Sensor:
        """Return its driver, not started yet."""
        return AedAmplifier(site.folder / settings.port, settings, site.clock, site.stream)

    def form(self, settings: AedAmplifierSettings, folder: Path) -> NumberForm:
        """Return its numbers: 24 bits about zero, whatever its output format carries of them."""
        del folder
        return NumberForm(-BITS_24[1], BITS_24[1], True, "i4", settings.rate_Hz)

    def ends(self, settings: AedAmplifierSettings, folder: Path) -> tuple[float, float] | None:
        """Return what its output format can carry."""
        del folder
        return settings.aed.ends

    def wire(self, settings: AedAmplifierSettings, folder: Path) -> SerialAddress:
        """Return its serial device, with its parity."""
        return SerialAddress(folder / settings.port, settings.baud, settings.aed.parity)

    def simulated(self, settings: AedAmplifierSettings) -> WireDevice:
        """Return a simulated one, set as the stand file says."""
        return AedDevice(baud=settings.baud, address=settings.aed.address or 31)


KIND = AedKind()
