"""The figures of fitted models that specimens are compared by: laws, and the curves at common strokes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.fit_uncertainty import LOGARITHM, knot_of
from bufferstand.model.specimens.between import Between, GroupDifference, between_specimens, difference_of
from bufferstand.model.spring import SpringModel
from bufferstand.model.twin import moved_model

Floats = NDArray[np.float64]

STROKES = 5
"""Curves are compared at so many strokes, evenly up to the least that all specimens were measured to."""
_STEP = 0.1
"""Derivatives by the parameters: over so much of a standard uncertainty."""


@dataclass(frozen=True)
class SpecimenFigure:
    """A figure of one specimen; of a ``relative`` one the natural logarithm."""

    name: str
    unit: str
    relative: bool
    value: float
    standard_uncertainty: float


@dataclass(frozen=True)
class FigureSpread:
    """A figure over the specimens that have it.

    Attributes
    ----------
    name, unit : str
    relative : bool
        Whether all is in natural logarithms: a spread of 0.05 is 5 %.
    first : Between
        Of the first group.
    second : Between, optional
        Of the second.
    difference : GroupDifference, optional
        Second less first.
    """

    name: str
    unit: str
    relative: bool
    first: Between
    second: Between | None = None
    difference: GroupDifference | None = None


def common_strokes(models: Sequence[SpringModel]) -> tuple[float, ...]:
    """Return the strokes [mm] at which curves are compared: all specimens were measured there."""
    ends = [m.curves.end_mm if m.identified is None else m.identified.stroke_mm[1] for m in models]
    return tuple(math.floor(10.0 * min(ends) * (k + 1) / STROKES) / 10.0 for k in range(STROKES))


def figures_of(model: SpringModel, strokes_mm: Sequence[float]) -> list[SpecimenFigure]:
    """Return the figures of one specimen with their standard uncertainties.

    Parameters
    ----------
    model : SpringModel
        With what its fit knows.
    strokes_mm : sequence of float
        At which the curves are looked at; forces as logarithms.

    Raises
    ------
    BadInput
        If nobody says how well the model is known.
    """
    fit, x = model.stated_fit, np.array(strokes_mm)
    found = []
    for name, u in zip(fit.parameter, fit.standard_uncertainty, strict=True):
        if knot_of(name) is None:
            key = name.removeprefix(LOGARITHM)
            value = _value(model, key)
            relative = name != key
            found.append(SpecimenFigure(key, "", relative, float(np.log(value)) if relative else value, u))
    base = _forces(model, x)
    columns = []
    for name, u in zip(fit.parameter, fit.standard_uncertainty, strict=True):
        by = _STEP * u
        moved = knot_of(name) is not None and by > 0.0
        change = _forces(moved_model(model, name, by), x) - base if moved else np.zeros_like(base)
        columns.append(change / by if moved else change)
    by_parameter = np.stack(columns, axis=1)
    deviation = np.sqrt(np.einsum("ij,jk,ik->i", by_parameter, fit.covariance, by_parameter).clip(min=0.0))
    names = [f"{curve} at {stroke:g} mm" for curve in ("loading", "unloading") for stroke in strokes_mm]
    found += [
        SpecimenFigure(name, "kN", True, float(value), float(u))
        for name, value, u in zip(names, base, deviation, strict=True)
    ]
    return found


def compare_specimens(
    first: Sequence[SpringModel], second: Sequence[SpringModel] = ()
) -> tuple[FigureSpread, ...]:
    """Return mean and spread of every figure that all specimens have; of two groups their difference, too.

    Parameters
    ----------
    first, second : sequence of SpringModel
        Three or more each; the second may be empty.

    Raises
    ------
    BadInput
        If there are fewer, or a model does not say how well it is known.
    """
    strokes = common_strokes([*first, *second])
    groups = [[figures_of(model, strokes) for model in group] for group in (first, second)]
    tables = [{one.name: one for one in specimen} for group in groups for specimen in group]
    shared = [one for one in tables[0].values() if all(one.name in table for table in tables)]
    found = []
    for one in shared:
        spreads = [
            between_specimens(
                [table[one.name].value for table in part],
                [table[one.name].standard_uncertainty for table in part],
            )
            for part in (tables[: len(first)], tables[len(first) :])
            if part
        ]
        second_spread = spreads[1] if len(spreads) > 1 else None
        difference = None if second_spread is None else difference_of(spreads[0], second_spread)
        found.append(FigureSpread(one.name, one.unit, one.relative, spreads[0], second_spread, difference))
    return tuple(found)


def _value(model: SpringModel, key: str) -> float:
    for part in (model.curves, model.temperature, model.heat, model.viscous):
        if isinstance(value := getattr(part, key, None), float | int):
            return float(value)
    raise BadInput(f"there is no parameter “{key}” in this model", place="fit.parameter")


def _forces(model: SpringModel, x: Floats) -> Floats:
    """Return the logarithms of F_l and F_u at strokes, shape (2 n,)."""
    forces = np.concatenate([model.curves.loading(x), model.curves.unloading(x)])
    return np.asarray(np.log(np.maximum(forces, 1e-6)))
