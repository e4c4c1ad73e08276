"""Errors that the means of a run share with other runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from bufferstand.evaluation.facts.channel_identity import ChannelIdentity, assumed
from bufferstand.evaluation.facts.document_types import Basis, SharedErrorsEntry
from bufferstand.foundation.channels import ChannelUncertainty

Distribution = Literal["rectangular", "normal"]


class ErrorSource(NamedTuple):
    """An error by which runs may hang together: they do where both its texts agree."""

    error: str
    instrument: str
    distribution: Distribution


@dataclass(frozen=True)
class SharedContributions:
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

    by_source: Mapping[ErrorSource, float] = field(default_factory=dict)
    explained_u: float = 0.0

    def scaled(self, factor: float) -> SharedContributions:
        """Return what so many times the figure owes."""
        return SharedContributions(
            {s: factor * c for s, c in self.by_source.items()}, abs(factor) * self.explained_u
        )


@dataclass(frozen=True)
class WeightedSource:
    """A source, and its share of the standard uncertainty of the error that it is part of (Σ share² = 1)."""

    source: ErrorSource
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
        what all of them explain (:class:`SharedContributions`).
    """

    basis: Basis
    errors: tuple[str, ...]
    sources: tuple[WeightedSource, ...]
    contributions: Mapping[str, tuple[float, ...]]

    def of(self, quantity: str) -> SharedContributions:
        """Return what a mean owes to every source; nothing where it was not propagated."""
        own = self.contributions.get(quantity)
        if own is None:
            return SharedContributions()
        by_error = dict(zip(self.errors, own[:-1], strict=True))
        found: dict[ErrorSource, float] = {}
        for weighted in self.sources:
            contribution = by_error[weighted.source.error] * weighted.share
            if contribution != 0.0:
                # Two wires that name one instrument have one error of it.
                found[weighted.source] = found.get(weighted.source, 0.0) + contribution
        return SharedContributions(found, own[-1])

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
            WeightedSource(ErrorSource(w["error"], w["instrument"], w["distribution"]), float(w["share"]))
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
class MeasuringChain:
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
