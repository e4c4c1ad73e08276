"""The DS18B20 as a type of sensor: what its counts mean, and which faults it shows."""

from __future__ import annotations

from bufferstand.drivers.instruments import NumberForm, SensorType
from bufferstand.drivers.thermometers.ds18b20 import (
    CONVERSION_S,
    FAULT_TEXTS,
    HIGHEST_COUNT,
    LOWEST_COUNT,
    POWER_ON_COUNT,
    ReadingFault,
)
from bufferstand.drivers.thermometers.ds18b20_settings import NOMINAL

SHOWN_AS = {
    "silent": ReadingFault.EMPTY,
    "crc": ReadingFault.CRC_REFUSED,
    "missing": ReadingFault.ABSENT,
    **{
        kind.value: kind
        for kind in ReadingFault
        if kind not in (ReadingFault.EMPTY, ReadingFault.CRC_REFUSED, ReadingFault.ABSENT)
    },
}
"""What a driver makes of each simulated fault that it can see at all."""


DS18B20 = SensorType(
    nominal=NOMINAL,
    form=NumberForm(LOWEST_COUNT, HIGHEST_COUNT, True, "i2", 1.0 / CONVERSION_S),
    uncorrected="a DS18B20 (counts of 1/16 °C) is off by 0.5 K",
    corrected_K=5.0,
    faults={**{name: FAULT_TEXTS[fault] for name, fault in SHOWN_AS.items()}, "frozen": None, "stale": None},
    power_on=float(POWER_ON_COUNT),
)
"""The sensor, by its data sheet."""
