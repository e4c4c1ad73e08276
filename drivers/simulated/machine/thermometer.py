"""A simulated temperature sensor: one conversion after the other, with noise, in whole counts."""

from __future__ import annotations

from collections import deque

import numpy as np

from bufferstand.drivers.instruments import SensorEntry, SensorType
from bufferstand.drivers.simulated.miswiring import MisplacedThermometer

_KEPT_READINGS = 4096


class Thermometer:
    """One sensor: converts as long as its type does, again and again.

    Parameters
    ----------
    settings : SensorEntry
    sensor_type : SensorType
        What its counts mean.
    noise_C : float
        Standard deviation [°C].
    seed : numpy.random.SeedSequence
    place : MisplacedThermometer, optional
        Where it sits in truth, if not where its settings say.
    """

    def __init__(
        self,
        settings: SensorEntry,
        sensor_type: SensorType,
        noise_C: float,
        seed: np.random.SeedSequence,
        place: MisplacedThermometer | None = None,
    ) -> None:
        self.settings = settings
        self.place = place
        self._type = sensor_type
        self._noise_C = noise_C
        self._random = np.random.Generator(np.random.PCG64(seed))
        self._next_s = 0.0
        self.readings: deque[tuple[float, int]] = deque(maxlen=_KEPT_READINGS)
        self.conversions = 0

    def look(self, now_s: float, temperature_C: float) -> None:
        """Finish the conversions that are due at stand time ``now_s`` [s]."""
        while self._next_s <= now_s:
            felt = temperature_C + self._noise_C * float(self._random.standard_normal())
            form, counts = self._type.form, float(self._type.nominal.counts_of(felt))
            self.readings.append((self._next_s, round(min(form.high, max(form.low, counts)))))
            self.conversions += 1
            self._next_s += 1.0 / form.rate_Hz

    @property
    def count(self) -> int:
        """What it has measured last."""
        return self.readings[-1][1]
