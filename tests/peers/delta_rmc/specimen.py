"""What stands against the piston: a stiffening spring with friction, whose loop encloses a positive area."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class SpecimenFacts:
    """A spring of this emulator's own, unlike the project's model.

    Force on the middle line: ``preload + k₁ x + k₃ x³``; the branches lie ``loss`` of it above and below, and
    a branch is reached within about ``turn_mm`` after a reversal (Dahl's friction: ds/dx = (±1 − s) / turn).

    Parameters
    ----------
    preload_kN, k1_kN_per_mm, k3_kN_per_mm3, loss, turn_mm : float
    """

    preload_kN: float = 8.0
    k1_kN_per_mm: float = 1.1
    k3_kN_per_mm3: float = 4.0e-4
    loss: float = 0.18
    turn_mm: float = 2.0


class Specimen:
    """The spring in one state of loading; a stroke below zero is out of contact."""

    def __init__(self, facts: SpecimenFacts) -> None:
        self._facts = facts
        self._stroke_mm = 0.0
        self._branch = 0.0

    def force_kN(self, stroke_mm: float) -> float:  # noqa: N802
        """Move to a stroke [mm] and give the force there [kN], compression positive."""
        move = stroke_mm - self._stroke_mm
        if move != 0.0:
            side = math.copysign(1.0, move)
            self._branch = side + (self._branch - side) * math.exp(-abs(move) / self._facts.turn_mm)
        self._stroke_mm = stroke_mm
        if stroke_mm <= 0.0:
            self._branch = 0.0
            return 0.0
        facts = self._facts
        middle = facts.k1_kN_per_mm * stroke_mm + facts.k3_kN_per_mm3 * stroke_mm**3
        # The preload builds up within a twentieth of a millimetre: no stand meets a step.
        preload = facts.preload_kN * -math.expm1(-stroke_mm / 0.05)
        return (preload + middle) * (1.0 + facts.loss * self._branch)
