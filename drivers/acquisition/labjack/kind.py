"""The kind “labjack”."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.acquisition.kind import AcquisitionKind
from bufferstand.drivers.acquisition.labjack.driver import LabJackDriver
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.instruments import InstrumentSite, TcpAddress


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

    def wire(self, settings: LabJackSettings, folder: Path) -> TcpAddress:
        """Return its Modbus port."""
        del folder
        return TcpAddress(settings.host, settings.port)


KIND = LabJackKind()
