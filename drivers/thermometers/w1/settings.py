"""What a stand file says about DS18B20 sensors in the kernel's 1-Wire folder."""

from __future__ import annotations

from typing import Literal

from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings


class W1Settings(OneWireSettings):
    """An entry ``kind = "w1"``."""

    kind: Literal["w1"]
