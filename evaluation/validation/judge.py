"""Compares agreed values with results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bufferstand.evaluation.validation.standard_sets import Agreed, Where


@dataclass(frozen=True)
class Check:
    """One agreed value and what was found; ``found`` is None where there is nothing in its place."""

    agreed: Agreed
    found: float | str | None

    @property
    def deviation(self) -> float | None:
        """Found less agreed, in the unit of the value; None for texts and where nothing was found."""
        if isinstance(self.found, float) and isinstance(self.agreed.value, float):
            return self.found - self.agreed.value
        return None

    @property
    def share(self) -> float | None:
        """The deviation as a share of the tolerance, without sign; None where there is no deviation."""
        if self.deviation is None or self.agreed.tolerance is None:
            return None
        if self.agreed.tolerance == 0.0:
            return 0.0 if self.deviation == 0.0 else float("inf")
        return abs(self.deviation) / self.agreed.tolerance

    @property
    def good(self) -> bool:
        """Whether the value is the agreed one, within its tolerance."""
        if self.share is not None:
            return self.share <= 1.0
        return self.found is not None and self.found == self.agreed.value


def judge_entry(agreed: Sequence[Agreed], entry: Mapping[str, Any]) -> list[Check]:
    """Compare agreed values with a run's entry of an evaluation document (docs/evaluation-document.md).

    Parameters
    ----------
    agreed : sequence of Agreed
    entry : mapping
        ``runs[i]`` of the document; of another program at least the keys that are asked for.

    Returns
    -------
    list of Check
        In the order of ``agreed``.
    """
    return [Check(one, _plain(_found(one, entry))) for one in agreed]


def _plain(value: object) -> float | str | None:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return float(value)
    return None if value is None else str(value)


def _found(agreed: Agreed, entry: Mapping[str, Any]) -> object:
    where, what = agreed.of, agreed.what
    if where.in_ == "run":
        if what == "complete_cycles":
            return sum(1 for cycle in _list(entry, "cycles") if cycle.get("complete"))
        return entry.get(what)
    if where.in_ == "requirement":
        return next((row.get(what) for row in _list(entry, "requirements") if _is_row(row, where)), None)
    if where.in_ == "cycle":
        return next((c.get(what) for c in _list(entry, "cycles") if c.get("index") == where.index), None)
    if where.in_ == "step":
        steps = _list(entry, "steps")
        within = where.index is not None and 0 < where.index <= len(steps)
        return _mean(steps[where.index - 1].get("summary"), what) if within and where.index else None
    return _mean(entry.get("summary"), what)


def _mean(summary: object, what: str) -> object:
    value = summary.get(what) if isinstance(summary, Mapping) else None
    return value.get("value") if isinstance(value, Mapping) else value


def _list(entry: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    rows = entry.get(key)
    return [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list) else []


def _is_row(row: Mapping[str, Any], where: Where) -> bool:
    return row.get("id") == where.id and row.get("cycle") == where.cycle
