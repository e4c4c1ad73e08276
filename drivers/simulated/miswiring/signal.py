"""A signal that arrives wrong: delayed, smoothed, scaled, shifted, slipped, frozen.

For a whole slice of samples at once, as the computer gets them; and for one sample after the other, as the
controller acts on them. Slices of any length give the same.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.simulated.miswiring.settings import MiswiredForce, MiswiredSignal, MiswiredStroke
from bufferstand.drivers.simulated.transducers import Delay

FloatArray = NDArray[np.float64]


class WrongSignal:
    """What becomes of one signal on its way to the computer.

    Parameters
    ----------
    facts : MiswiredSignal
    """

    def __init__(self, facts: MiswiredSignal) -> None:
        self.facts = facts
        self._time_s: FloatArray = np.empty(0)
        self._value: FloatArray = np.empty(0)
        self._smooth: float | None = None
        self._last_s = 0.0
        self._held: float | None = None

    def arrive(self, time_s: FloatArray, value: FloatArray) -> FloatArray:
        """Return what arrives of the next samples.

        Parameters
        ----------
        time_s : NDArray, shape (n,)
            Stand time, rising from call to call [s].
        value : NDArray, shape (n,)
            What should arrive, in the channel's unit.

        Returns
        -------
        NDArray, shape (n,)
        """
        facts = self.facts
        wrong = facts.scale * self._smoothed(time_s, self._delayed(time_s, value)) + facts.zero
        arrived = np.where(time_s >= facts.from_s, wrong, value)
        if isinstance(facts, MiswiredStroke) and facts.slip_at_s is not None:
            arrived = arrived + np.where(time_s >= facts.slip_at_s, facts.slip_mm, 0.0)
        return arrived if facts.frozen_at_s is None else self._frozen(time_s, arrived, facts.frozen_at_s)

    def _delayed(self, time_s: FloatArray, value: FloatArray) -> FloatArray:
        """Return the signal as it was earlier, straight between samples; before the first one it is that."""
        delay_s = self.facts.delay_s
        if delay_s == 0.0:
            return value
        times, values = np.concatenate((self._time_s, time_s)), np.concatenate((self._value, value))
        first = max(0, int(np.searchsorted(times, time_s[-1] - delay_s)) - 1)
        self._time_s, self._value = times[first:], values[first:]
        return np.asarray(np.interp(time_s - delay_s, times, values), dtype=np.float64)

    def _smoothed(self, time_s: FloatArray, value: FloatArray) -> FloatArray:
        """Return the signal behind a low pass that had been at rest at its first value."""
        if self.facts.low_pass_Hz is None:
            return value
        omega = 2.0 * math.pi * self.facts.low_pass_Hz
        last, last_s = self._smooth, self._last_s
        smooth = np.empty_like(value)
        for row, (at_s, now) in enumerate(zip(time_s.tolist(), value.tolist(), strict=True)):
            last = now if last is None else last - math.expm1(-omega * (at_s - last_s)) * (now - last)
            last_s, smooth[row] = at_s, last
        self._smooth, self._last_s = last, last_s
        return smooth

    def _frozen(self, time_s: FloatArray, value: FloatArray, at_s: float) -> FloatArray:
        """Return the signal, which stays as it is from a time on."""
        moving = int(np.searchsorted(time_s, at_s))
        if moving:
            self._held = float(value[moving - 1])
        if self._held is None:
            self._held = float(value[0])
        return np.where(time_s >= at_s, self._held, value)


class WrongForce:
    """The force that a miswired controller acts on, sample by sample: the law of :class:`WrongSignal`.

    Parameters
    ----------
    facts : MiswiredForce
    period_s : float
        Of the controller's samples [s].
    """

    def __init__(self, facts: MiswiredForce, period_s: float) -> None:
        self._facts = facts
        self._path = Delay(facts.delay_s, period_s, facts.low_pass_Hz)
        self._held: float | None = None

    @property
    def has_memory(self) -> bool:
        """Whether what is felt now hangs on what was before, so that no samples may be bridged."""
        return self._facts.delay_s > 0.0 or self._facts.low_pass_Hz is not None

    def feel(self, time_s: float, force_kN: float, *, instead: float | None = None) -> float:
        """Return what the controller takes for the force at a stand time.

        Parameters
        ----------
        time_s : float
            Stand time [s].
        force_kN : float
            What it should feel [kN].
        instead : float, optional
            Value of the channel that hangs on its input instead.
        """
        facts = self._facts
        passed = self._path.push(force_kN if instead is None else instead)
        felt = facts.scale * passed + facts.zero if time_s >= facts.from_s else force_kN
        if facts.frozen_at_s is None:
            return felt
        if time_s < facts.frozen_at_s or self._held is None:
            self._held = felt
        return self._held
