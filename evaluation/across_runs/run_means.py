"""Means of evaluated runs as figures with the contributions of their shared errors."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.across_runs.combine import RunFigure
from bufferstand.evaluation.facts import Basis, RunEvaluation, SharedContributions, weakest
from bufferstand.evaluation.uncertainty import COVERAGE

_ASSUMED = (
    "shared errors are assumed, not on record: neither certificate nor stand is named, and channels that "
    "state the same are taken to have the same errors in all runs"
)


def figure_of(run: RunEvaluation, quantity: str) -> RunFigure | None:
    """Return a mean of a run with its standard uncertainty and what of it is shared; None without either."""
    measured = run.summary.values.get(quantity)
    if measured is None or measured.value is None or measured.expanded_uncertainty is None:
        return None
    shared = SharedContributions() if run.shared_errors is None else run.shared_errors.of(quantity)
    return RunFigure(measured.value, measured.expanded_uncertainty / COVERAGE, shared)


def assumption(basis: Basis) -> tuple[str, ...]:
    """Return what is to be said of runs that nothing but their statements joins: a warning, or none."""
    return (_ASSUMED,) if basis == "statement" else ()


def basis_of(runs: Sequence[RunEvaluation]) -> Basis:
    """Return on what it rests that runs have errors in common: the weakest of all."""
    return weakest([run.shared_errors.basis for run in runs if run.shared_errors is not None])
