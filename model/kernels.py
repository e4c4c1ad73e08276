"""The step of the spring in the plainest Python, over many instants.

:func:`drive` takes lists as it stands, or arrays when numba has compiled it (the extra ``fast``,
:func:`compiled`). Both give the same bits, which a test demands; so nothing here may use more than floats,
indices and ``exp``, and numba's ``fastmath`` must never be asked for.

The law is that of :class:`bufferstand.model.stepper.SpringStepper`, whose step unpacks a cell at once because
that is what plain Python does fastest; a test demands equal bits of these two, too.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, MutableSequence, Sequence
from functools import cache
from math import exp
from typing import Any

Floats = MutableSequence[float]

STROKE, FORCE, BAND, TEMPERATURE, SENSOR, WORK, HEAT, AMBIENT = range(8)
"""Places in a state that a user reads; ambient is the one to write."""
OWED, INSIDE, A_0, B_0, DEPTH, WIDTH, EXCESS, FREE = range(8, 16)
"""Places in a state that the next step needs: heat held back, and what the last stroke's cell gave."""
INNER = 16
"""First place of the viscous branches in a state: lag, middle force and depth at the inner stroke of each."""
READ = 7
"""Figures of a state that :func:`drive` writes after each step."""
BRANCHES = 7
PLACE = 0xFFFFFFFF
"""Mask that changes no place, but tells the compiler that none is negative: it need not look each time."""
CELL_SIZE, LAW_SIZE, FACTORS_SIZE, STATE_SIZE = 16, 13 + BRANCHES, 3 + 2 * BRANCHES, INNER + 3 * BRANCHES


def drive(  # noqa: PLR0912, PLR0915 - one loop without calls: a call in it costs a third of the speed
    cells: Floats,
    laws: Floats,
    factors: Floats,
    states: Floats,
    places: Sequence[int],
    strokes_mm: Sequence[float],
    outputs: Floats,
) -> None:
    """Make one step after the other, each of one spring to one stroke at constant speed.

    Parameters
    ----------
    cells : Floats
        The cells of all kinds of spring one behind the other, see
        :meth:`bufferstand.model.tables.BandTables.rows`.
    laws, factors : Floats
        What a kind of spring keeps, and what the duration of a step gives it
        (:mod:`bufferstand.model.compiled`).
    states : Floats
        What the springs remember; changed.
    places : Sequence of int
        Four a step: where its cells, law, factors and state begin.
    strokes_mm : Sequence of float
        Stroke at the end of each step.
    outputs : Floats
        Gets :data:`READ` figures of the state after each step.
    """
    for k in range(len(strokes_mm)):
        row = (4 * k) & PLACE
        c, w, d, n = places[row], places[row + 1] & PLACE, places[row + 2] & PLACE, places[row + 3] & PLACE
        stroke_mm = strokes_mm[k]
        per_step, cell_mm, end = laws[w], laws[w + 1], laws[w + 2]
        x = 0.0 if stroke_mm < 0.0 else stroke_mm if stroke_mm < end else end
        i = int(x * per_step)
        f = x - i * cell_mm
        i = (c + CELL_SIZE * i) & PLACE
        dx = x - states[n + INSIDE]
        p = p_0 = states[n + BAND]
        A = cells[i] + cells[i + 1] * f
        B = cells[i + 2] + cells[i + 3] * f
        if dx > 0.0:
            if states[n + A_0] < A:
                p = 1.0 - (1.0 - p) * exp(states[n + A_0] - A)
        elif dx < 0.0 and states[n + B_0] > B:
            p *= exp(B - states[n + B_0])
        h = cells[i + 6] + cells[i + 7] * f
        g = cells[i + 14] + cells[i + 15] * f
        r = p - cells[i + 10] - cells[i + 11] * f
        m = h * r
        psi = 0.5 * (cells[i + 12] + cells[i + 13] * f) * r * r

        # Heat of the step, at the temperature with which it begins.
        T = states[n + TEMPERATURE]
        warmer = T - laws[w + 3]
        soft = laws[w + 4] * warmer if warmer < laws[w + 6] else laws[w + 7]
        s_0 = 1.0 - soft * states[n + DEPTH]
        s = 1.0 - soft * g
        if laws[w + 9] != 0.0:
            q = 0.0
            if dx < 0.0:
                q = -0.5 * (s_0 * states[n + WIDTH] * (1.0 - p_0) + s * h * (1.0 - p)) * dx
        else:
            q = 0.5 * (s_0 * states[n + EXCESS] + s * m) * dx - s * psi + s_0 * states[n + FREE]
            q += states[n + OWED]
            states[n + OWED] = 0.0
            if q < 0.0:
                states[n + OWED] = q
                q = 0.0
        c_eta, e_max = laws[w + 5], laws[w + 11]
        if c_eta != 0.0:
            e = 1.0 - c_eta * warmer
            q *= 0.0 if e < 0.0 else e if e < e_max else e_max
        branches = int(laws[w + 12])
        for b in range(branches):
            at = n + INNER + 3 * b
            lag_0, inner_0, g_in_0 = states[at], states[at + 1], states[at + 2]
            lag = lag_0 * factors[d + 3 + 2 * b] + dx * factors[d + 4 + 2 * b]
            xi = x - lag
            j = int(xi * per_step)
            xi -= j * cell_mm
            j = (c + CELL_SIZE * j) & PLACE
            inner = cells[j + 8] + cells[j + 9] * xi
            g_in = cells[j + 14] + cells[j + 15] * xi
            loss = (lag_0 + lag) * ((1.0 - soft * g_in) * inner - (1.0 - soft * g_in_0) * inner_0)
            if loss > 0.0:
                q += 0.5 * laws[w + 13 + b] * loss
            states[at], states[at + 1], states[at + 2] = lag, inner, g_in
        states[n + HEAT] += q

        # Eq. (7); the sensor follows the mass.
        ambient, sensed = states[n + AMBIENT], states[n + SENSOR]
        T += q * factors[d + 1] - (T - ambient) * factors[d]
        states[n + TEMPERATURE] = T
        states[n + SENSOR] = sensed + (ambient + laws[w + 10] * (T - ambient) - sensed) * factors[d + 2]
        states[n + INSIDE], states[n + A_0], states[n + B_0] = x, A, B
        states[n + DEPTH], states[n + WIDTH], states[n + EXCESS], states[n + FREE] = g, h, m, psi

        # Force at the new temperature, with the band position kept.
        warmer = T - laws[w + 3]
        soft = laws[w + 4] * warmer if warmer < laws[w + 6] else laws[w + 7]
        s = 1.0 - soft * g
        if c_eta != 0.0:
            e = 1.0 - c_eta * warmer
            h *= 0.0 if e < 0.0 else e if e < e_max else e_max
        force = s * (cells[i + 4] + cells[i + 5] * f - (1.0 - p) * h)
        middle = s * (cells[i + 8] + cells[i + 9] * f)
        for b in range(branches):
            at = n + INNER + 3 * b
            force += laws[w + 13 + b] * (middle - (1.0 - soft * states[at + 2]) * states[at + 1])
        if force < 0.0 or stroke_mm <= 0.0:
            force = 0.0
        if stroke_mm > end:
            force += laws[w + 8] * (stroke_mm - end)
        states[n + WORK] += 0.5 * (states[n + FORCE] + force) * (stroke_mm - states[n + STROKE])
        states[n + STROKE], states[n + FORCE], states[n + BAND] = stroke_mm, force, p
        row = (READ * k) & PLACE
        for place in range(READ):
            outputs[row + place] = states[n + place]


def available() -> bool:
    """Return whether numba, and so :func:`compiled`, is there."""
    return importlib.util.find_spec("numba") is not None


@cache
def compiled() -> Callable[..., None]:
    """Return :func:`drive` compiled by numba, which is imported only here.

    Import and compilation take some seconds in each process.

    Raises
    ------
    ImportError
        If numba (the extra ``fast``) is not installed.
    """
    numba: Any = importlib.import_module("numba")
    kernel: Callable[..., None] = numba.njit(drive)
    return kernel
