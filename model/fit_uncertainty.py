"""How well a fit knows a model's parameters: their covariance, and its errors on held-out cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput

Floats = NDArray[np.float64]

LOGARITHM = "ln "
"""Before the name of a parameter whose natural logarithm was fitted: its uncertainty is relative."""
CURVES = ("loading_kN", "unloading_kN")
AT = " at "
UNIT = " mm"


def knot_name(curve: str, stroke_mm: float) -> str:
    """Return the name of a curve's force at a knot, as ``loading_kN at 5 mm``."""
    return f"{curve}{AT}{stroke_mm:g}{UNIT}"


def knot_of(parameter: str) -> tuple[str, float] | None:
    """Return curve and stroke [mm] of a knot's name; None if it names something else."""
    curve, found, stroke = parameter.partition(AT)
    if not found or curve not in CURVES:
        return None
    try:
        return curve, float(stroke.removesuffix(UNIT))
    except ValueError:
        return None


@dataclass(frozen=True)
class FitUncertainty:
    """Uncertainty of the parameters that a fit found free, and its errors on cycles that it did not see.

    Parameters
    ----------
    parameter : tuple of str
        Names, p of them: keys of the model file (``ln`` before those whose logarithm was fitted), and the
        curves' forces at the knots (:func:`knot_name`).
    standard_uncertainty : tuple of float
        Of each, in its own unit; of a logarithm without one. Shape (p,).
    correlation : tuple of float
        Coefficients below the diagonal, row by row, shape (p (p - 1) / 2,).
    degrees_of_freedom : float
        Effective number of residuals less that of the parameters.
    held_out_cycles : int
        Number of cycles that were foretold by a fit without them; 0 if none was held out.
    held_out_rms_kN : float
        Root mean square of the force's residuals on these cycles [kN].
    held_out_rms_share : float
        The same with each cycle's residuals over its largest force.

    Raises
    ------
    BadInput
        If the lengths do not match, a name appears twice, or a number is not finite or out of range.
    """

    parameter: tuple[str, ...]
    standard_uncertainty: tuple[float, ...]
    correlation: tuple[float, ...]
    degrees_of_freedom: float
    held_out_cycles: int = 0
    held_out_rms_kN: float = 0.0
    held_out_rms_share: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.parameter)
        if len(set(self.parameter)) != count:
            raise BadInput("a parameter stands there twice", place="fit.parameter")
        for name, wanted in (("standard_uncertainty", count), ("correlation", count * (count - 1) // 2)):
            values = getattr(self, name)
            if len(values) != wanted:
                raise BadInput(
                    f"has {len(values)} numbers, and {count} parameters need {wanted}",
                    place=f"fit.{name}",
                    remedy="fit the model again, or leave [fit] out",
                )
        if not all(math.isfinite(u) and u >= 0.0 for u in self.standard_uncertainty):
            raise BadInput("must be 0 or more", place="fit.standard_uncertainty")
        if not all(abs(r) <= 1.0 for r in self.correlation):
            raise BadInput("must lie from -1 to 1", place="fit.correlation")

    @classmethod
    def of(
        cls,
        parameter: tuple[str, ...],
        covariance: Floats,
        degrees_of_freedom: float,
        held_out: tuple[int, float, float] = (0, 0.0, 0.0),
    ) -> FitUncertainty:
        """Return what a covariance, shape (p, p), says; ``held_out``: cycles, rms [kN], rms share."""
        deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        unit = np.where(deviation > 0.0, deviation, 1.0)
        rows, columns = np.tril_indices(len(parameter), -1)
        correlation = np.clip(covariance / np.outer(unit, unit), -1.0, 1.0)[rows, columns]
        return cls(
            parameter,
            tuple(float(f"{u:.6g}") for u in deviation.tolist()),
            tuple(round(r, 6) + 0.0 for r in correlation.tolist()),
            float(f"{degrees_of_freedom:.6g}"),
            held_out[0],
            float(f"{held_out[1]:.6g}"),
            float(f"{held_out[2]:.6g}"),
        )

    @property
    def covariance(self) -> Floats:
        """Covariance of the parameters, shape (p, p)."""
        count = len(self.parameter)
        matrix = np.eye(count)
        rows, columns = np.tril_indices(count, -1)
        matrix[rows, columns] = matrix[columns, rows] = self.correlation
        deviation = np.array(self.standard_uncertainty)
        return np.asarray(matrix * np.outer(deviation, deviation))
