"""From which channels each figure and each row of the requirements is read, declared once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import get_args

from bufferstand.evaluation.catalogue import QUANTITIES, Channel
from bufferstand.evaluation.facts import CycleResult, Extreme, Finding, Summary, spoiled_cycles

BOTH = ("force", "stroke")
ROWS: Mapping[str, tuple[str, ...]] = {
    "cycle-count": ("stroke",),
    "pause-limit": ("stroke",),
    "immediate-unloading": ("stroke",),
    "full-release": ("stroke",),
    "speed-limit": ("stroke",),
    "full-stroke": BOTH,
    "temperature-range": ("temperature", "stroke"),  # the stroke says when a cycle begins and ends
    "rest-after-assembly": (),
    "impact-speed": (),
    "assembled-length": (),
    "final-length": (),
    "proof-load": (),
    "load-cycles": ("stroke",),
    "permanent-deformation": BOTH,
}
"""Channels of each row by its id. Forces at a stroke, energies, ratios, and whatever a limit set names itself
are read from both; what an inspector answers from none
(:func:`bufferstand.evaluation.requirements.rows.row`)."""
_FORCE_REACHED = "proof-load-"
"""Rows whose ids begin so are read from the force alone."""
_LOCAL = ("spike", "clipped", "frozen")
"""Kinds that make a single reading doubtful where they are."""


def read_from(identity: str) -> tuple[str, ...]:
    """Return the quantities that a row is read from, by its id."""
    if identity.startswith(_FORCE_REACHED):
        return ("force",)
    return ROWS.get(identity, BOTH)


@dataclass(frozen=True)
class SpoiledFigures:
    """What the findings of a run take from its figures and rows."""

    findings: tuple[Finding, ...] = ()

    @property
    def spoiling(self) -> tuple[Finding, ...]:
        """Those that take any."""
        return tuple(finding for finding in self.findings if finding.effect == "spoils")

    @property
    def cycles(self) -> frozenset[int]:
        """Cycles whose force or stroke is spoiled."""
        return frozenset(spoiled_cycles(self.findings, BOTH))

    @property
    def cycles_of_stroke(self) -> frozenset[int]:
        """Cycles whose stroke is spoiled: even where they begin and end is not certain."""
        return frozenset(spoiled_cycles(self.findings, ("stroke",)))

    def of_row(self, identity: str, cycle: int | None) -> Finding | None:
        """Return the finding that takes a row, if there is one.

        Parameters
        ----------
        identity : str
            Of the requirement or condition.
        cycle : int or None
            Its cycle; None: it rests on the whole record.
        """
        wanted = read_from(identity)
        for finding in self.spoiling:
            if finding.quantity in wanted and (cycle is None or cycle in finding.cycles):
                return finding
        return None

    def warnings(self, numbered: Callable[[Sequence[int]], str]) -> list[str]:
        """Return a warning for each finding, with the cycles that it takes and what becomes of them."""
        found = []
        for finding in self.findings:
            text = finding.text
            if finding.effect == "spoils" and finding.cycles:
                text += f" ({numbered(finding.cycles)}: no figures of the specimen, no expanded uncertainty)"
            found.append(text)
        return found

    def figures(self, names: Iterable[str], cycles: Iterable[int]) -> frozenset[str]:
        """Return those figures that are spoiled in one of some cycles."""
        wanted = set(cycles)
        spoiled = {
            channel
            for channel in get_args(Channel)
            if wanted & set(spoiled_cycles(self.findings, (channel,)))
        }
        return frozenset(name for name in names if QUANTITIES.named(name).reads & spoiled)


def without_claims(results: Sequence[CycleResult], spoiled: SpoiledFigures) -> list[CycleResult]:
    """Return cycles without the uncertainties of figures that are spoiled: no channel states their error."""
    if not spoiled.spoiling:
        return list(results)
    found = []
    for result in results:
        out = spoiled.figures(result.expanded_uncertainty, (result.cycle.index,))
        if not out:
            found.append(result)
            continue
        known = {name: None if name in out else u for name, u in result.expanded_uncertainty.items()}
        why = {f"U({name})": "no channel states the error of spoiled readings" for name in out}
        found.append(result._replace(expanded_uncertainty=known, missing={**result.missing, **why}))
    return found


def summary_without_claims(summary: Summary, spoiled: SpoiledFigures) -> Summary:
    """Return a summary without the uncertainties of means of spoiled figures."""
    out = spoiled.figures(summary.values, summary.cycles_used)
    if not out:
        return summary
    values = {
        name: replace(one, expanded_uncertainty=None, half_width_95=None, scatter_u=0.0)
        if name in out
        else one
        for name, one in summary.values.items()
    }
    return replace(summary, values=values)


def doubted(extremes: Mapping[str, Extreme], spoiled: SpoiledFigures) -> dict[str, Extreme]:
    """Return extremes, with a doubt where a finding is at their moment or of the whole record."""
    return {name: _doubted(extreme, spoiled) for name, extreme in extremes.items()}


def _doubted(extreme: Extreme, spoiled: SpoiledFigures) -> Extreme:
    if extreme.doubt or extreme.time_s is None:
        return extreme
    quantity = extreme.channel.split("_", maxsplit=1)[0]
    for finding in spoiled.findings:
        here = finding.start_s <= extreme.time_s <= finding.end_s
        own = quantity == finding.quantity
        is_local = finding.kind in _LOCAL
        if own and here and (is_local or (finding.whole_record and finding.effect == "spoils")):
            return replace(extreme, doubt=finding.text, expanded_uncertainty=None, half_width_95=None)
    return extreme
