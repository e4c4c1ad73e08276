"""Loading and unloading curve of a spring and the stiffness of the transition between them, from tables.

Symbols of the paper (eqs. (3), (4)): F_l, F_u [kN] curves, k_l, k_u, k_t [kN/mm] stiffnesses, x [mm] stroke.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator, PPoly

from bufferstand.foundation import BadInput

Floats = NDArray[np.float64]

LEAST_MM = 1e-6
"""Least way between two points of a table, and least ramp [mm]: of less, slopes are no numbers any more."""
_SLACK = 1e-9  # of the table's own size: rounding of the polynomials, not physics


@dataclass(frozen=True)
class Curves:
    """The (quasi)static envelope at the reference temperature, and how steeply the force crosses it.

    Tables are joined by monotone cubics (PCHIP), so no overshoot is invented between their points; a
    stiffness is the slope of that curve. Beyond the last stroke stands a stop, never an extrapolation.

    Parameters
    ----------
    stroke_mm : tuple of float
        Strokes of the tables, rising from 0 (first contact), shape (n,), n >= 2.
    loading_kN, unloading_kN : tuple of float
        F_l and F_u at those strokes, shape (n,), not falling, F_l >= F_u >= 0.
    transition_length_mm : float, optional
        L of the rule k_t = max(k_l, k_u) + (F_l - F_u) / L.
    transition_stiffness_kN_per_mm : tuple of float, optional
        k_t as a table, shape (n,), instead of the rule.
    stop_stiffness_kN_per_mm : float
        Stiffness that is added beyond the last stroke.
    contact_ramp_mm : float
        Stroke over which the force of the preload builds up; 0 lets it jump at contact.

    Raises
    ------
    BadInput
        If the tables contradict themselves; the message names the stroke. ``k_t >= max(k_l, k_u)``
        everywhere is what keeps the force between the curves (``docs/model.md``).
    """

    stroke_mm: tuple[float, ...]
    loading_kN: tuple[float, ...]
    unloading_kN: tuple[float, ...]
    transition_length_mm: float | None = None
    transition_stiffness_kN_per_mm: tuple[float, ...] | None = None
    stop_stiffness_kN_per_mm: float = 500.0
    contact_ramp_mm: float = 0.0

    def __post_init__(self) -> None:
        self._check_shapes()
        self._check_order()
        self._check_transition()

    @classmethod
    def straight(
        cls,
        end_mm: float,
        loading: tuple[float, float],
        unloading: tuple[float, float],
        transition_kN_per_mm: float,
    ) -> Curves:
        """Return the curves of eq. (3): ring springs and leaf springs, all three stiffnesses constant.

        Parameters
        ----------
        end_mm : float
            Last stroke.
        loading, unloading : tuple of float
            Force at stroke 0 [kN] and stiffness [kN/mm]: F_l(0) and k_l, F_u(0) and k_u.
        transition_kN_per_mm : float
            k_t.

        Raises
        ------
        BadInput
            If the curves contradict themselves, see the class.
        """
        return cls(
            stroke_mm=(0.0, end_mm),
            loading_kN=(loading[0], loading[0] + loading[1] * end_mm),
            unloading_kN=(unloading[0], unloading[0] + unloading[1] * end_mm),
            transition_stiffness_kN_per_mm=(transition_kN_per_mm, transition_kN_per_mm),
        )

    def scaled(self, factor: float) -> Curves:
        """Return the curves of a spring with so many times the force, and the stiffness, at every stroke."""

        def times(values: tuple[float, ...]) -> tuple[float, ...]:
            return tuple(factor * value for value in values)

        transition = self.transition_stiffness_kN_per_mm
        return replace(
            self,
            loading_kN=times(self.loading_kN),
            unloading_kN=times(self.unloading_kN),
            transition_stiffness_kN_per_mm=None if transition is None else times(transition),
            stop_stiffness_kN_per_mm=factor * self.stop_stiffness_kN_per_mm,
        )

    @property
    def end_mm(self) -> float:
        """Get the last stroke of the tables [mm]."""
        return self.stroke_mm[-1]

    def loading(self, stroke_mm: Floats) -> Floats:
        """Return F_l [kN] at strokes within the tables, same shape."""
        return np.asarray(self._loading(stroke_mm), dtype=np.float64)

    def unloading(self, stroke_mm: Floats) -> Floats:
        """Return F_u [kN] at strokes within the tables, same shape."""
        return np.asarray(self._unloading(stroke_mm), dtype=np.float64)

    def loading_stiffness(self, stroke_mm: Floats) -> Floats:
        """Return k_l = dF_l/dx [kN/mm] at strokes within the tables, same shape."""
        return np.asarray(self._loading(stroke_mm, 1), dtype=np.float64)

    def unloading_stiffness(self, stroke_mm: Floats) -> Floats:
        """Return k_u = dF_u/dx [kN/mm] at strokes within the tables, same shape."""
        return np.asarray(self._unloading(stroke_mm, 1), dtype=np.float64)

    def transition_stiffness(self, stroke_mm: Floats) -> Floats:
        """Return k_t [kN/mm] at strokes within the tables, same shape."""
        if self.transition_length_mm is None:
            return np.asarray(self._transition(stroke_mm), dtype=np.float64)
        steeper = np.maximum(self.loading_stiffness(stroke_mm), self.unloading_stiffness(stroke_mm))
        width = self.loading(stroke_mm) - self.unloading(stroke_mm)
        return np.asarray(steeper + width / self.transition_length_mm, dtype=np.float64)

    @cached_property
    def _loading(self) -> PchipInterpolator:
        return PchipInterpolator(self.stroke_mm, self.loading_kN)

    @cached_property
    def _unloading(self) -> PchipInterpolator:
        return PchipInterpolator(self.stroke_mm, self.unloading_kN)

    @cached_property
    def _transition(self) -> PchipInterpolator:
        return PchipInterpolator(self.stroke_mm, self.transition_stiffness_kN_per_mm or ())

    def _check_shapes(self) -> None:
        strokes = np.asarray(self.stroke_mm)
        if len(strokes) < 2 or strokes[0] != 0.0:
            raise BadInput(
                "the strokes must begin with 0 (first contact) and be two or more", place="stroke_mm"
            )
        steps = np.diff(strokes)
        if np.any(steps < LEAST_MM):
            at = int(np.argmax(steps < LEAST_MM)) + 1
            raise BadInput(
                f"strokes must rise, but {strokes[at]:g} mm does not",
                place="stroke_mm",
                remedy=f"by {LEAST_MM:g} mm or more",
            )
        if (self.transition_length_mm is None) == (self.transition_stiffness_kN_per_mm is None):
            raise BadInput(
                "the transition needs either its length or its stiffness",
                place="transition",
                remedy="give transition_length_mm or transition_stiffness_kN_per_mm, not both",
            )
        tables: dict[str, tuple[float, ...] | None] = {
            "loading_kN": self.loading_kN,
            "unloading_kN": self.unloading_kN,
            "transition_stiffness_kN_per_mm": self.transition_stiffness_kN_per_mm,
        }
        for name, table in tables.items():
            if table is not None and len(table) != len(strokes):
                raise BadInput(f"{len(table)} values for {len(strokes)} strokes", place=name)
        for name, value in (
            ("transition_length_mm", self.transition_length_mm),
            ("stop_stiffness_kN_per_mm", self.stop_stiffness_kN_per_mm),
        ):
            if value is not None and not value > 0.0:
                raise BadInput(f"must be above 0, got {value:g}", place=name)
        if not 0.0 <= self.contact_ramp_mm < self.end_mm:
            raise BadInput(f"must lie in 0 … {self.end_mm:g} mm", place="contact_ramp_mm")
        if 0.0 < self.contact_ramp_mm < LEAST_MM:
            raise BadInput(
                f"{self.contact_ramp_mm:g} mm is no ramp",
                place="contact_ramp_mm",
                remedy=f"write {LEAST_MM:g} or more, or 0 to let the force jump",
            )

    def _check_order(self) -> None:
        for name, table in (("loading_kN", self.loading_kN), ("unloading_kN", self.unloading_kN)):
            values = np.asarray(table)
            falls = np.diff(values, prepend=0.0) < 0.0  # before the first point: no force below 0
            if np.any(falls):
                at = int(np.argmax(falls))
                raise BadInput(
                    f"the force falls (or is below 0) at {self.stroke_mm[at]:g} mm: {values[at]:g} kN",
                    place=name,
                    remedy="a spring's curve must not fall with the stroke",
                )
        if not self.loading_kN[-1] > 0.0:
            raise BadInput("the loading curve carries no force", place="loading_kN")
        width = PPoly(self._loading.c - self._unloading.c, self._loading.x)
        lowest, at_mm = _minimum(width)
        if lowest < -_SLACK * self.loading_kN[-1]:
            raise BadInput(
                f"the unloading curve lies {-lowest:.4g} kN above the loading curve at {at_mm:.2f} mm",
                place="unloading_kN",
                remedy="a spring cannot give back more than it took: mend the tables there",
            )

    def _check_transition(self) -> None:
        if self.transition_stiffness_kN_per_mm is None:
            return
        scale = max(abs(value) for value in self.transition_stiffness_kN_per_mm)
        for name, curve in (("loading", self._loading), ("unloading", self._unloading)):
            slope = curve.derivative()
            excess = self._transition.c.copy()
            excess[1:] -= slope.c
            lowest, at_mm = _minimum(PPoly(excess, self._transition.x))
            if lowest < -_SLACK * scale:
                raise BadInput(
                    f"k_t is {-lowest:.4g} kN/mm below the stiffness of the {name} curve at {at_mm:.2f} mm, "
                    "so that the force would leave the curves",
                    place="transition_stiffness_kN_per_mm",
                    remedy="raise k_t there, or give transition_length_mm instead",
                )


def _minimum(curve: PPoly) -> tuple[float, float]:
    """Return the least value of a piecewise cubic over all of its range, and where it lies."""
    turns = np.asarray(curve.derivative().roots(discontinuity=False, extrapolate=False), dtype=np.float64)
    places = np.concatenate([curve.x, turns[np.isfinite(turns)]])
    values = curve(places)
    at = int(np.argmin(values))
    return float(values[at]), float(places[at])
