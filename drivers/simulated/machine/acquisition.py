"""A simulated acquisition device: many channels of the machine, sampled by a clock of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.acquisition import AcquisitionSettings
from bufferstand.drivers.simulated.machine.felt_quantities import FELT
from bufferstand.drivers.simulated.machine.sampled_columns import factor_of, noise_of
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.simulated.transducers import Converter, Converters, Resampler
from bufferstand.foundation import BadInput

KEPT_SLICES = 65536
"""Most slices of scans that wait for a reader."""


@dataclass(frozen=True)
class Scans:
    """Scans that have become due: stand time [s], shape (n,), and numbers of each channel, shape (n, c)."""

    time_s: NDArray[np.float64]
    counts: NDArray[np.float64]


class SimulatedAcquisition:
    """What an acquisition device of a stand file measures, and what its clock shows.

    Parameters
    ----------
    entry : AcquisitionSettings
    stream : str
    settings : SimulationSettings
        With its noise, and how its clock runs.
    seed : SeedSequence
        Of that noise.

    Raises
    ------
    BadInput
        If the simulated stand has no such quantity, or a calibration cannot be inverted.
    """

    def __init__(
        self,
        entry: AcquisitionSettings,
        stream: str,
        settings: SimulationSettings,
        seed: np.random.SeedSequence,
    ) -> None:
        self.entry, self.stream = entry, stream
        for channel in entry.channels:
            if channel.quantity not in FELT:
                raise BadInput(
                    f"the simulated stand has no {channel.quantity} for channel “{channel.name}”",
                    place=stream,
                    remedy=f"it has {', '.join(FELT)}",
                )
        # It scans by its own crystal: a little faster or slower than it says.
        self.drift = 1e-6 * settings.acquisition_drift_ppm
        self._start_s = settings.acquisition_start_s
        self.scans: deque[Scans] = deque(maxlen=KEPT_SLICES)
        """What nobody has taken yet."""
        rate_Hz = entry.rate_Hz * (1.0 + self.drift)
        self._resamplers = [Resampler(rate_Hz, channel.delay_s) for channel in entry.channels]
        self._converters = Converters(
            tuple(
                Converter(channel, low, high, noise_of(channel, settings), whole=False)
                for channel, (low, high) in zip(entry.channels, entry.ends, strict=True)
            ),
            seed,
        )
        self._factors = [factor_of(channel) for channel in entry.channels]

    def shown_s(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what its clock shows [s] at stand times [s], shape (n,)."""
        return np.asarray(self._start_s + (1.0 + self.drift) * time_s)

    def measure(self, made_s: NDArray[np.float64], felt: Mapping[str, NDArray[np.float64]]) -> None:
        """Take a slice of what its sensors feel, by quantity, at stand times [s], shape (n,) each."""
        columns = []
        due_s = made_s[:0]
        for channel, resampler, factor in zip(
            self.entry.channels, self._resamplers, self._factors, strict=True
        ):
            due_s, value = resampler.take(made_s, felt[channel.quantity] / factor)
            columns.append(value)
        if due_s.size:
            self.scans.append(Scans(due_s, self._converters.counts(np.stack(columns, axis=1))))
