"""A specimen without a spring model, as far as it is known: its loading curve, or nothing but its limits.

The curve is a catalogue's, or what the first slow stroke of the campaign showed. Between its points it is a
monotone cubic (PCHIP): it neither overshoots nor falls where the points rise. The unloading branch is taken
for a constant share below it, ``F_u = (1 − w) F_l``, for which a full stroke absorbs the share ``w`` of what
it stores. The transition between the branches is not known, so a loop is taken for the whole band between its
turns, which is more heat than a small loop brings. Rate and temperature are not in the curve; ``margin``
stands for them wherever a limit is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from bufferstand.foundation.specimen import Catalogue
from bufferstand.protocols.prediction.machine_stroke import Sine, stroke_sine
from bufferstand.protocols.prediction.predictor import (
    Floats,
    HarmonicCycle,
    Predictor,
    StaticCycle,
    Temperatures,
    static_behind,
)

_GRID = 2001
"""Points on which the curve is tabulated: 0.05 mm for 100 mm of stroke."""


@dataclass(frozen=True)
class CurvePredictor:
    """A specimen of which the loading curve is known.

    Parameters
    ----------
    points : sequence of (float, float)
        Stroke [mm] from 0 on and force [kN], both rising.
    absorbed_share : float or None
        Absorbed over stored energy; None: not known.
    heat_capacity_J_per_K : float or None
        None: not known, temperatures stay as they are.
    margin : float
        By so much the forces may exceed the curve.
    source : str
        Where the curve is from, for messages.
    factor : float
        On the forces that are given; 1 is the curve.
    """

    points: tuple[tuple[float, float], ...]
    absorbed_share: float | None
    heat_capacity_J_per_K: float | None
    margin: float
    source: str
    factor: float = 1.0

    @classmethod
    def of_catalogue(cls, catalogue: Catalogue) -> CurvePredictor:
        """Return the predictor of a specimen file's ``[catalogue]``."""
        return cls(
            catalogue.points,
            catalogue.absorbed_share,
            catalogue.heat_capacity_J_per_K,
            catalogue.force_margin,
            "[catalogue] of the specimen",
        )

    @property
    def known_to_mm(self) -> float:
        """To which stroke the curve is known [mm]."""
        return self.points[-1][0]

    @property
    def knows_heat(self) -> bool:
        """Whether temperatures can be predicted."""
        return self.absorbed_share is not None and self.heat_capacity_J_per_K is not None

    @property
    def sensor_lag_s(self) -> None:
        """Nobody states by how much a sensor lags behind the spring."""
        return

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Where the figures come from."""
        percent = 100.0 * (self.margin - 1.0)
        forces = (
            f"the specimen has no spring model: forces are those of the curve from {self.source}, known to "
            f"{self.known_to_mm:.4g} mm; limits are judged with {percent:.3g} % more"
        )
        if self.knows_heat:
            heat = "heat is that of the whole band between the branches, without loss to the air: too high"
            return (forces, heat)
        heat = "heat" if self.absorbed_share is None else "temperatures"
        return (forces, f"the specimen's {heat} {_ONLY_A_THERMOMETER}")

    def bounding(self) -> Predictor:
        """Return the same specimen with the greatest forces it may have."""
        return replace(self, factor=self.margin)

    @cached_property
    def _table(self) -> tuple[Floats, Floats, Floats]:
        """Strokes, forces and stored energy [J] of the loading curve."""
        stroke, force = np.array(self.points).T
        at = np.linspace(0.0, stroke[-1], _GRID)
        on = np.asarray(PchipInterpolator(stroke, force)(at))
        stored = np.concatenate([[0.0], np.cumsum(0.5 * (on[1:] + on[:-1]) * np.diff(at))])
        return at, on, stored

    def _loading(self, stroke_mm: Floats) -> Floats:
        at, on, _ = self._table
        slope = (on[-1] - on[-2]) / (at[-1] - at[-2])
        beyond = np.maximum(stroke_mm - at[-1], 0.0)
        force: Floats = self.factor * (np.interp(stroke_mm, at, on) + slope * beyond)
        return force

    def _loading_at(self, stroke_mm: float) -> float:
        return float(self._loading(np.array([stroke_mm]))[0])

    def _stored(self, stroke_mm: float) -> float:
        at, _, stored = self._table
        return float(self.factor * np.interp(stroke_mm, at, stored))

    @property
    def _share(self) -> float:
        return self.absorbed_share or 0.0

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,  # noqa: ARG002 - a curve knows no rate
        temperature_C: float,  # noqa: ARG002 - nor temperature
        give_mm_per_kN: float = 0.0,
    ) -> HarmonicCycle:
        """Return the band between the turns; its peak is that of the loading curve."""

        def turning_forces(stroke: Sine) -> tuple[float, float]:
            below = (1.0 - self._share) * self._loading_at(stroke.lower_mm) if stroke.lower_mm > 0.0 else 0.0
            return below, self._loading_at(stroke.upper_mm)

        stroke = stroke_sine(Sine(prestress_mm, amplitude_mm), turning_forces, give_mm_per_kN)
        lower_kN, peak_kN = turning_forces(stroke)
        stored_J = self._stored(stroke.upper_mm) - self._stored(max(0.0, stroke.lower_mm))
        return HarmonicCycle(peak_kN, lower_kN, self._share * stored_J, stroke)

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,  # noqa: ARG002 - a curve knows no rate
        temperature_C: float,  # noqa: ARG002 - nor temperature
        give_mm_per_kN: float = 0.0,
    ) -> StaticCycle:
        """Return the cycle to whichever limit comes first."""

        def to(stroke_mm: float) -> StaticCycle:
            end_mm = stroke_mm
            if self._loading_at(end_mm) > force_limit_kN:
                end_mm = self._stroke_of(force_limit_kN, stroke_mm)
            return StaticCycle(self._loading_at(end_mm), self._share * self._stored(end_mm), end_mm)

        return static_behind(to, stroke_limit_mm, give_mm_per_kN)

    def _stroke_of(self, force_kN: float, longest_mm: float) -> float:
        at = np.linspace(0.0, longest_mm, _GRID)
        return float(np.interp(force_kN, self._loading(at), at))

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:  # noqa: ARG002
        """Return the loading curve along a path: the most that the spring gives at each stroke."""
        return np.where(stroke_mm > 0.0, self._loading(stroke_mm), 0.0)

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,  # noqa: ARG002 - what is lost to the air is not known
        power_W: float,
        duration_s: float,
        *,
        heating: float = 1.0,
        cooling: float = 1.0,  # noqa: ARG002
    ) -> Temperatures:
        """Return the temperatures without loss to the air; as they were where the capacity is not known."""
        if not self.knows_heat or self.heat_capacity_J_per_K is None:
            return start
        rise_K = heating * power_W * duration_s / self.heat_capacity_J_per_K
        return Temperatures(start.mass_C + rise_K, start.sensor_C + rise_K)


_ONLY_A_THERMOMETER = "cannot be predicted: only a thermometer on it can stop the test when it is too warm"
_NOTHING = (
    (
        "nothing is known of the specimen's forces (no spring model, no [catalogue]): the first slow stroke "
        "shows them, and every step after it is judged by them before it moves"
    ),
    f"the specimen's heat {_ONLY_A_THERMOMETER}",
)


@dataclass(frozen=True)
class UnknownSpecimenPredictor:
    """A specimen of which nothing is known but its limits: only a slow stroke can be run on it."""

    known_to_mm: float = 0.0
    knows_heat: bool = False
    sensor_lag_s: float | None = None
    assumptions: tuple[str, ...] = _NOTHING

    def bounding(self) -> Predictor:
        """Return itself."""
        return self

    def harmonic(
        self,
        prestress_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,  # noqa: ARG002
        temperature_C: float,  # noqa: ARG002
        give_mm_per_kN: float = 0.0,  # noqa: ARG002
    ) -> HarmonicCycle:
        """Return the sine as it is asked for, with no force known."""
        return HarmonicCycle(0.0, 0.0, 0.0, Sine(prestress_mm, amplitude_mm))

    def static(
        self,
        force_limit_kN: float,
        stroke_limit_mm: float,
        speed_mm_per_s: float,  # noqa: ARG002
        temperature_C: float,  # noqa: ARG002
        give_mm_per_kN: float = 0.0,  # noqa: ARG002
    ) -> StaticCycle:
        """Return a cycle to both limits: it goes no further, and brings no more force."""
        return StaticCycle(force_limit_kN, 0.0, stroke_limit_mm)

    def forces(self, time_s: Floats, stroke_mm: Floats, temperature_C: float) -> Floats:  # noqa: ARG002
        """Return no force: none is known."""
        return np.zeros_like(stroke_mm)

    def temperatures_after(
        self,
        start: Temperatures,
        ambient_C: float,  # noqa: ARG002
        power_W: float,  # noqa: ARG002
        duration_s: float,  # noqa: ARG002
        *,
        heating: float = 1.0,  # noqa: ARG002
        cooling: float = 1.0,  # noqa: ARG002
    ) -> Temperatures:
        """Return the temperatures as they were."""
        return start


MARGIN_OF_ONE_STROKE = 1.15
"""On forces known from one slow stroke: 1 % per kelvin colder, some 5 % of rate, and an uncertain share."""


def curve_of_stroke(stroke_mm: Floats, force_kN: Floats) -> CurvePredictor | None:
    """Return what the first slow stroke to a limit and back shows of a specimen; None if it is no curve.

    Parameters
    ----------
    stroke_mm, force_kN : NDArray, shape (n,)
        Of the stroke, beginning near first contact; what comes after it is not looked at.

    Notes
    -----
    Medians over 40 equal parts of the loading stroke, which noise does not bend; those that do not rise are
    left out. The share is the loop's area over that under the loading branch.
    """
    stroke_mm, force_kN = _first_of(stroke_mm, force_kN)
    top = int(np.argmax(stroke_mm)) if len(stroke_mm) else 0
    if top < 2 * _PARTS or not stroke_mm[top] > 1.0:
        return None
    up, on = stroke_mm[: top + 1], force_kN[: top + 1]
    edges = np.linspace(0.0, float(stroke_mm[top]), _PARTS + 1)
    part = np.clip(np.digitize(up, edges) - 1, 0, _PARTS - 1)
    kept = [at for at in range(_PARTS) if np.any((part == at) & (up > 0.0))]
    middles = [(float(np.median(up[part == at])), float(np.median(on[part == at]))) for at in kept]
    stored_J = float(np.sum(0.5 * (on[1:] + on[:-1]) * np.diff(up)))
    absorbed_J = float(np.sum(0.5 * (force_kN[1:] + force_kN[:-1]) * np.diff(stroke_mm)))
    points = _rising([(0.0, max(0.0, middles[0][1])), *middles, (float(stroke_mm[top]), float(on[-1]))])
    if len(points) < 4 or not stored_J > 0.0:
        return None
    share = min(0.95, max(0.05, absorbed_J / stored_J))
    return CurvePredictor(points, share, None, MARGIN_OF_ONE_STROKE, "the first slow stroke of this campaign")


_PARTS = 40


def _first_of(stroke_mm: Floats, force_kN: Floats) -> tuple[Floats, Floats]:
    """Return the first stroke of a record: from its rise off first contact to its return there."""
    known = np.isfinite(stroke_mm) & np.isfinite(force_kN)
    stroke, force = stroke_mm[known], force_kN[known]
    if not len(stroke):
        return stroke, force
    low, high = 0.02 * stroke.max(), 0.5 * stroke.max()
    begun = int(np.argmax(stroke > high))
    before = np.flatnonzero(stroke[:begun] <= low)
    after = np.flatnonzero(stroke[begun:] <= low)
    first = int(before[-1]) if len(before) else 0
    last = begun + int(after[0]) if len(after) else len(stroke) - 1
    return stroke[first : last + 1], force[first : last + 1]


def _rising(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return the points that lie beyond those before them in stroke and force."""
    kept: list[tuple[float, float]] = []
    for stroke, force in points:
        if not kept or (stroke > kept[-1][0] and force > kept[-1][1]):
            kept.append((stroke, force))
    return tuple(kept)
