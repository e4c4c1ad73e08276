"""A simulated DS18B20: one conversion after the other, with noise, in steps of 1/16 °C."""

from __future__ import annotations

from collections import deque

import numpy as np

from bufferstand.drivers.simulated.miswiring import MisplacedThermometer
from bufferstand.drivers.stand_file import SensorSettings

CONVERSION_S = 0.75
"""Time that a DS18B20 takes at 12 bit [s]."""
_KEPT_READINGS = 4096


class Thermometer:
    """One DS18B20: converts for ``CONVERSION_S``, again and again.

    Parameters
    ----------
    settings : SensorSettings
    noise_C : float
        Standard deviation [°C].
    seed : numpy.random.SeedSequence
    place : WrongPlace, optional
        Where it sits in truth, if not where its settings say.
    """

    def __init__(
        self,
        settings: SensorSettings,
        noise_C: float,
        seed: np.random.SeedSequence,
        place: MisplacedThermometer | None = None,
    ) -> None:
        self.settings = settings
        self.place = place
        self._noise_C = noise_C
        self._random = np.random.Generator(np.random.PCG64(seed))
        self._next_s = 0.0
        self.readings: deque[tuple[float, int]] = deque(maxlen=_KEPT_READINGS)
        self.conversions = 0

    def look(self, now_s: float, temperature_C: float) -> None:
        """Finish the conversions that are due at stand time ``now_s`` [s]."""
        while self._next_s <= now_s:
            felt = temperature_C + self._noise_C * float(self._random.standard_normal())
            counts = round(min(125.0, max(-55.0, felt)) * 16.0)
            self.readings.append((self._next_s, counts))
            self.conversions += 1
            self._next_s += CONVERSION_S
