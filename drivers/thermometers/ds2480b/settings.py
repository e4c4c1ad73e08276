"""What a stand file says about DS18B20 sensors behind a DS2480B serial adapter."""

from __future__ import annotations

from typing import Literal

from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings


class Ds2480bSettings(OneWireSettings):
    """An entry ``kind = "ds2480b"``."""

    kind: Literal["ds2480b"]
