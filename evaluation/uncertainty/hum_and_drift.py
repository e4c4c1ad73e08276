"""Errors of the force that one run has by itself and that go on through all of it: hum, and a drifting zero.

Their phase in each cycle counts. Hum in step with the cycles is the same error in all of them; of a drift
each cycle has its part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray, HumLine
from bufferstand.foundation.numbers import median

_OWN = 5
"""Of the generators by which errors are drawn (:mod:`bufferstand.evaluation.uncertainty.error_model`)."""


@dataclass(frozen=True)
class OwnErrors:
    """What is drawn once for a run and acts by the moment.

    Attributes
    ----------
    lines : tuple of Line
        Hum on the force: amplitudes are known, phases are not.
    drift_kN : float
        Limit of the change of the zero over the run; 0 where none is stated.
    start_s, end_s : float
        Between which the zero drifts evenly.
    sample_s : float
        Distance of the samples that the hum was found in.
    """

    lines: tuple[HumLine, ...] = ()
    drift_kN: float = 0.0
    start_s: float = 0.0
    end_s: float = 1.0
    sample_s: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of each row, by what it is listed: alike for both rows of a wave."""
        hum = [f"force: hum, {line.frequency_Hz:.4g} Hz as sampled" for line in self.lines]
        return (*(["force: drift of the zero"] if self.drift_kN else []), *(n for n in hum for _ in range(2)))

    @property
    def standard_u(self) -> tuple[float, ...]:
        """Standard uncertainty of the factor of each row [kN]."""
        waves = [line.amplitude / float(np.sqrt(2.0)) for line in self.lines for _ in range(2)]
        return (*([self.drift_kN / float(np.sqrt(3.0))] if self.drift_kN else []), *waves)

    def rows(self, time_s: FloatArray) -> FloatArray:
        """Return what each does to the force at points of a curve, shape (K, M): 0 … 1, cosine, sine …

        Points that are means of samples have less of a wave.
        """
        found = []
        if self.drift_kN:
            found.append((time_s - self.start_s) / (self.end_s - self.start_s))
        each = float(time_s[-1] - time_s[0]) / max(1, time_s.size - 1) / self.sample_s
        for line in self.lines:
            angle = 2.0 * np.pi * line.frequency_Hz * (time_s - self.start_s)
            found += [part * _left(line, self.sample_s, each) for part in (np.cos(angle), np.sin(angle))]
        return np.stack(found) if found else np.zeros((0, time_s.size))

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Return factors of the rows, shape (draws, K): rectangular, and waves of any phase."""
        generator = np.random.default_rng((seed, _OWN))
        columns: list[FloatArray] = []
        if self.drift_kN:
            columns.append(generator.uniform(-self.drift_kN, self.drift_kN, draws))
        for line in self.lines:
            phase = generator.uniform(0.0, 2.0 * np.pi, draws)
            columns += [line.amplitude * np.cos(phase), line.amplitude * np.sin(phase)]
        return np.stack(columns, axis=1) if columns else np.zeros((draws, 0))


def _left(line: HumLine, sample_s: float, each: float) -> float:
    """Return how much of a wave is left in means over so many samples."""
    half = np.pi * line.frequency_Hz * sample_s
    if each <= 1.0 or half == 0.0:
        return 1.0
    return abs(float(np.sin(each * half) / (each * np.sin(half))))


def own_errors(lines: Sequence[HumLine], drift_kN: float, time_s: FloatArray) -> OwnErrors:
    """Return a run's own errors, with hum as it was found and the drift that is stated.

    Parameters
    ----------
    lines : sequence of Line
    drift_kN : float
    time_s : array, shape (N,)
        Moments of the record.
    """
    if time_s.size < 2:
        return OwnErrors()
    sample_s = median(np.diff(time_s[:65_536]))
    return OwnErrors(tuple(lines), drift_kN, float(time_s[0]), float(time_s[-1]), sample_s)
