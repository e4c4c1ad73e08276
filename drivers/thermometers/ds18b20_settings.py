"""What a stand file says about DS18B20 sensors on a 1-Wire bus, whichever way leads to it."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from bufferstand.drivers.thermometers.ds18b20 import CELSIUS_PER_COUNT, looks_genuine
from bufferstand.drivers.thermometers.settings import ThermometerSensor, ThermometerSettings
from bufferstand.foundation.channels import Calibration
from bufferstand.foundation.settings import WrongKeyError

NOMINAL = Calibration(id="DS18B20 nominal", coefficients=(0.0, CELSIUS_PER_COUNT))


class Ds18b20Sensor(ThermometerSensor):
    """One DS18B20; its counts are 1/16 °C."""

    ADDRESS: ClassVar = "rom"

    rom: str = Field(
        pattern=r"^28-[0-9a-f]{12}$",
        description="28- and 12 hexadecimal digits in small letters, e.g. “28-00000a3f92d7”",
        examples=["28-00000a3f92d7", "28-00000a40117b", "28-00000a4e6f02"],
    )
    """As the kernel names it: ``28-`` and 12 lower-case hex digits."""
    calibration: Calibration = NOMINAL
    """How counts become a value."""

    @property
    def device(self) -> str:
        """What it is, for the run file."""
        return f"{'DS18B20' if looks_genuine(self.rom) else 'DS18B20 (clone)'} {self.rom}"


class OneWireSettings(ThermometerSettings):
    """A 1-Wire bus. Each of its two kinds may have the keys of the other one, too: old files have them."""

    kind: Literal["w1", "ds2480b"]
    """The kernel's 1-Wire folder, or a serial adapter with a DS2480B (DS9097U)."""
    root: str = "/sys/bus/w1/devices"
    """Folder of ``w1``."""
    access: Literal["w1_slave", "temperature", "bulk"] = "w1_slave"
    """How the folder is read; ``bulk`` converts all sensors at once."""
    bulk_master: str = "w1_bus_master1"
    """Folder of the bus master that has ``therm_bulk_read``."""
    port: str = ""
    """Serial device of ``ds2480b``."""
    parasite: bool = False
    """Whether sensors without a supply wire hang on the adapter: strong pull-up while they convert."""
    sensor: tuple[Ds18b20Sensor, ...] = Field(min_length=1)
    """``[[temperature.sensor]]``: its sensors."""

    @model_validator(mode="after")
    def _port_of_the_adapter(self) -> OneWireSettings:
        if (self.kind == "ds2480b") != bool(self.port):
            raise WrongKeyError(
                "port names the serial device of kind = “ds2480b”, and only of that", "port", "kind"
            )
        return self

    @model_serializer(mode="wrap")
    def _short(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the keys of the other kind that say nothing."""
        content: dict[str, Any] = handler(self)
        for key in ("access", "bulk_master", "port", "parasite"):
            if key not in self.model_fields_set:
                content.pop(key, None)
        return content
