"""What the planner asks of the spring model, as the smallest interface that will do."""

from __future__ import annotations

from typing import Protocol


class CycleEstimate(Protocol):
    """What one settled cycle is expected to do."""

    @property
    def peak_force_kN(self) -> float:
        """Greatest force [kN]."""
        ...

    @property
    def absorbed_energy_J(self) -> float:
        """Energy turned into heat in one cycle [J]."""
        ...


class StaticEstimate(CycleEstimate, Protocol):
    """What one quasi-static cycle is expected to do."""

    @property
    def end_stroke_mm(self) -> float:
        """Stroke at which it turns [mm]."""
        ...


class Predictor(Protocol):
    """The spring model as the planner sees it."""

    def harmonic(
        self, prestress_mm: float, amplitude_mm: float, frequency_Hz: float, temperature_C: float
    ) -> CycleEstimate:
        """Return the settled harmonic cycle."""
        ...

    def static(
        self, force_limit_kN: float, stroke_limit_mm: float, speed_mm_per_s: float, temperature_C: float
    ) -> StaticEstimate:
        """Return the cycle from zero to whichever limit comes first, and back."""
        ...

    def temperature_after(
        self, temperature_C: float, ambient_C: float, power_W: float, duration_s: float
    ) -> float:
        """Return the specimen's temperature [°C] after ``duration_s`` of constant heating power."""
        ...
