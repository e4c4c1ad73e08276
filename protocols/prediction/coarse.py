"""A predictor that interpolates between a few temperatures, for a planner that asks thousands of times."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from bufferstand.protocols.prediction.forwarding import ForwardingPredictor
from bufferstand.protocols.prediction.machine_stroke import Sine
from bufferstand.protocols.prediction.predictor import HarmonicCycle, Predictor, StaticCycle

_Key = tuple[float, ...]
_CycleT = TypeVar("_CycleT")


@dataclass
class CoarsePredictor(ForwardingPredictor):
    """A predictor that is asked at every eighth kelvin only and interpolates between, for the planner.

    What a cycle absorbs is smooth in temperature, so that this errs by far less than the model itself. Forces
    along a path and temperatures are as exact as they are.

    Parameters
    ----------
    fine : Predictor
        Who knows.
    step_C : float
        Distance of the temperatures at which it is asked [K].
    """

    fine: Predictor
    step_C: float = 8.0
    _harmonic: dict[_Key, HarmonicCycle] = field(default_factory=dict)
    _static: dict[_Key, StaticCycle] = field(default_factory=dict)

    @property
    def asked(self) -> Predictor:
        """The one that knows."""
        return self.fine

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicCycle:
        """Return the settled harmonic cycle."""

        def ask(at_C: float) -> HarmonicCycle:
            found = self.fine.harmonic(prestress_mm, amplitude_mm, frequency_Hz, at_C, give_mm_per_kN)
            return HarmonicCycle(
                found.peak_force_kN, found.lower_force_kN, found.absorbed_energy_J, found.stroke
            )

        what = (prestress_mm, amplitude_mm, frequency_Hz, give_mm_per_kN)
        low, high, share = self._between(self._harmonic, what, ask, temperature_C)
        return HarmonicCycle(
            _mixed(low.peak_force_kN, high.peak_force_kN, share),
            _mixed(low.lower_force_kN, high.lower_force_kN, share),
            _mixed(low.absorbed_energy_J, high.absorbed_energy_J, share),
            Sine(
                _mixed(low.stroke.mean_mm, high.stroke.mean_mm, share),
                _mixed(low.stroke.amplitude_mm, high.stroke.amplitude_mm, share),
            ),
        )

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> StaticCycle:
        """Return the slow cycle."""

        def ask(at_C: float) -> StaticCycle:
            found = self.fine.static(force_limit_kN, stroke_limit_mm, speed_mm_per_s, at_C, give_mm_per_kN)
            return StaticCycle(found.peak_force_kN, found.absorbed_energy_J, found.end_stroke_mm)

        what = (force_limit_kN, stroke_limit_mm, speed_mm_per_s, give_mm_per_kN)
        low, high, share = self._between(self._static, what, ask, temperature_C)
        return StaticCycle(
            _mixed(low.peak_force_kN, high.peak_force_kN, share),
            _mixed(low.absorbed_energy_J, high.absorbed_energy_J, share),
            _mixed(low.end_stroke_mm, high.end_stroke_mm, share),
        )

    def _between(
        self,
        known: dict[_Key, _CycleT],
        what: _Key,
        ask: Callable[[float], _CycleT],
        temperature_C: float,
    ) -> tuple[_CycleT, _CycleT, float]:
        """Return the cycles at the temperatures below and above, and how far it is from the first."""
        low_C = math.floor(temperature_C / self.step_C) * self.step_C
        ends = []
        for at_C in (low_C, low_C + self.step_C):
            key = (*what, at_C)
            if key not in known:
                known[key] = ask(at_C)
            ends.append(known[key])
        return ends[0], ends[1], (temperature_C - low_C) / self.step_C


def _mixed(low: float, high: float, share: float) -> float:
    return low + share * (high - low)
