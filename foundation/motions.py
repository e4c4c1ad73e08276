"""The motions that a controller makes by itself: data from the plan to the wire.

Strokes in mm, compression positive, amplitude is half the range. In a plan they count from first contact, to
a controller from its own zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class StandStill:
    """Stop at once, and stay there."""

    name: ClassVar[str] = "hold"
    text: ClassVar[str] = "hold"


@dataclass(frozen=True)
class RampTo:
    """Move to a stroke at constant speed."""

    name: ClassVar[str] = "ramp"
    target_mm: float
    speed_mm_per_s: float

    @property
    def text(self) -> str:
        """What it is, for messages."""
        return f"ramp to {self.target_mm:g} mm at {self.speed_mm_per_s:g} mm/s"

    def duration_s(self, from_mm: float) -> float:
        """Return how long it takes from stroke ``from_mm`` [s]."""
        return abs(self.target_mm - from_mm) / self.speed_mm_per_s

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002 - every motion answers alike
        """Return the stroke at its end [mm]."""
        return self.target_mm


@dataclass(frozen=True)
class Release:
    """Ramp to zero force."""

    name: ClassVar[str] = "release"
    speed_mm_per_s: float

    @property
    def text(self) -> str:
        """What it is, for messages."""
        return f"release at {self.speed_mm_per_s:g} mm/s"

    def duration_s(self, from_mm: float) -> float:
        """Return how long it takes from stroke ``from_mm`` [s]; zero force is at first contact."""
        return max(0.0, from_mm) / self.speed_mm_per_s

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return 0.0


@dataclass(frozen=True)
class Harmonic:
    """Sine about ``mean_mm``, where it must stand already: one cycle in, ``cycles`` full ones, one out."""

    name: ClassVar[str] = "harmonic"
    FADE_CYCLES: ClassVar[int] = 2
    mean_mm: float
    amplitude_mm: float
    frequency_Hz: float
    cycles: int

    @property
    def text(self) -> str:
        """What it is, for messages."""
        sine = f"{self.mean_mm:g} ± {self.amplitude_mm:g} mm at {self.frequency_Hz:g} Hz"
        return f"{self.cycles} cycles of {sine}"

    def duration_s(self, from_mm: float) -> float:  # noqa: ARG002
        """Return how long it takes [s], the cycle in and the cycle out included."""
        return (self.cycles + self.FADE_CYCLES) / self.frequency_Hz

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return self.mean_mm

    @property
    def peak_speed_mm_per_s(self) -> float:
        """The greatest speed [mm/s]: 2π f A."""
        return 2.0 * math.pi * self.frequency_Hz * self.amplitude_mm


@dataclass(frozen=True)
class StaticCycles:
    """Compress from zero at constant speed to a limit, unload at once to zero; ``cycles`` times."""

    name: ClassVar[str] = "static"
    speed_mm_per_s: float
    force_limit_kN: float
    stroke_limit_mm: float
    cycles: int
    pause_s: float

    @property
    def text(self) -> str:
        """What it is, for messages."""
        return f"{self.cycles} static cycles to {self.force_limit_kN:g} kN or {self.stroke_limit_mm:g} mm"

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return 0.0


Commandable = RampTo | Release | Harmonic | StaticCycles
"""What a plan has a controller do."""
ControllerMotion = StandStill | Commandable
"""Everything that a controller makes by itself."""
