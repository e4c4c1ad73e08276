"""The actuator as a law over frequency: a position loop behind a servo with a delay.

    1/H(f) = (1 + i s f) (g − b f² + i l f)

g is 1 over the gain at rest, b = 1/f₀² and l = 2ζ/f₀ are those of a second-order loop, s = 2π T that of a
servo of first order. At low frequencies only the sum of both lags shows. Which of them it is decides by how
much the amplitude falls at a frequency that nobody has run: with a loop of 4 Hz behind a servo of 20 ms, and
all of it taken for the loop's, 7 % too much is commanded at 2.5 Hz.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

LOOP_DAMPING = 0.8
"""Damping of a well-set position loop, until two frequencies show another."""
SERVO_SHARE, U_SERVO_SHARE = 0.15, 0.1
"""Share of the servo in the lag of both, and its standard uncertainty, until frequencies show another."""
U_STATIC_GAIN, U_BEND_SHARE, U_SLOW_LAG_SHARE = 0.005, 0.5, 0.05
"""Standard uncertainties of what is known of a loop beside its responses: of its gain at rest, of the bend of
a well-set one, of the lag that a slow stroke showed."""
U_GAIN, U_PHASE, U_PHASE_SHARE = 0.001, 0.005, 0.1
"""Of a response: relative, of its gain; of its phase [rad], and as a share of it."""


@dataclass(frozen=True)
class PositionLoop:
    """1/H(f), as above; frequencies in Hz, ``bend`` in 1/Hz², ``lag`` and ``servo`` in 1/Hz."""

    level: float
    bend: float
    lag: float
    servo: float

    def __call__(self, frequency_Hz: float) -> complex:
        """Return 1/H at a frequency."""
        loop = complex(self.level - self.bend * frequency_Hz**2, self.lag * frequency_Hz)
        return loop * complex(1.0, self.servo * frequency_Hz)


def fitted_loop(responses: Mapping[float, complex], slow_lag_s: float) -> PositionLoop:
    """Return the loop that fits best; what one frequency cannot show is that of a well-set loop.

    The gain is what is asked of it and is known best; the phase tells the damping, and is late by what the
    valve's overlap holds the piston at its turns.

    Parameters
    ----------
    responses : mapping of float to complex
        1/H by frequency [Hz].
    slow_lag_s : float
        How late the piston follows a command that moves evenly [s]; 0 where it was not seen.
    """
    lags = [one.imag / frequency for frequency, one in responses.items()]
    lags += [2.0 * math.pi * slow_lag_s] * (slow_lag_s > 0.0)
    if not lags:
        return PositionLoop(1.0, 0.0, 0.0, 0.0)
    both = max(min(lags), 1e-6)
    begin = PositionLoop(
        1.0, _usual_bend((1.0 - SERVO_SHARE) * both), (1.0 - SERVO_SHARE) * both, SERVO_SHARE * both
    )

    def missed(found: np.ndarray) -> list[float]:
        loop = PositionLoop(*found.tolist())
        rows = [(loop.level - 1.0) / U_STATIC_GAIN]
        rows.append((loop.bend - _usual_bend(loop.lag)) / (U_BEND_SHARE * begin.bend + 1e-6))
        rows.append((loop.servo - SERVO_SHARE * (loop.servo + loop.lag)) / (U_SERVO_SHARE * both))
        for frequency, seen in responses.items():
            ratio = cmath.log(loop(frequency) / seen)
            rows += [ratio.real / U_GAIN, ratio.imag / (U_PHASE + U_PHASE_SHARE * abs(cmath.phase(seen)))]
        if slow_lag_s > 0.0:
            both_s = (loop.lag + loop.servo) / (2.0 * math.pi)
            rows.append((both_s / slow_lag_s - 1.0) / U_SLOW_LAG_SHARE)
        return rows

    start = (begin.level, begin.bend, begin.lag, begin.servo)
    if len(missed(np.array(start))) < len(start):
        return begin
    return PositionLoop(*least_squares(missed, start, method="lm").x.tolist())


def _usual_bend(lag: float) -> float:
    """Return the bend of a well-set loop with a lag."""
    return (lag / (2.0 * LOOP_DAMPING)) ** 2
