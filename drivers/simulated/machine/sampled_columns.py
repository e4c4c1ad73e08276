"""What the simulated controller samples: its columns, and what the further channels among them feel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.register_maps import DTYPES, WHOLE_RANGES
from bufferstand.drivers.simulated.machine.felt_quantities import BAR_PER_KN_MM2
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.simulated.transducers import Converter
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import conversion
from bufferstand.foundation.channels import STROKE_CHANNELS, Channel

FloatArray = NDArray[np.float64]

_ENDS = {**WHOLE_RANGES, "f32": (float(-(1 << 24)), float(1 << 24))}
"""Counts that a converter gives by the type of its register: whole ones, and of a float those it can hold."""


class SampledColumns:
    """The channels of a controller in the order in which they are converted.

    Force, strokes, position and command come first, and then what else the stand file lists.

    Parameters
    ----------
    stand_file : StandFile
    settings : SimulationSettings
    """

    def __init__(self, stand_file: StandFile, settings: SimulationSettings) -> None:
        channels = {channel.name: channel for channel in stand_file.controller.channel}
        self.strokes = tuple(name for name in STROKE_CHANNELS if name in channels)
        first = ("force", *self.strokes, "position", "command")
        self.names = (*first, *(name for name in channels if name not in first))
        """Every channel, in its column."""
        self.further = tuple(channels[name] for name in self.names[len(first) :])
        self.types = {name: stand_file.profile().sampled[name] for name in self.names}
        self._channels = channels
        self._settings = settings

    @property
    def dtypes(self) -> dict[str, str]:
        """What a sample of the ring holds, and its type: the tick, then each channel's counts."""
        return {"tick": "u4", **{name: DTYPES[kind] for name, kind in self.types.items()}}

    def converters(self) -> list[Converter]:
        """Return how each channel is converted."""
        return [
            Converter(self._channels[name], *_ENDS[kind], noise_of(self._channels[name], self._settings))
            for name, kind in self.types.items()
        ]

    def further_values(self, felt: Mapping[str, FloatArray]) -> FloatArray:
        """Return what the further channels feel, each in its own unit, shape (n, further channels).

        Parameters
        ----------
        felt : mapping of str to NDArray, shape (n,)
            By quantity, as :class:`FeltQuantities` gives it.
        """
        return np.stack([felt[one.quantity] / factor_of(one) for one in self.further], axis=1)


def mean_of(values: Sequence[float]) -> float:
    """Return the mean of what several sensors show."""
    return sum(values) / len(values)


def factor_of(channel: Channel) -> float:
    """Return how much of the inside unit one unit of a further channel is."""
    if channel.quantity in ("position", "command"):
        return 1.0
    return conversion(channel.quantity, channel.unit)[0]


def noise_of(channel: Channel, settings: SimulationSettings) -> float:
    """Return the standard deviation of a channel's noise, in its unit."""
    noise = {
        "force": settings.force_noise_kN,
        "stroke": settings.stroke_noise_mm,
        "position": settings.stroke_noise_mm,
        "temperature": settings.temperature_noise_C,
        "pressure": settings.force_noise_kN * BAR_PER_KN_MM2 / settings.piston_area_mm2,
    }.get(channel.quantity, 0.0)
    return noise / factor_of(channel)
