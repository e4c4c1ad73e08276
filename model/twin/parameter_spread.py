"""How far the force of a model lies from the spring's because its parameters are not known better."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.fit_uncertainty import LOGARITHM, FitUncertainty, knot_of
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]

_THERMAL = ("ln capacity_J_per_K", "ln loss_W_per_K", "ln sensor_lag_s")
"""They move the force by way of the temperature alone, whose uncertainty is counted by itself."""
_PARTS = 12
"""Components of the covariance that are kept: of some fifty, the others are below rounding."""
_LOOP_POINTS = 80
_SETTLED_TAU = 3.0
_MOST_LOOPS = 8


@dataclass(frozen=True, eq=False)
class _KnownLoop:
    """Components of the force's uncertainty along one loop: over the stroke, loading and unloading."""

    ends_mm: tuple[float, float]
    period_s: float
    temperature_C: float
    stroke_mm: Floats
    loading_kN: Floats
    unloading_kN: Floats

    def is_like(self, ends_mm: tuple[float, float], period_s: float, temperature_C: float) -> bool:
        span = ends_mm[1] - ends_mm[0]
        return (
            max(abs(a - b) for a, b in zip(ends_mm, self.ends_mm, strict=True)) < 0.02 * span
            and abs(period_s / self.period_s - 1.0) < 0.05
            and abs(temperature_C - self.temperature_C) < 1.0
        )


class ParameterSpread:
    """Uncertainty of the force along a loop, from the covariance of the fit.

    Parameters
    ----------
    model : SpringModel
        With what its fit knows.
    """

    def __init__(self, model: SpringModel, fit: FitUncertainty) -> None:
        self._model = model
        kept = [k for k, name in enumerate(fit.parameter) if name not in _THERMAL]
        deviation = np.array(fit.standard_uncertainty)[kept]
        unit = np.where(deviation > 0.0, deviation, 1.0)
        correlation = fit.covariance[np.ix_(kept, kept)] / np.outer(unit, unit)
        values, vectors = np.linalg.eigh(correlation)
        self._root = vectors * np.sqrt(np.maximum(values, 0.0))
        self._moved = [
            (moved_model(model, fit.parameter[k], by), by)
            for k, by in zip(kept, deviation.tolist(), strict=True)
            if by > 0.0
        ]
        self._root = self._root[deviation > 0.0]
        self._loops: list[_KnownLoop] = []

    def components(
        self, stroke_mm: Floats, rising: NDArray[np.bool_], period_s: float, temperature_C: float
    ) -> Floats:
        """Return the components of the force's uncertainty [kN] along a loop.

        Parameters
        ----------
        stroke_mm : array, shape (n,)
            Of one cycle.
        rising : array of bool, shape (n,)
            Which of them belong to its loading.
        period_s, temperature_C : float
            Of the cycle.

        Returns
        -------
        array, shape (n, k)
            Its product with its own transpose is the covariance.
        """
        ends_mm = float(stroke_mm.min()), float(stroke_mm.max())
        known = next((one for one in self._loops if one.is_like(ends_mm, period_s, temperature_C)), None)
        if known is None:
            known = self._found(ends_mm, period_s, temperature_C)
            self._loops = [*self._loops[-15:], known]
        found = np.empty((stroke_mm.size, known.loading_kN.shape[1]))
        for column in range(found.shape[1]):
            up = np.interp(stroke_mm, known.stroke_mm, known.loading_kN[:, column])
            down = np.interp(stroke_mm, known.stroke_mm, known.unloading_kN[:, column])
            found[:, column] = np.where(rising, up, down)
        return found

    def _found(self, ends_mm: tuple[float, float], period_s: float, temperature_C: float) -> _KnownLoop:
        tau_s = max((tau for _, tau in self._model.viscous.branches), default=0.0)
        loops = min(_MOST_LOOPS, max(2, int(np.ceil(_SETTLED_TAU * tau_s / period_s))))
        turn = np.linspace(0.0, 2.0 * np.pi, 2 * _LOOP_POINTS + 1)
        mean, half = 0.5 * (ends_mm[0] + ends_mm[1]), 0.5 * (ends_mm[1] - ends_mm[0])
        one = mean - half * np.cos(turn)
        way = np.concatenate([[0.0], *([one[:-1]] * loops), one[-1:]])
        lead_s = period_s * max(ends_mm[0], 0.0) / (4.0 * half)
        steps_s = np.append(0.0, lead_s + np.arange(way.size - 1) * period_s / (2 * _LOOP_POINTS))

        def force_of(model: SpringModel) -> Floats:
            done = simulate(model, steps_s, way, temperature_C=temperature_C, isothermal=True)
            return done.force_kN[-one.size :]

        base = force_of(self._model)
        changes = [force_of(model) - base for model, _ in self._moved]
        parts = np.stack(changes, axis=1) @ self._root if changes else np.zeros((one.size, 1))
        left, size, _ = np.linalg.svd(parts, full_matrices=False)
        parts = (left * size)[:, :_PARTS]
        top = _LOOP_POINTS
        return _KnownLoop(
            ends_mm, period_s, temperature_C, one[: top + 1], parts[: top + 1], parts[top:][::-1]
        )


def moved_model(model: SpringModel, parameter: str, by: float) -> SpringModel:
    """Return a model with one of the parameters of its fit moved; of a logarithm, by so much of it.

    Raises
    ------
    BadInput
        If the model has no such parameter, or its curves then contradict themselves.
    """
    knot = knot_of(parameter)
    if knot is not None:
        return _moved_knot(model, *knot, by)
    name = parameter.removeprefix(LOGARITHM)
    for part in ("curves", "temperature", "heat", "viscous"):
        table: Any = getattr(model, part)
        if isinstance(value := getattr(table, name, None), float | int):
            moved = float(value * np.exp(by)) if parameter != name else max(float(value + by), 0.0)
            changed: dict[str, Any] = {part: replace(table, **{name: moved})}
            return replace(model, **changed)
    raise BadInput(
        f"there is no parameter “{parameter}” in this model",
        place="fit.parameter",
        remedy="fit the model again, or leave [fit] out",
    )


def _moved_knot(model: SpringModel, curve: str, stroke_mm: float, by: float) -> SpringModel:
    curves = model.curves
    at = int(np.argmin(np.abs(np.array(curves.stroke_mm) - stroke_mm)))
    if abs(curves.stroke_mm[at] - stroke_mm) > 1e-3:
        raise BadInput(
            f"the curves have no point at {stroke_mm:g} mm",
            place="fit.parameter",
            remedy="fit the model again, or leave [fit] out",
        )
    forces = np.array(getattr(curves, curve))
    forces[at] = max(forces[at] + by, 0.0)
    tables = {"loading_kN": np.array(curves.loading_kN), "unloading_kN": np.array(curves.unloading_kN)}
    tables[curve] = np.maximum.accumulate(forces)
    tables["unloading_kN"] = np.minimum(tables["unloading_kN"], tables["loading_kN"])
    moved = replace(
        curves,
        loading_kN=tuple(tables["loading_kN"].tolist()),
        unloading_kN=tuple(tables["unloading_kN"].tolist()),
    )
    return replace(model, curves=moved)
