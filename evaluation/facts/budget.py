"""An uncertainty budget as frozen facts, and as the evaluation document has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bufferstand.evaluation.facts.document_types import BudgetEntry


@dataclass(frozen=True)
class BudgetLine:
    """One source: its standard uncertainty ``u`` (in ``unit``), sensitivity, and contribution to the result.

    ``limit`` is the half-width it was taken from (None: a standard uncertainty). ``sensitivity`` is None
    where a line stands for several inputs or has no error, ``degrees_of_freedom`` where it is infinite.
    """

    source: str
    unit: str
    value: float
    limit: float | None
    distribution: str
    u: float
    sensitivity: float | None
    contribution: float
    degrees_of_freedom: float | None


@dataclass(frozen=True)
class Budget:
    """The budget of one result; ``u_monte_carlo`` is the standard uncertainty of record, to compare with."""

    quantity: str
    unit: str
    value: float
    u: float
    u_monte_carlo: float | None
    degrees_of_freedom: float | None
    coverage_factor_95: float
    lines: tuple[BudgetLine, ...]


def budget_entry(budgets: Sequence[Budget]) -> list[BudgetEntry]:
    """Return budgets as the evaluation document has them (docs/evaluation/uncertainty.md)."""
    return [
        {
            "quantity": b.quantity,
            "unit": b.unit,
            "value": b.value,
            "standard_uncertainty": b.u,
            "monte_carlo_standard_uncertainty": b.u_monte_carlo,
            "degrees_of_freedom": b.degrees_of_freedom,
            "coverage_factor_95": b.coverage_factor_95,
            "sources": [
                {
                    "source": line.source,
                    "unit": line.unit,
                    "value": line.value,
                    "limit": line.limit,
                    "distribution": line.distribution,
                    "standard_uncertainty": line.u,
                    "sensitivity": line.sensitivity,
                    "contribution": line.contribution,
                    "degrees_of_freedom": line.degrees_of_freedom,
                }
                for line in b.lines
            ],
        }
        for b in budgets
    ]
