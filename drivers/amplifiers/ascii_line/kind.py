"""The kinds “ascii-line”: an amplifier, or a sensor of any quantity, that speaks lines of text."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from bufferstand.drivers.amplifiers.ascii_line.amplifier import AsciiLineDialect
from bufferstand.drivers.amplifiers.ascii_line.description import SpokenLines, spoken
from bufferstand.drivers.amplifiers.ascii_line.settings import (
    AsciiLineSensorSettings,
    AsciiLineSettings,
    LineEntry,
)
from bufferstand.drivers.amplifiers.ascii_line.simulated import AsciiLineDevice
from bufferstand.drivers.amplifiers.serial import SerialAmplifier
from bufferstand.drivers.instruments import (
    InstrumentSite,
    NumberForm,
    SerialAddress,
    SerialKind,
    WireDevice,
)
from bufferstand.drivers.interfaces import Sensor
from bufferstand.foundation import BadInput

_BITS = 10
"""Bits of a character on the line: start, eight data, stop; one more with parity."""
EntryT = TypeVar("EntryT", bound=LineEntry)


class _LineKind(SerialKind[EntryT]):
    name = "ascii-line"
    sources = ("the description that the entry names",)

    def driver(self, settings: EntryT, site: InstrumentSite) -> Sensor:
        """Return its driver, not started yet.

        Raises
        ------
        BadInput
            If the description cannot be read, asks what is not answered, or its values do not fit the line.
        """
        lines = self._spoken(settings, site.folder)
        bits = _BITS + (settings.line.parity == "even")
        most_Hz = settings.baud / (bits * lines.characters)
        if lines.found.fastest_Hz is not None:
            most_Hz = min(most_Hz, lines.found.fastest_Hz)
        if settings.rate_Hz > most_Hz:
            raise BadInput(
                f"rate_Hz = {settings.rate_Hz:g} of “{lines.found.id}” is too fast: {settings.baud} baud and "
                f"the device take {most_Hz:.3g} values a second",
                place=f"{self.table}.rate_Hz",
                remedy=f"write rate_Hz = {most_Hz:.3g} or less, or a larger baud",
            )
        title = f"{lines.found.title}, description {lines.found.id} edition {lines.found.edition}"
        return SerialAmplifier(
            site.folder / settings.port,
            settings,
            site.clock,
            AsciiLineDialect(lines),
            title,
            even_parity=settings.line.parity == "even",
            stream=site.stream,
        )

    def form(self, settings: EntryT, folder: Path) -> NumberForm:
        """Return its numbers: all digits without the point."""
        low, high = self._spoken(settings, folder).ends
        return NumberForm(low, high, True, "i4", settings.rate_Hz)

    def wire(self, settings: EntryT, folder: Path) -> SerialAddress:
        """Return its serial device, with its parity."""
        return SerialAddress(folder / settings.port, settings.baud, settings.line.parity)

    def simulated(self, settings: EntryT) -> WireDevice:
        """Return a simulated one by a shipped description."""
        return self.simulated_in(settings, Path())

    def simulated_in(self, settings: EntryT, folder: Path) -> WireDevice:
        """Return a simulated one."""
        return AsciiLineDevice(self._spoken(settings, folder))

    def _spoken(self, settings: EntryT, folder: Path) -> SpokenLines:
        try:
            return spoken(settings.line.description, settings.line.answers, folder)
        except BadInput as error:
            if error.file is not None:
                raise
            place = f"{self.table}.line.{error.place.removeprefix('line.')}"
            raise BadInput(error.problem, place=place, remedy=error.remedy) from None


class AsciiLineKind(_LineKind[AsciiLineSettings]):
    """An amplifier that speaks lines of text, by a description file."""

    table = "amplifier"
    settings = AsciiLineSettings


class AsciiLineSensorKind(_LineKind[AsciiLineSensorSettings]):
    """A sensor of any quantity that speaks lines of text, by a description file."""

    table = "sensor"
    settings = AsciiLineSensorSettings


KIND = (AsciiLineKind(), AsciiLineSensorKind())
