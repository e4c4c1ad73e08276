"""The kind “labjack”."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from bufferstand.drivers.acquisition.kind import AcquisitionKind
from bufferstand.drivers.acquisition.labjack import registers as reg
from bufferstand.drivers.acquisition.labjack.driver import LabJackDriver
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.instruments import InstrumentSite, TcpAddress
from bufferstand.drivers.modbus import Candidate, Likeness, ModbusLink


class LabJackKind(AcquisitionKind[LabJackSettings]):
    """LabJack T7, T8: analog inputs in one stream over Modbus TCP."""

    name = "labjack"
    settings = LabJackSettings
    sources = (
        "T-Series Datasheet, sections 3.1, 3.2, 3.2.4, 20.0.1, 20.0.2 (support.labjack.com)",
        "ljm_constants.json (github.com/labjack/ljm_constants)",
    )

    def driver(self, settings: LabJackSettings, site: InstrumentSite) -> LabJackDriver:
        """Return its driver, not started yet."""
        return LabJackDriver(settings, site.clock, site.stream)

    def moved(self, settings: LabJackSettings, host: str, ports: Sequence[int]) -> LabJackSettings:
        """Return the entry on another Modbus port and stream port."""
        port, stream_port = ports
        return settings.model_copy(update={"host": host, "port": port, "stream_port": stream_port})

    def wire(self, settings: LabJackSettings, folder: Path) -> TcpAddress:
        """Return its Modbus port."""
        del folder
        return TcpAddress(settings.host, settings.port)

    def candidates(self) -> Iterator[Candidate]:
        """Yield one: both models are told by the same test value."""
        yield Candidate("acquisition", self.name, "LabJack T7 or T8", _likeness)


def _likeness(link: ModbusLink) -> Likeness:
    """Compare the test value that LabJack gives for this (ljm_constants.json, TEST)."""
    shown = reg.number_of(link.read(reg.TEST, 2, "test value"))
    if shown != reg.TEST_VALUE:
        return Likeness("does not fit", f"its test register reads 0x{shown:08X}, not 0x{reg.TEST_VALUE:08X}")
    product = round(reg.real_of(link.read(reg.PRODUCT_ID, 2, "product id")))
    return Likeness("fits", f"its test register is right, it says that it is a T{product}")


KIND = LabJackKind()
