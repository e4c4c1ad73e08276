"""Simulated instruments beside the controller: each samples one quantity by a clock of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.instruments import Instrument
from bufferstand.drivers.simulated.machine.felt_quantities import FELT
from bufferstand.drivers.simulated.machine.sampled_columns import factor_of, noise_of
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.simulated.transducers import Converter, Converters, Resampler
from bufferstand.foundation import BadInput

KEPT_VALUES = 65536
"""Most slices of values that wait for a reader."""

Falsify = Callable[[NDArray[np.float64], NDArray[np.float64], Converters], NDArray[np.float64]]
"""What a wrong wiring makes of counts: stand time [s] and counts, shape (n,) each, and the converters."""


@dataclass(frozen=True)
class InstrumentValues:
    """Values of an instrument that have become due: stand time [s] and counts about zero, shape (n,)."""

    time_s: NDArray[np.float64]
    counts: NDArray[Any]


class SimulatedInstrument:
    """What an instrument of a stand file measures.

    Parameters
    ----------
    instrument : Instrument
    settings : SimulationSettings
        With its noise.
    seed : SeedSequence
        Of that noise.
    falsify : callable, optional
        What a wrong wiring makes of its counts.

    Raises
    ------
    BadInput
        If the simulated stand has no such quantity, or its calibration cannot be inverted.
    """

    def __init__(
        self,
        instrument: Instrument,
        settings: SimulationSettings,
        seed: np.random.SeedSequence,
        falsify: Falsify | None = None,
    ) -> None:
        channel, kind = instrument.channel, instrument.kind
        if channel.quantity not in FELT:
            raise BadInput(
                f"the simulated stand has no {channel.quantity} for channel “{channel.name}”",
                place=f"{'.'.join(str(one) for one in instrument.place if isinstance(one, str))}.channel",
                remedy=f"it has {', '.join(FELT)}",
            )
        self.stream = instrument.stream
        self.form = kind.form(instrument.settings, instrument.folder)
        self.registers = kind.registers(instrument.settings, instrument.folder)
        """Map of one behind Modbus; None of others."""
        self.frames: deque[InstrumentValues] = deque(maxlen=KEPT_VALUES)
        """What nobody has taken yet."""
        self.quantity = channel.quantity
        form = self.form
        self._resampler = Resampler(form.rate_Hz, channel.delay_s)
        converter = Converter(channel, form.low, form.high, noise_of(channel, settings), form.whole)
        self._converters = Converters((converter,), seed)
        self._factor = factor_of(channel)
        self._falsify = falsify

    def measure(self, made_s: NDArray[np.float64], felt: NDArray[np.float64]) -> None:
        """Take a slice of what it feels, in the unit of its quantity, at stand times [s], shape (n,) each."""
        due_s, value = self._resampler.take(made_s, felt / self._factor)
        if not due_s.size:
            return
        counts = self._converters.counts(value[:, np.newaxis])[:, 0]
        if self._falsify is not None:
            counts = self._falsify(due_s, counts, self._converters)
        self.frames.append(InstrumentValues(due_s, counts.astype(np.int64) if self.form.whole else counts))
