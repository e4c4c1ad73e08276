"""Contributions of shared errors to the means of a run, small enough to be stored for each run.

The Monte Carlo draws of a run's means are regressed on the drawn errors of its channels. What a mean owes to
an error is its standard contribution: sensitivity times standard uncertainty, with its sign. Two runs that
name the same instrument have the same error, and so the covariance of two means is the sum of the products of
their contributions (JCGM 100, 5.2.2, F.1.2.3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from bufferstand.evaluation.facts import (
    Distribution,
    ErrorSource,
    MeasuringChain,
    SharedErrors,
    WeightedSource,
    weakest,
)
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.uncertainty.error_model import Draws, mean_of_wires

_DIGITS = 6
"""Contributions are kept to so many digits: what cancels between runs is right to a millionth."""
_NOTHING = 1e-6
"""A contribution below this share of a figure's largest is none."""


class Regression:
    """Drawn errors of a run's channels, on which what was drawn of its figures is regressed.

    Parameters
    ----------
    chain : Chain
        Of the run; states accuracy (else nothing was drawn).
    draws : Draws
        As drawn for it.
    """

    def __init__(self, chain: MeasuringChain, draws: Draws) -> None:
        drawn = draws.errors()
        self._sources = tuple(_sources(chain, [n for n, values in drawn.items() if np.ptp(values) > 0.0]))
        self._names = tuple(dict.fromkeys(weighted.source.error for weighted in self._sources))
        force, wires = chain.identities
        self._basis = weakest([force.basis, *(wire.basis for wire in wires)])
        columns = np.stack([drawn[name] - np.mean(drawn[name]) for name in self._names])
        columns /= np.sqrt(np.mean(columns**2, axis=1))[:, None]
        # What independent draws have in common by chance is taken off by regressing on all at once.
        self._columns, self._gain = columns, np.linalg.inv(columns @ columns.T) @ columns

    def contributions(self, values: FloatArray) -> tuple[float, ...]:
        """Return what a figure owes to each error, and what all explain, from its draws, shape (N,)."""
        found = self._gain @ (values - np.mean(values))
        explained = float(np.sqrt(np.mean((found @ self._columns) ** 2)))
        least = _NOTHING * float(np.max(np.abs(found), initial=0.0))
        kept = [c if abs(c) > least else 0.0 for c in found.tolist()]
        return tuple(float(f"{c:.{_DIGITS}g}") for c in (*kept, explained))

    def shared(self, contributions: Mapping[str, tuple[float, ...]]) -> SharedErrors:
        """Return the contributions to figures, by name, with the instruments behind them."""
        return SharedErrors(self._basis, self._names, self._sources, contributions)


def _sources(chain: MeasuringChain, errors: Sequence[str]) -> list[WeightedSource]:
    """Return the instruments behind each error that is not nothing."""
    stroke = mean_of_wires(chain.wires)
    assert stroke is not None
    force, wires = chain.identities
    own = chain.force
    instruments, zeros = [wire.instrument for wire in wires], [wire.zero for wire in wires]
    limits = {
        "force scale": (own.accuracy_percent, force.instrument),
        "force zero": (own.zero, force.zero),
        "force reversibility": (own.reversibility_percent, force.instrument),
    }
    found = [_one(name, text) for name, (limit, text) in limits.items() if limit]
    delays = [(c.u_delay_s or 0.0) / len(wires) for c in chain.wires]
    found += _several(
        "delay", "normal", [force.delay, *(wire.delay for wire in wires)], [own.u_delay_s or 0.0, *delays]
    )
    found += _several("stroke scale", "rectangular", instruments, stroke.scales)
    found += _several("stroke zero", "rectangular", zeros, stroke.zeros_mm)
    waves = {wave.name: wave for wave in stroke.waves}
    for name in errors:
        if (wave := waves.get(name.rpartition(" ")[0])) is not None:
            found += _several(name, "normal", instruments, wave.u_mm)
        elif name in ("clock", "moving mass"):
            found.append(_one(name, chain.stand))
    return found


def _one(error: str, instrument: str) -> WeightedSource:
    return WeightedSource(ErrorSource(error, instrument, "rectangular"), 1.0)


def _several(
    error: str, distribution: Distribution, instruments: Sequence[str], u: Sequence[float]
) -> list[WeightedSource]:
    """Return the parts that several instruments have in an error; nothing of those that have none."""
    whole = math.hypot(*u)
    parts = zip(instruments, u, strict=True)
    return [
        WeightedSource(ErrorSource(error, text, distribution), own / whole)
        for text, own in parts
        if own > 0.0
    ]
