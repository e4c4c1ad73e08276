"""What the simulated controller samples: its columns, and what the further channels among them feel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.register_maps import DTYPES, RegisterType
from bufferstand.drivers.simulated.imperfections import TransducerDrift
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.simulated.transducers import Converter
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import conversion
from bufferstand.foundation.channels import STROKE_CHANNELS, Channel

FloatArray = NDArray[np.float64]

_ENDS: Mapping[RegisterType, tuple[float, float]] = {
    "u16": (0.0, 65535.0),
    "i16": (-32768.0, 32767.0),
    "u32": (0.0, float((1 << 32) - 1)),
    "i32": (float(-(1 << 31)), float((1 << 31) - 1)),
    "f32": (float(-(1 << 24)), float(1 << 24)),
}
"""Counts that a converter gives by the type of its register: whole ones, and of a float those it can hold."""

FORCE, STROKE, POSITION, COMMAND, TRUE_FORCE = range(5)
"""Columns of the truth that channels feel: load cell, specimen, piston, set point, contact."""

_BAR_PER_KN_MM2 = 1e4
"""1 kN on 1 mm² is 10 kbar."""


class SampledColumns:
    """The channels of a controller in the order in which they are converted.

    Force, strokes, position and command come first, and then what else the stand file lists.

    Parameters
    ----------
    stand_file : StandFile
    settings : SimulationSettings
    drift : TransducerDrift
        What becomes of a further force, as of the first one.
    """

    def __init__(self, stand_file: StandFile, settings: SimulationSettings, drift: TransducerDrift) -> None:
        channels = {channel.name: channel for channel in stand_file.controller.channel}
        self.strokes = tuple(name for name in STROKE_CHANNELS if name in channels)
        first = ("force", *self.strokes, "position", "command")
        self.names = (*first, *(name for name in channels if name not in first))
        """Every channel, in its column."""
        self.further = tuple(channels[name] for name in self.names[len(first) :])
        self.types = {name: stand_file.profile().sampled[name] for name in self.names}
        self._channels = channels
        self._settings = settings
        self._drift = drift
        self._last = (0.0, 0.0, 0.0)

    @property
    def dtypes(self) -> dict[str, str]:
        """What a sample of the ring holds, and its type: the tick, then each channel's counts."""
        return {"tick": "u4", **{name: DTYPES[kind] for name, kind in self.types.items()}}

    def converters(self) -> list[Converter]:
        """Return how each channel is converted."""
        return [
            Converter(self._channels[name], *_ENDS[kind], self._noise(self._channels[name]))
            for name, kind in self.types.items()
        ]

    def _noise(self, channel: Channel) -> float:
        """Return the standard deviation of a channel's noise, in its unit."""
        settings = self._settings
        noise = {
            "force": settings.force_noise_kN,
            "stroke": settings.stroke_noise_mm,
            "position": settings.stroke_noise_mm,
            "temperature": settings.temperature_noise_C,
            "pressure": settings.force_noise_kN * _BAR_PER_KN_MM2 / settings.piston_area_mm2,
        }.get(channel.quantity, 0.0)
        return noise / _factor(channel)

    def feel_further(self, time_s: FloatArray, truth: FloatArray) -> FloatArray:
        """Return what the further channels feel.

        Parameters
        ----------
        time_s : NDArray, shape (n,)
            Stand time of each sample [s].
        truth : NDArray, shape (n, columns)
            Force of the load cell, stroke, position, command and force of the contact come first.

        Returns
        -------
        NDArray, shape (n, further channels)
            In each one's unit.
        """
        force_kN = truth[:, FORCE : FORCE + 1].copy()
        self._drift.feel(time_s, force_kN)
        speed_mm_per_s, acceleration = self._moved(time_s, truth[:, STROKE])
        felt = {
            "force": force_kN[:, 0],
            "position": truth[:, POSITION],
            "command": truth[:, COMMAND],
            "pressure": truth[:, TRUE_FORCE] * _BAR_PER_KN_MM2 / self._settings.piston_area_mm2,
            "temperature": self._settings.ambient_C + self._drift.warmth_K(time_s),
            "speed": speed_mm_per_s,
            "acceleration": acceleration,
        }
        return np.stack([felt[channel.quantity] / _factor(channel) for channel in self.further], axis=1)

    def _moved(self, time_s: FloatArray, stroke_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return speed [mm/s] and acceleration [m/s²] of the specimen from one sample to the next."""
        last_s, last_mm, last_speed = self._last
        steps_s = np.diff(time_s, prepend=last_s)
        speed = np.diff(stroke_mm, prepend=last_mm) / steps_s
        acceleration = np.diff(speed, prepend=last_speed) / steps_s / 1000.0
        self._last = float(time_s[-1]), float(stroke_mm[-1]), float(speed[-1])
        return speed, acceleration


def mean_of(values: Sequence[float]) -> float:
    """Return the mean of what several sensors show."""
    return sum(values) / len(values)


def _factor(channel: Channel) -> float:
    """Return how much of the inside unit one unit of a further channel is."""
    if channel.quantity in ("position", "command"):
        return 1.0
    return conversion(channel.quantity, channel.unit)[0]
