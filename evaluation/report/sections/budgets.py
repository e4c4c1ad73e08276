"""The linear uncertainty budgets of the runs, as the evaluation document states them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.catalogue import MAIN
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    significant,
    usable,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource

_SYMBOLS = {entry.name: entry.symbol for entry in MAIN}
_EXPLANATION = (
    "Linear budget (JCGM 100) of the means over the cycles used. The best estimate of each input error is 0, "
    "u its standard uncertainty, c the sensitivity of the result to it (in the units of both); contributions "
    "|c| u are in % of the result, ν degrees of freedom. Inputs are shared: the force scale concerns both "
    "energies alike and leaves damping, their ratio, untouched. The last row is the standard uncertainty of "
    "record, by Monte Carlo propagation through the whole loop (JCGM 101)."
)
_MANY = "one line for several inputs: there is no single sensitivity"
_NONE = "no error of this kind, or it does not reach this result"
_OWN = "another one for each result"
_NOTHING = 1e-9
"""A share of the result that is rounding, no contribution."""
_AS_GOOD_AS_INFINITE = 1e4
_NOT_DRAWN = "not propagated by Monte Carlo"


def budgets_section(source: ReportSource) -> Section | None:
    """Return a table for each run that has budgets, or None if none has."""
    tables = [table for run in source.runs if (table := _table(run)) is not None]
    if not tables:
        return None
    return Section("uncertainty-budget", "Uncertainty budget", (Texts((_EXPLANATION,)), *tables))


def _table(run: ReportRun) -> Table | None:
    budgets = [b for b in run.evaluated.get("budget") or [] if b.get("quantity") in _SYMBOLS]
    if not budgets:
        return None
    names = list(dict.fromkeys(line["source"] for b in budgets for line in b["sources"]))
    columns = [Column("Source"), Column("u"), Column("ν")]
    for budget in budgets:
        symbol = _SYMBOLS[budget["quantity"]]
        columns += [Column(f"c({symbol})"), Column(f"u({symbol})", "%")]
    rows = [_row(name, budgets) for name in names]
    rows.append(_total("Combined", budgets, "standard_uncertainty"))
    rows.append(_total("Monte Carlo", budgets, "monte_carlo_standard_uncertainty"))
    values = ", ".join(
        f"{_SYMBOLS[b['quantity']]} {significant(b['value'])}{'' if b['unit'] == '1' else ' ' + b['unit']}"
        for b in budgets
    )
    return Table(f"Uncertainty budget of run {run.number}", tuple(columns), tuple(rows), note=f"{values}.")


def _row(name: str, budgets: Sequence[Mapping[str, Any]]) -> tuple[Cell, ...]:
    """Return the row of one source; of noise, which is another for each result, u is the result's own."""
    lines = [next((line for line in b["sources"] if line["source"] == name), None) for b in budgets]
    known = [line for line in lines if line is not None]
    dof = known[0]["degrees_of_freedom"]
    cells = [Cell(name), _input(known), Cell("∞" if dof is None else significant(dof, 3), "number")]
    for line, budget in zip(lines, budgets, strict=True):
        if line is None or line["contribution"] <= _NOTHING * abs(budget["value"]):
            cells += [Cell(DASH, "missing", _NONE)] * 2
            continue
        sensitivity = usable(line["sensitivity"])
        shared = sensitivity is not None
        cells.append(_number(sensitivity) if shared else Cell(DASH, "missing", _MANY))
        cells.append(_percent(line["contribution"], budget["value"]))
    return tuple(cells)


def _input(lines: Sequence[Mapping[str, Any]]) -> Cell:
    """Return u of an input with its unit, or a dash where it is another one for each result."""
    if len({(line["unit"], line["standard_uncertainty"]) for line in lines}) > 1:
        return Cell(DASH, "missing", _OWN)
    u, unit = lines[0]["standard_uncertainty"], lines[0]["unit"]
    text = _number(u).text
    return Cell(text if unit == "1" else f"{text} {unit}", "number")


def _total(title: str, budgets: Sequence[Mapping[str, Any]], key: str) -> tuple[Cell, ...]:
    cells = [Cell(title), Cell(""), Cell("")]
    for budget in budgets:
        u, dof = usable(budget.get(key)), usable(budget["degrees_of_freedom"])
        limited = dof is not None and dof < _AS_GOOD_AS_INFINITE and key == "standard_uncertainty"
        cells.append(Cell(f"ν {dof:.0f}" if limited else ""))
        cells.append(Cell(DASH, "missing", _NOT_DRAWN) if u is None else _percent(u, budget["value"]))
    return tuple(cells)


def _number(value: Any) -> Cell:
    number = usable(value)
    if number is None:
        return Cell(DASH, "missing", _NONE)
    if number != 0.0 and abs(number) < 1e-3:
        return Cell(f"{number:.2e}".replace("-", "−"), "number")
    return Cell(significant(number, 3), "number")


def _percent(part: float, value: float) -> Cell:
    share = 100.0 * abs(part / value) if value else 0.0
    return Cell("< 0.001" if share < 0.001 else significant(share, 2), "number")
