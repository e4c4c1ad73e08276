"""A predictor that passes calls on to another one; subclasses override what they change."""

from __future__ import annotations

from abc import ABC, abstractmethod

from bufferstand.protocols.prediction.predictor import (
    Floats,
    HarmonicEstimate,
    Predictor,
    StaticEstimate,
    Temperatures,
)


class ForwardingPredictor(ABC):
    """A predictor whose every answer is that of another one."""

    @property
    @abstractmethod
    def asked(self) -> Predictor:
        """The one that is asked."""

    @property
    def known_to_mm(self) -> float:
        """To which stroke forces are known [mm]."""
        return self.asked.known_to_mm

    @property
    def knows_heat(self) -> bool:
        """Whether temperatures can be predicted."""
        return self.asked.knows_heat

    @property
    def sensor_lag_s(self) -> float | None:
        """By how much a sensor lags behind the spring [s]."""
        return self.asked.sensor_lag_s

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Where the figures come from."""
        return self.asked.assumptions

    def bounding(self) -> Predictor:
        """Return the specimen with the greatest forces that it may have."""
        return self.asked.bounding()

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicEstimate:
        """Return the settled harmonic cycle."""
        return self.asked.harmonic(prestress_mm, amplitude_mm, frequency_Hz, temperature_C, give_mm_per_kN)

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,
        temperature_C: float,
        give_mm_per_kN: float = 0.0,
    ) -> StaticEstimate:
        """Return the slow cycle."""
        return self.asked.static(
            force_limit_kN, stroke_limit_mm, speed_mm_per_s, temperature_C, give_mm_per_kN
        )

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:
        """Return the forces along a path [kN]."""
        return self.asked.forces(time_s, stroke_mm, temperature_C)

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,
        power_W: float,
        duration_s: float,
        *,
        heating: float = 1.0,
        cooling: float = 1.0,
    ) -> Temperatures:
        """Return the temperatures after some time of constant heating power."""
        return self.asked.temperatures_after(
            start, ambient_C, power_W, duration_s, heating=heating, cooling=cooling
        )
