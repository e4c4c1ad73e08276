"""The mean loop of a run: both branches over the stroke."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.numerics import FloatArray

TURN = 0.2
"""The turn of a loop is looked for within this share of its range below the top."""


@dataclass(frozen=True, eq=False)
class MeanLoop:
    """Mean of both branches over the cycles that represent a run.

    Attributes
    ----------
    cycles : tuple of int
    stroke_mm, loading_kN, unloading_kN : arrays, shape (M,)
        Over the range that all of those cycles cover, rising in stroke.
    temperature_C : float or None
        Mean temperature at the start of the cycles.
    temperature_accuracy_C : float or None
        Limit of the error of the specimen's sensors.
    means, expanded_uncertainties : mapping
        Means of the cycles' figures, and of their U, by name; only what is known.
    """

    cycles: tuple[int, ...]
    stroke_mm: FloatArray
    loading_kN: FloatArray
    unloading_kN: FloatArray
    temperature_C: float | None
    temperature_accuracy_C: float | None
    means: Mapping[str, float]
    expanded_uncertainties: Mapping[str, float]

    def cut(self, first_mm: float, last_mm: float) -> MeanLoop:
        """Return the loop between two strokes of its range, as if it had turned at the upper one.

        After a turn the force falls to the unloading curve within a few millimetres. A loop that reaches
        further has done so before it comes back to the cut; its own turn (unloading over loading force, by
        distance from its top) is moved to the cut, or the area would be too large by that corner.
        """
        inner = self.stroke_mm[(self.stroke_mm > first_mm) & (self.stroke_mm < last_mm)]
        stroke = np.concatenate(([first_mm], inner, [last_mm]))
        loading = np.interp(stroke, self.stroke_mm, self.loading_kN)
        unloading = np.interp(stroke, self.stroke_mm, self.unloading_kN)
        shift_mm = float(self.stroke_mm[-1]) - last_mm
        near = stroke >= last_mm - TURN * (last_mm - first_mm)
        if shift_mm > 0.0 and np.all(loading[near] > 0.0):
            share = self.unloading_kN / np.where(self.loading_kN > 0.0, self.loading_kN, np.inf)
            turned = loading * np.interp(stroke + shift_mm, self.stroke_mm, share)
            unloading = np.where(near, np.maximum(unloading, turned), unloading)
        return replace(self, stroke_mm=stroke, loading_kN=loading, unloading_kN=unloading)

    @property
    def end_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capitals
        """Force of the loading branch at its end [kN]."""
        return float(self.loading_kN[-1])

    @property
    def stored_energy_J(self) -> float:  # noqa: N802
        """Area under the loading branch [J]."""
        return float(np.trapezoid(self.loading_kN, self.stroke_mm))

    @property
    def absorbed_energy_J(self) -> float:  # noqa: N802
        """Area between the branches [J]."""
        return float(np.trapezoid(self.loading_kN - self.unloading_kN, self.stroke_mm))
