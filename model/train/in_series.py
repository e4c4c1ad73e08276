"""Two springs in a row under one closing: each is pressed by the same force."""

from __future__ import annotations

from bufferstand.model.spring import SpringModel
from bufferstand.model.stepper import SpringStepper

_STROKE_TOLERANCE_MM = 1e-9
_FORCE_TOLERANCE = 1e-12
"""Of both forces together: nearer than their own rounding they cannot come."""
_MOST_TRIALS = 200


class SpringsInSeries:
    """Two springs that remember, in a row; ``force_kN`` is that of either.

    Equal models that have met only each other share a closing equally, so that one of them is stepped for
    both. Of others the share is found at which both forces are the same, where each spring takes its own
    step from its own state.

    Parameters
    ----------
    left, right : SpringModel
        The springs.
    temperature_C : float
        Theirs and the air's at the beginning [°C].
    """

    def __init__(self, left: SpringModel, right: SpringModel, temperature_C: float) -> None:
        self.equal = left is right
        self.left = SpringStepper(left, temperature_C, temperature_C)
        self.right = self.left if self.equal else SpringStepper(right, temperature_C, temperature_C)
        self._share = 0.5

    @property
    def both(self) -> tuple[SpringStepper, SpringStepper]:
        """The two springs; of equal ones the same twice."""
        return self.left, self.right

    def step(self, closing_mm: float, dt_s: float) -> float:
        """Close both together by ``closing_mm`` since contact within ``dt_s``; get the force [kN]."""
        if self.equal:
            return self.left.step(0.5 * closing_mm, dt_s)
        if closing_mm <= 0.0:
            self.left.step(0.5 * closing_mm, dt_s)
            self.right.step(0.5 * closing_mm, dt_s)
            return 0.0
        left_mm, force = self._balance(closing_mm, dt_s)
        self._share = left_mm / closing_mm
        self.left.step(left_mm, dt_s)
        self.right.step(closing_mm - left_mm, dt_s)
        return force

    def _balance(self, closing_mm: float, dt_s: float) -> tuple[float, float]:
        """Return the left stroke at which both press equally, and the force.

        Secants within a bracket that shrinks from both ends (the excess of the left force rises with its
        stroke, since no transition is softer than 0). A preload makes a force jump at contact: there the
        bracket closes about the jump, and the force is the other spring's.
        """
        low, high = 0.0, closing_mm
        forces_low = self._forces(low, closing_mm, dt_s)
        forces_high = self._forces(high, closing_mm, dt_s)
        trial, side = self._share * closing_mm, 0
        weight_low, weight_high = 1.0, 1.0
        for _ in range(_MOST_TRIALS):
            if high - low <= _STROKE_TOLERANCE_MM:
                break
            if not low < trial < high:
                trial = 0.5 * (low + high)
            forces = self._forces(trial, closing_mm, dt_s)
            excess = forces[0] - forces[1]
            if abs(excess) <= _FORCE_TOLERANCE * (forces[0] + forces[1]):
                return trial, 0.5 * (forces[0] + forces[1])
            if excess < 0.0:
                low, forces_low, weight_low = trial, forces, 1.0
                weight_high = 0.5 * weight_high if side < 0 else 1.0
                side = -1
            else:
                high, forces_high, weight_high = trial, forces, 1.0
                weight_low = 0.5 * weight_low if side > 0 else 1.0
                side = 1
            below = weight_low * (forces_low[0] - forces_low[1])
            above = weight_high * (forces_high[0] - forces_high[1])
            span = above - below
            trial = low - below * (high - low) / span if span > 0.0 else 0.5 * (low + high)
            # A secant that lands on an end proves nothing about the other one: go a little inside.
            inside = 0.5 * _STROKE_TOLERANCE_MM
            trial = min(max(trial, low + inside), high - inside)
        # Within so small a bracket either one force is continuous, which this is, or both springs are just
        # at contact, and the one with the smaller preload gives way first.
        return 0.5 * (low + high), min(forces_high[0], forces_low[1])

    def _forces(self, left_mm: float, closing_mm: float, dt_s: float) -> tuple[float, float]:
        return self.left.force_at(left_mm, dt_s), self.right.force_at(closing_mm - left_mm, dt_s)
