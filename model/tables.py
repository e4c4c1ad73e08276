"""The curves on a fine uniform grid: integrals of the transition, elastic centre, free energy.

Every lookup (stepwise or vectorised) is ``base[i] + slope[i] * (x - i * step)`` in the same cell, so that
both give the same figures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from bufferstand.model.curves import Curves

Floats = NDArray[np.float64]

STEP_MM = 0.025
"""Aimed width of a grid cell; linear interpolation then errs by less than 0.1 N on a buffer's curve."""
WIDTH_FLOOR_kN = 1e-3
"""Least F_l - F_u in the integrals A and B only: keeps them finite where the curves meet."""
_SMOOTHING_MM = 2.5
_LEAST_RATE = 1e-3  # 1/mm
_GAUSS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class BandTables:
    """Piecewise linear tables over 0 … ``end_mm``; each array holds values at the n + 1 grid points.

    ``a = (k_t - k_u) / h`` and ``b = (k_t - k_l) / h`` rule the transition, ``A`` and ``B`` are their
    integrals over the stroke. ``centre`` is the band position at which neither direction loses energy.

    Parameters
    ----------
    step_mm, end_mm : float
        Cell width and last stroke.
    A, B : NDArray
        Integrals of a and b [-], not falling.
    loading, width : NDArray
        F_l and h = F_l - F_u [kN], contact ramp included.
    centre : NDArray
        p* = a / (a + b) [-].
    middle : NDArray
        (F_l + F_u) / 2 [kN], contact ramp included: the curve of the viscous branch.
    free_energy : NDArray
        G [J]: the hysteresis holds the free energy G (p - p*)² / 2, and keeps it when contact is lost.
    depth : NDArray
        1 - exp(-x / alpha) of eq. (5) [-].
    width_scale_max : float
        Largest factor on the width that leaves F_u >= 0.
    energy_source_mm : float, optional
        Stroke about which small loops of eq. (4) create most energy (``dp*/dx > a b / (a + b)``), if any.
    """

    step_mm: float
    end_mm: float
    A: Floats
    B: Floats
    loading: Floats
    width: Floats
    centre: Floats
    middle: Floats
    free_energy: Floats
    depth: Floats
    width_scale_max: float
    energy_source_mm: float | None

    @classmethod
    def of(cls, curves: Curves, depth_mm: float) -> BandTables:
        """Make the tables of curves; ``depth_mm`` is alpha of eq. (5)."""
        cells = max(8, round(curves.end_mm / STEP_MM))
        x = np.linspace(0.0, curves.end_mm, cells + 1)
        step = curves.end_mm / cells
        nodes, weights = _GAUSS
        inside = (x[:-1, None] + 0.5 * step * (nodes + 1.0)).ravel()
        rates = [r.reshape(cells, -1) @ weights * (0.5 * step) for r in _rates(curves, inside)]
        A, B = (np.concatenate([[0.0], np.cumsum(rate)]) for rate in rates)
        loading = curves.loading(x)
        width = np.maximum(loading - curves.unloading(x), 0.0)
        a, b = _rates(curves, x)
        total = a + b
        centre = np.divide(a, total, out=np.full_like(a, 0.5), where=total > 0.0)
        pull = np.divide(a * b, total, out=np.zeros_like(a), where=total > 0.0)
        drift = np.gradient(centre, step)
        ramp = (
            np.minimum(1.0, x / curves.contact_ramp_mm) if curves.contact_ramp_mm > 0.0 else np.ones_like(x)
        )
        return cls(
            step_mm=step,
            end_mm=curves.end_mm,
            A=A,
            B=B,
            loading=loading * ramp,
            width=width * ramp,
            centre=centre,
            middle=(loading - 0.5 * width) * ramp,
            free_energy=_free_energy(step, width, pull, drift),
            depth=-np.expm1(-x / depth_mm),
            energy_source_mm=_worst(x, np.where(width > WIDTH_FLOOR_kN, drift - pull, 0.0)),
            width_scale_max=float(np.min(loading[width > 0.0] / width[width > 0.0], initial=np.inf)),
        )

    def columns(self) -> Floats:
        """Return the eight tables in the order of the C core's ``bs_cell``, shape (8, n + 1)."""
        return np.array(
            [
                self.A,
                self.B,
                self.loading,
                self.width,
                self.middle,
                self.centre,
                self.free_energy,
                self.depth,
            ]
        )

    def rows(self) -> Floats:
        """Return value and slope of these tables side by side for every cell, shape (n + 1, 16).

        The last stroke falls into a cell of its own, with the slope of the one before.
        """
        values = self.columns()
        slopes = np.diff(values, axis=1) / self.step_mm
        slopes = np.concatenate([slopes, slopes[:, -1:]], axis=1)
        return np.stack([values, slopes], axis=1).reshape(2 * len(values), -1).T

    def cells_of(self, stroke_mm: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Return cell index and stroke within the cell [mm] for strokes already within 0 … ``end_mm``."""
        index = np.minimum((stroke_mm * (1.0 / self.step_mm)).astype(np.intp), len(self.A) - 2)
        return index, stroke_mm - index * self.step_mm

    def at(self, table: Floats, cells: tuple[NDArray[np.intp], Floats]) -> Floats:
        """Return one of the tables at the cells of :meth:`cells_of`, same shape."""
        index, inside = cells
        base = table[index]
        return base + (table[index + 1] - base) / self.step_mm * inside


def _rates(curves: Curves, x: Floats) -> tuple[Floats, Floats]:
    """Return a and b [1/mm] at strokes; by the length rule b stays exact where the curves meet."""
    width = np.maximum(curves.loading(x) - curves.unloading(x), WIDTH_FLOOR_kN)
    k_l, k_u = curves.loading_stiffness(x), curves.unloading_stiffness(x)
    if curves.transition_length_mm is not None:
        steeper = np.maximum(k_l, k_u)
        own = 1.0 / curves.transition_length_mm
        return (steeper - k_u) / width + own, (steeper - k_l) / width + own
    k_t = curves.transition_stiffness(x)
    return np.maximum(k_t - k_u, 0.0) / width, np.maximum(k_t - k_l, 0.0) / width


def _free_energy(step: float, width: Floats, pull: Floats, drift: Floats) -> Floats:
    """Return G of the free energy G (p - p*)² / 2 for which neither direction releases heat below 0.

    G = h / (pull - drift) with pull = a b / (a + b) and drift = dp*/dx makes the heat quadratic in (p - p*).
    The drift is smoothed over the kinks that tables put into it, and the difference bounded where a
    transition is so weak, or the centre so steep, that G would have no limit.
    """
    smooth = uniform_filter1d(drift, max(1, round(_SMOOTHING_MM / step)), mode="nearest")
    least = np.maximum(0.5 * pull, _LEAST_RATE)
    return np.asarray(width / np.maximum(pull - smooth, least), dtype=np.float64)


def _worst(x: Floats, excess: Floats) -> float | None:
    at = int(np.argmax(excess))
    return float(x[at]) if excess[at] > 1e-9 else None
