"""What real channels have besides white noise, made by itself: hum, coloured noise, a zero that drifts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.signals import Floats

Disturbance = Literal["hum", "coloured", "drift"]
MAINS_HZ = 50.0
STROKE_MM = 0.01
"""Amplitude of hum, and standard deviation of coloured noise, of the stroke."""
SURE_FORCE = ChannelUncertainty(accuracy_percent=1e-3, reversibility_percent=0.0, zero=1e-3, u_delay_s=1e-6)
SURE_WIRES = (ChannelUncertainty(linearity=1e-4, zero=1e-4, u_delay_s=0.0),) * 2
"""Channels so good that what is left is noise."""


def coloured(generator: np.random.Generator, size: int, step_s: float, time_s: float) -> Floats:
    """Return noise of standard deviation 1 that forgets itself in a time: first-order autoregression."""
    share = float(np.exp(-step_s / time_s))
    white = generator.standard_normal(size + 200)
    return np.asarray(lfilter([np.sqrt(1.0 - share**2)], [1.0, -share], white)[200:])


def disturbed(
    kinds: Sequence[Disturbance],
    columns: tuple[Floats, Floats, Floats],
    generator: np.random.Generator,
    drift_kN: float = 0.0,
) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke and force with disturbances of sizes that occur.

    Hum of 0.05 to 0.4 % of the force's range, noise of 0.03 to 0.2 % that forgets itself in 5 to 50 ms, a
    zero that drifts evenly by up to ``drift_kN`` over the record.
    """
    time, stroke, force = columns
    span = float(np.ptp(force))
    if "hum" in kinds:
        wave = np.sin(2.0 * np.pi * MAINS_HZ * time + generator.uniform(0.0, 2.0 * np.pi))
        force = force + span * generator.uniform(0.0005, 0.004) * wave
        stroke = stroke + STROKE_MM * wave
    if "coloured" in kinds:
        step_s, forgets_s = float(time[1] - time[0]), generator.uniform(0.005, 0.05)
        size = span * generator.uniform(0.0003, 0.002)
        force = force + size * coloured(generator, time.size, step_s, forgets_s)
        stroke = stroke + STROKE_MM * coloured(generator, time.size, step_s, forgets_s)
    if "drift" in kinds:
        force = force + generator.uniform(-1.0, 1.0) * drift_kN * (time - time[0]) / np.ptp(time)
    return time, stroke, force
