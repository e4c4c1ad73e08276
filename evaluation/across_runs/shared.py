"""Contributions of shared errors to the means of a run, small enough to be stored for each run.

The Monte Carlo draws of a run's means are regressed on the drawn errors of its channels. What a mean owes to
an error is its standard contribution: sensitivity times standard uncertainty, with its sign. Two runs that
name the same instrument have the same error, and so the covariance of two means is the sum of the products of
their contributions (JCGM 100, 5.2.2, F.1.2.3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from bufferstand.evaluation.across_runs.identity import ChannelIdentity, assumed, weakest
from bufferstand.evaluation.document_types import Basis, SharedErrorsEntry
from bufferstand.evaluation.error_model import Draws, mean_of_wires
from bufferstand.evaluation.record import FloatArray
from bufferstand.foundation.channel import ChannelUncertainty

Distribution = Literal["rectangular", "normal"]
_DIGITS = 6
"""Contributions are kept to so many digits: what cancels between runs is right to a millionth."""
_NOTHING = 1e-6
"""A contribution below this share of a figure's largest is none."""


class Source(NamedTuple):
    """An error by which runs may hang together: they do where both its texts agree."""

    error: str
    instrument: str
    distribution: Distribution


@dataclass(frozen=True)
class Owed:
    """What a figure owes to errors that other runs have, too.

    Attributes
    ----------
    by_source : mapping of Source to float
        Standard contributions, with their signs.
    explained_u : float
        Standard uncertainty that they explain of what was drawn. Not the root of their squares: in a few
        hundred draws independent errors are correlated by chance, and what a run has of its own is the small
        difference of two large numbers, which must have the same chance in them.
    """

    by_source: Mapping[Source, float] = field(default_factory=dict)
    explained_u: float = 0.0

    def scaled(self, factor: float) -> Owed:
        """Return what so many times the figure owes."""
        return Owed({s: factor * c for s, c in self.by_source.items()}, abs(factor) * self.explained_u)


@dataclass(frozen=True)
class Weighted:
    """A source, and its share of the standard uncertainty of the error that it is part of (Σ share² = 1)."""

    source: Source
    share: float


@dataclass(frozen=True)
class SharedErrors:
    """Errors behind the means of one run.

    Attributes
    ----------
    basis : str
        On what it rests that other runs have them in common; of several channels the weakest.
    errors : tuple of str
    sources : tuple of Weighted
        Instruments behind these errors: each wire has its own share of an error of their mean.
    contributions : mapping of str to tuple of float
        By quantity, in its unit: the standard contribution of each of ``errors``, with its sign, and last
        what all of them explain (:class:`Owed`).
    """

    basis: Basis
    errors: tuple[str, ...]
    sources: tuple[Weighted, ...]
    contributions: Mapping[str, tuple[float, ...]]

    def of(self, quantity: str) -> Owed:
        """Return what a mean owes to every source; nothing where it was not propagated."""
        own = self.contributions.get(quantity)
        if own is None:
            return Owed()
        by_error = dict(zip(self.errors, own[:-1], strict=True))
        found: dict[Source, float] = {}
        for weighted in self.sources:
            contribution = by_error[weighted.source.error] * weighted.share
            if contribution != 0.0:
                # Two wires that name one instrument have one error of it.
                found[weighted.source] = found.get(weighted.source, 0.0) + contribution
        return Owed(found, own[-1])

    def entry(self) -> SharedErrorsEntry:
        """Return it as JSON holds it."""
        return {
            "basis": self.basis,
            "errors": list(self.errors),
            "sources": [
                {
                    "error": w.source.error,
                    "instrument": w.source.instrument,
                    "distribution": w.source.distribution,
                    "share": w.share,
                }
                for w in self.sources
            ],
            "contributions": {name: list(own[:-1]) for name, own in self.contributions.items()},
            "explained": {name: own[-1] for name, own in self.contributions.items()},
        }


def shared_of(entry: Mapping[str, Any] | None) -> SharedErrors | None:
    """Return what :meth:`SharedErrors.entry` made; None of None.

    Raises
    ------
    ValueError
        If it is no such entry.
    """
    if entry is None:
        return None
    try:
        errors = tuple(str(name) for name in entry["errors"])
        contributions = {
            str(name): (*map(float, own), float(entry["explained"][name]))
            for name, own in entry["contributions"].items()
        }
        sources = tuple(
            Weighted(Source(w["error"], w["instrument"], w["distribution"]), float(w["share"]))
            for w in entry["sources"]
        )
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"no errors shared by runs: {error!r}") from None
    if any(len(own) != len(errors) + 1 for own in contributions.values()):
        raise ValueError("no errors shared by runs: a quantity has not one contribution an error")
    if not {w.source.error for w in sources} <= set(errors):
        raise ValueError("no errors shared by runs: a source is of an error that is not listed")
    return SharedErrors(entry["basis"], errors, sources, contributions)


@dataclass(frozen=True)
class Chain:
    """The channels of a run: what they state, and whose they are (empty: nothing is known of that)."""

    force: ChannelUncertainty
    wires: tuple[ChannelUncertainty, ...]
    force_identity: ChannelIdentity | None = None
    wire_identities: tuple[ChannelIdentity, ...] = ()
    stand: str = ""
    """Whose clock and moving mass it is."""

    @property
    def identities(self) -> tuple[ChannelIdentity, tuple[ChannelIdentity, ...]]:
        """Identity of the force channel, and of each wire."""
        known = self.wire_identities if len(self.wire_identities) == len(self.wires) else None
        wires = known or tuple(assumed(f"stroke_{n}", wire) for n, wire in enumerate(self.wires, start=1))
        return self.force_identity or assumed("force", self.force), wires


class Regression:
    """Drawn errors of a run's channels, on which what was drawn of its figures is regressed.

    Parameters
    ----------
    chain : Chain
        Of the run; states accuracy (else nothing was drawn).
    draws : Draws
        As drawn for it.
    """

    def __init__(self, chain: Chain, draws: Draws) -> None:
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


def _sources(chain: Chain, errors: Sequence[str]) -> list[Weighted]:
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


def _one(error: str, instrument: str) -> Weighted:
    return Weighted(Source(error, instrument, "rectangular"), 1.0)


def _several(
    error: str, distribution: Distribution, instruments: Sequence[str], u: Sequence[float]
) -> list[Weighted]:
    """Return the parts that several instruments have in an error; nothing of those that have none."""
    whole = math.hypot(*u)
    parts = zip(instruments, u, strict=True)
    return [Weighted(Source(error, text, distribution), own / whole) for text, own in parts if own > 0.0]
