"""The basis on which a step is judged: limits, the specimen's forces, and whose strokes are asked for."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.protocols.limits import TOLERANCE, Envelope
from bufferstand.protocols.planning.limit_checks.broken_limit import KNOWN, BrokenLimit
from bufferstand.protocols.prediction import Predictor


@dataclass(frozen=True)
class CheckBasis:
    """Holds what a step is judged by.

    Parameters
    ----------
    limits : Envelope
        The limits in force.
    predictor : Predictor
        The spring model.
    ramp_speed_mm_per_s : float
        Of the ramp to the prestress or hold.
    coldest_C : float
        The lowest temperature the specimen can have: forces are greatest there.
    compensate : bool
        Whether the strokes judged are the specimen's; else they are the piston's, and the specimen's are less
        by what the machine gives way.
    """

    limits: Envelope
    predictor: Predictor
    ramp_speed_mm_per_s: float
    coldest_C: float
    compensate: bool = True

    @property
    def taken_mm_per_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """What the machine takes of a stroke that is asked for [mm/kN]."""
        return 0.0 if self.compensate else self.limits.machine.give_mm_per_kN

    def unknown(self, stroke_mm: float) -> BrokenLimit | None:
        """Return the breach of going where no force is known."""
        known_mm = self.predictor.known_to_mm
        if known_mm == 0.0 or stroke_mm <= known_mm * (1.0 + TOLERANCE):
            return None
        problem = f"the stroke of {stroke_mm:g} mm is beyond {known_mm:.4g} mm, to which its force is known"
        return BrokenLimit(KNOWN, problem, {})

    def place(self, stroke_mm: float) -> str:
        """Return where a force is expected, as a refusal says it."""
        whose = f"{stroke_mm:g} mm" if self.compensate else f"the piston's {stroke_mm:g} mm"
        return f"{whose} and {self.coldest_C:g} °C"
