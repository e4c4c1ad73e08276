"""A family of spring models as one function: from parameters and nodes to forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.families.data import FamilyData
from bufferstand.model.identification import LAWS, FixedParts, Law, curves_at_knots
from bufferstand.model.tables import BandTables

Floats = NDArray[np.float64]
Values = dict[str, float]
Branches = tuple[Floats, Floats]
"""Shares, shape (k,), and lags [mm], shape (k, n), of viscous branches beta (F_m(x) - F_m(xi))."""

LEAST_RISE_kN = 1e-3


@dataclass(frozen=True, eq=False)
class Family:
    """What a spring of this kind is.

    Parameters
    ----------
    name, title : str
        For options, and for people.
    laws : tuple of Law
        Its parameters beside the curves.
    branches : callable
        Values and nodes to viscous branches.
    band : callable, optional
        Values and nodes to band positions between the two curves; None if the spring has one curve.
    by_tables : callable, optional
        The same of a law that needs the integrals of the curves.
    """

    name: str
    title: str
    laws: tuple[Law, ...]
    branches: Callable[[Values, FamilyData], Branches]
    band: Callable[[Values, FamilyData], Floats] | None = None
    by_tables: Callable[[FamilyData, BandTables], Floats] | None = None

    @property
    def two_curves(self) -> bool:
        """Whether it has a loading and an unloading curve, or one."""
        return self.band is not None or self.by_tables is not None

    def points(self, frame: FixedParts) -> int:
        """Return how many entries of the vector are the curves'."""
        return frame.points * (2 if self.two_curves else 1)

    def values(self, frame: FixedParts, vector: Floats) -> Values:
        """Return the parameters beside the curves, by name."""
        first = self.points(frame)
        return {law.name: law.to_value(float(vector[first + n])) for n, law in enumerate(self.laws)}

    def start(self, frame: FixedParts, spring: Floats) -> Floats:
        """Return a vector to begin with, from that of our own model."""
        n = frame.points
        curves = spring[: 2 * n] if self.two_curves else 0.5 * (spring[:n] + spring[n : 2 * n])
        own = {law.name: float(spring[frame.place(law.name)]) for law in LAWS}
        laws = [own[law.name] if law in LAWS else law.to_vector(law.start) for law in self.laws]
        return np.concatenate([np.maximum(curves, 10.0 * LEAST_RISE_kN), laws])

    def bounds(self, frame: FixedParts) -> tuple[Floats, Floats]:
        """Return the bounds of the vector: no curve falls."""
        n, count = frame.points, self.points(frame)
        low = [LEAST_RISE_kN] * n + [0.0] * (count - n)
        high = [np.inf] * count
        for law in self.laws:
            low.append(law.to_vector(law.low))
            high.append(law.to_vector(law.high))
        return np.array(low), np.array(high)

    def scales(self, frame: FixedParts, vector: Floats) -> Floats:
        """Return by how much each entry may differ: the unit of steps."""
        count = self.points(frame)
        even = float(np.sum(vector[: frame.points])) / frame.points
        return np.concatenate([np.maximum(vector[:count], 0.3 * even), [law.range for law in self.laws]])

    def force_kN(  # noqa: N802 - the unit keeps its capital
        self, frame: FixedParts, vector: Floats, data: FamilyData
    ) -> Floats:
        """Return the force at every node, shape (n,).

        F = s (F_u + e (F_l - F_u) p) + sum of beta (s F_m(x) - s(xi) F_m(xi)), 0 out of contact.

        Raises
        ------
        BadInput
            If between two knots the unloading curve would pass above the loading curve.
        """
        values = self.values(frame, vector)
        loading, unloading = self._curves(frame, vector)
        x = data.x_mm
        upper = loading(x)
        middle, force = upper, upper
        if self.two_curves:
            lower = unloading(x)
            middle = 0.5 * (upper + lower)
            width = data.width_scale * (upper - lower)
            force = upper - (1.0 - self._band(frame, vector, values, data)) * width
        s = data.scaled(x)
        total = s * force
        shares, lags = self.branches(values, data)
        if shares.size:
            inner = np.clip(x - lags, 0.0, frame.knots_mm[-1])
            inner_kN = loading(inner)
            if self.two_curves:
                inner_kN = 0.5 * (inner_kN + unloading(inner))
            total = total + np.sum(shares[:, None] * (s * middle - data.scaled(inner) * inner_kN), axis=0)
        return np.where(data.experiment.drive.stroke_mm > 0.0, np.maximum(total, 0.0), 0.0)

    def _curves(
        self, frame: FixedParts, vector: Floats
    ) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
        n = frame.points
        if not self.two_curves:
            one = _ramped(frame, np.cumsum(vector[:n]))
            return one, one
        loading, unloading = curves_at_knots(frame, vector)
        return _ramped(frame, loading), _ramped(frame, unloading)

    def _band(self, frame: FixedParts, vector: Floats, values: Values, data: FamilyData) -> Floats:
        if (band := self.band) is not None:
            return kept(data, self.name, list(values.values()), lambda: band(values, data))
        if self.by_tables is None:
            raise BadInput(f"the family “{self.name}” has no law of the band")
        loading, unloading = curves_at_knots(frame, vector)
        curves = Curves(
            frame.knots_mm,
            tuple(loading.tolist()),
            tuple(unloading.tolist()),
            values["transition_length_mm"],
            contact_ramp_mm=frame.contact_ramp_mm,
        )
        return self.by_tables(data, BandTables.of(curves, data.depth_mm))


def _ramped(frame: FixedParts, at_knots_kN: Floats) -> Callable[[Floats], Floats]:
    """Return the curve through the knots, its preload built up over the contact ramp."""
    curve, ramp_mm = PchipInterpolator(frame.knots_mm, at_knots_kN), frame.contact_ramp_mm

    def force(x_mm: Floats) -> Floats:
        return np.asarray(curve(x_mm) * np.minimum(x_mm / ramp_mm, 1.0) if ramp_mm else curve(x_mm))

    return force


def kept(data: FamilyData, name: str, values: Sequence[float], made: Callable[[], Floats]) -> Floats:
    """Return what a law answered to these values before, or now; the last few are kept."""
    key = (name, np.array(values).tobytes())
    if key not in data.kept:
        if len(data.kept) > 8:
            data.kept.clear()
        data.kept[key] = made()
    return data.kept[key]
