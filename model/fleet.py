"""Many springs stepped at once: the buffers and draw gear of a train, or one spring with many parameters.

The laws are those of :class:`bufferstand.model.stepper.SpringStepper`. Without the extra ``fast`` numpy
computes all springs side by side (equal to the stepper within rounding); with it the compiled kernel steps
one after the other (equal to the last bit).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bufferstand.model import kernels as at
from bufferstand.model.energy import stored_energy
from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]


class SpringFleet:
    """Springs of one kind or several, each with its own state.

    All begin unloaded: at stroke 0, on the unloading curve, without overstress.

    Parameters
    ----------
    models : sequence of SpringModel
        The kinds of spring.
    kinds : array_like of int, shape (n,)
        For each spring the place of its model in ``models``.
    temperature_C, ambient_C : array_like
        Temperature of each spring at the beginning, and of its surroundings (the same if not given) [°C]; one
        figure, or shape (n,).
    compiled : bool
        Let numba compile the step (:func:`bufferstand.model.kernels.compiled`).

    Attributes
    ----------
    stroke_mm, force_kN, band : NDArray
        Present strokes, forces and band positions, shape (n,); the next step changes them in place.
    temperature_C, sensor_temperature_C, ambient_C : NDArray
        Of each mass, sensor and surroundings; may be written to.
    work_J, heat_J : NDArray
        Work done on each spring and energy lost in it since the beginning.

    Raises
    ------
    ValueError
        If a kind has no model.
    ImportError
        If ``compiled`` is asked for without numba.
    """

    def __init__(
        self,
        models: Sequence[SpringModel],
        kinds: ArrayLike,
        temperature_C: ArrayLike,
        ambient_C: ArrayLike | None = None,
        *,
        compiled: bool = False,
    ) -> None:
        self.models = tuple(models)
        self.kinds = np.asarray(kinds, dtype=np.intp).ravel()
        if len(self.kinds) and not 0 <= self.kinds.min() <= self.kinds.max() < len(self.models):
            raise ValueError(f"kinds must lie in 0 … {len(self.models) - 1}")
        cells = [model.tables.rows() for model in self.models]
        lengths = [len(part) for part in cells]
        self._first = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.intp)
        self._cells = np.concatenate(cells)
        self._laws = np.array([law_of(model) for model in self.models])
        rest = np.array([rest_of(model) for model in self.models])
        # One row a spring for the kernel, one row a figure for numpy.
        self._states = np.ascontiguousarray(rest[self.kinds] if compiled else rest[self.kinds].T)
        self._by_spring = self._states if compiled else self._states.T
        views = tuple(self._by_spring[:, place] for place in range(at.AMBIENT + 1))
        self.stroke_mm, self.force_kN, self.band, self.temperature_C, self.sensor_temperature_C = views[:5]
        self.work_J, self.heat_J, self.ambient_C = views[5:]
        self.temperature_C[:] = self.sensor_temperature_C[:] = temperature_C
        self.ambient_C[:] = temperature_C if ambient_C is None else ambient_C
        self._kernel = at.compiled() if compiled else None
        self._factors = np.zeros((len(self.models), at.FACTORS_SIZE))
        self._dt_s = -1.0
        self._prepare_duration(0.0)
        if compiled:
            self._places = np.column_stack(
                [
                    at.CELL_SIZE * self._first[self.kinds],
                    at.LAW_SIZE * self.kinds,
                    at.FACTORS_SIZE * self.kinds,
                    at.STATE_SIZE * np.arange(len(self.kinds)),
                ]
            ).ravel()
            self._outputs = np.empty(at.READ * len(self.kinds))
        else:
            self._base = np.ascontiguousarray(self._cells[:, ::2])
            self._rise = np.ascontiguousarray(self._cells[:, 1::2])
            one = len(self.models) == 1
            self._law = self._laws[0] if one else np.ascontiguousarray(self._laws[self.kinds].T)
            self._offset = np.intp(0) if one else self._first[self.kinds]

    def __len__(self) -> int:
        """Get the number of springs."""
        return len(self.kinds)

    def step(self, stroke_mm: ArrayLike, dt_s: float) -> Floats:
        """Go to the strokes in ``dt_s`` [s], each at constant speed; get the forces there [kN].

        Parameters
        ----------
        stroke_mm : array_like
            Stroke of each spring, shape (n,).
        dt_s : float
            Duration, 0 or more.

        Returns
        -------
        NDArray
            Forces [kN], shape (n,), which the next step changes.

        Raises
        ------
        ValueError
            If there are not as many strokes as springs, or time runs backwards.
        """
        stroke = np.ascontiguousarray(stroke_mm, dtype=np.float64)
        if stroke.shape != self.kinds.shape:
            raise ValueError(f"{stroke.size} strokes for {len(self.kinds)} springs")
        if dt_s != self._dt_s:
            self._prepare_duration(dt_s)
        if self._kernel is None:
            _step(self._base, self._rise, self._law, self._factor, self._offset, self._states, stroke)
        else:
            flat = (self._cells.ravel(), self._laws.ravel(), self._factors.ravel(), self._states.ravel())
            self._kernel(*flat, self._places, stroke, self._outputs)
        return self.force_kN

    def stored_J(self) -> Floats:  # noqa: N802 - the unit's own letter
        """Get the energy that each spring holds now, shape (n,); see
        :func:`bufferstand.model.energy.stored_energy`."""
        stored = np.empty(len(self.kinds))
        for kind, model in enumerate(self.models):
            own = self.kinds == kind
            states = self._by_spring[own]
            lags = states[:, at.INNER : at.INNER + 3 * len(model.viscous.branches) : 3].T
            figures = (states[:, at.STROKE], states[:, at.BAND], lags, states[:, at.TEMPERATURE])
            stored[own] = stored_energy(model, *figures)
        return stored

    def _prepare_duration(self, dt_s: float) -> None:
        if not dt_s >= 0.0:
            raise ValueError(f"a step takes 0 s or more, got {dt_s}")
        self._dt_s = dt_s
        self._factors[:] = [factors_of(model, dt_s) for model in self.models]
        one = len(self.models) == 1
        self._factor = self._factors[0] if one else np.ascontiguousarray(self._factors[self.kinds].T)


def law_of(model: SpringModel) -> list[float]:
    """Return what a kind of spring keeps, as :func:`bufferstand.model.kernels.drive` reads it."""
    tables, law = model.tables, model.temperature
    shares = [beta for beta, _ in model.viscous.branches]
    return [
        1.0 / tables.step_mm,
        tables.step_mm,
        tables.end_mm,
        law.reference_C,
        law.sensitivity_per_K,
        law.loss_sensitivity_per_K,
        law.spent_K,
        law.softest,
        model.curves.stop_stiffness_kN_per_mm,
        float(model.heat.rule == "paper"),
        model.heat.sensor_gain,
        tables.width_scale_max,
        float(len(shares)),
        *shares,
        *[0.0] * (at.BRANCHES - len(shares)),
    ]


def factors_of(model: SpringModel, dt_s: float) -> list[float]:
    """Return what the duration of a step gives a kind of spring, as :func:`bufferstand.model.kernels.drive`
    reads it."""
    relaxed = [factor for response in model.viscous.responses(dt_s) for factor in response]
    return [*model.heat.step_factors(dt_s), *relaxed, *[0.0] * (2 * at.BRANCHES - len(relaxed))]


def rest_of(model: SpringModel, stroke_mm: float = 0.0, band: float = 0.0) -> list[float]:
    """Return the state of a spring that rests at a stroke without overstress, but for its temperatures."""
    tables = model.tables
    x = min(max(stroke_mm, 0.0), tables.end_mm)
    i = int(x * (1.0 / tables.step_mm))
    f = x - i * tables.step_mm
    cell = tables.rows()[i]
    A, B, _, h, F_m, p_c, G, g = (
        value + slope * f for value, slope in zip(cell[::2], cell[1::2], strict=True)
    )
    state = [0.0] * at.INNER + [0.0, F_m, g] * at.BRANCHES
    state[at.STROKE], state[at.BAND], state[at.INSIDE] = stroke_mm, band, x
    state[at.A_0], state[at.B_0], state[at.DEPTH], state[at.WIDTH] = A, B, g, h
    r = band - p_c
    state[at.EXCESS], state[at.FREE] = h * r, 0.5 * G * r * r
    return state


def _step(
    base: Floats, rise: Floats, law: Floats, factor: Floats, offset: ArrayLike, S: Floats, stroke_mm: Floats
) -> None:
    """Do :func:`bufferstand.model.kernels.drive` for all springs side by side; ``S`` has one row a figure."""
    end, c_eta, paper = law[2], law[5], law[9]
    x = np.clip(stroke_mm, 0.0, end)
    A, B, F_l, h, F_m, p_c, G, g = _look_up(base, rise, law, offset, x).T
    dx = x - S[at.INSIDE]
    p_0 = S[at.BAND]
    rises = dx > 0.0
    kept = np.exp(np.minimum(np.where(rises, S[at.A_0] - A, np.where(dx < 0.0, B - S[at.B_0], 0.0)), 0.0))
    p = np.where(rises, 1.0 - (1.0 - p_0) * kept, p_0 * kept)
    r = p - p_c
    m = h * r
    psi = 0.5 * G * r * r

    T = S[at.TEMPERATURE]
    warmer = T - law[3]
    soft = np.where(warmer < law[6], law[4] * warmer, law[7])
    s_0, s = 1.0 - soft * S[at.DEPTH], 1.0 - soft * g
    q = 0.5 * (s_0 * S[at.EXCESS] + s * m) * dx - s * psi + s_0 * S[at.FREE] + S[at.OWED]
    owed = np.minimum(q, 0.0)
    q = np.maximum(q, 0.0)
    if np.any(paper):
        eq_8 = -0.5 * (s_0 * S[at.WIDTH] * (1.0 - p_0) + s * h * (1.0 - p)) * np.minimum(dx, 0.0)
        q, owed = np.where(paper, eq_8, q), np.where(paper, 0.0, owed)
    if np.any(c_eta):
        q *= np.clip(1.0 - c_eta * warmer, 0.0, law[11])
    branches = int(np.max(law[12]))
    for b in range(branches):
        share, (lag_0, inner_0, g_in_0) = law[13 + b], S[at.INNER + 3 * b : at.INNER + 3 * b + 3]
        lag = lag_0 * factor[3 + 2 * b] + dx * factor[4 + 2 * b]
        found = _look_up(base, rise, law, offset, x - lag)
        inner, g_in = found[:, 4], found[:, 7]
        loss = (lag_0 + lag) * ((1.0 - soft * g_in) * inner - (1.0 - soft * g_in_0) * inner_0)
        q += 0.5 * share * np.maximum(loss, 0.0)
        S[at.INNER + 3 * b], S[at.INNER + 3 * b + 1], S[at.INNER + 3 * b + 2] = lag, inner, g_in
    S[at.HEAT] += q

    S[at.TEMPERATURE] = T = T + q * factor[1] - (T - S[at.AMBIENT]) * factor[0]
    S[at.SENSOR] += (S[at.AMBIENT] + law[10] * (T - S[at.AMBIENT]) - S[at.SENSOR]) * factor[2]
    for place, figure in (
        (at.OWED, owed),
        (at.INSIDE, x),
        (at.A_0, A),
        (at.B_0, B),
        (at.DEPTH, g),
        (at.WIDTH, h),
    ):
        S[place] = figure
    S[at.EXCESS], S[at.FREE] = m, psi

    warmer = T - law[3]
    soft = np.where(warmer < law[6], law[4] * warmer, law[7])
    s = 1.0 - soft * g
    width = h * np.clip(1.0 - c_eta * warmer, 0.0, law[11]) if np.any(c_eta) else h
    force = s * (F_l - (1.0 - p) * width)
    middle = s * F_m
    for b in range(branches):
        force += law[13 + b] * (middle - (1.0 - soft * S[at.INNER + 3 * b + 2]) * S[at.INNER + 3 * b + 1])
    force = np.where(stroke_mm > 0.0, np.maximum(force, 0.0), 0.0)
    force += law[8] * (stroke_mm - np.minimum(stroke_mm, end))
    S[at.WORK] += 0.5 * (S[at.FORCE] + force) * (stroke_mm - S[at.STROKE])
    S[at.STROKE], S[at.FORCE], S[at.BAND] = stroke_mm, force, p


def _look_up(base: Floats, rise: Floats, law: Floats, offset: ArrayLike, x: Floats) -> Floats:
    """Return the eight tables at strokes, shape (n, 8)."""
    cell = (x * law[0]).astype(np.intp)
    inside = x - cell * law[1]
    cell = cell + offset
    found: Floats = rise.take(cell, axis=0)
    found *= inside[:, None]
    found += base.take(cell, axis=0)
    return found
