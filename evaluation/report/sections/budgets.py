"""The linear uncertainty budgets of the evaluation document: one in the text, the others in the annex."""

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
    to_digits,
    usable,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.evaluation.wording import joined, label, numeral, said

_SYMBOLS = {entry.name: entry.symbol for entry in MAIN}
_LABELS = {entry.name: entry.label for entry in MAIN}
_EXPLANATION = said(
    "Linear budget (JCGM 100) of the means over the cycles used. The best estimate of each input "
    "error is 0, u its standard uncertainty, c the sensitivity of the result to it (in the units "
    "of both); contributions |c| u are in % of the result, ν degrees of freedom. Inputs are "
    "shared: the force scale concerns both energies alike and leaves damping, their ratio, "
    "untouched. The last row is the standard uncertainty of record, by Monte Carlo propagation "
    "through the whole loop (JCGM 101)."
)
_NO_BUDGET = said("this run has no budget of it")
_MANY = said("one line for several inputs: there is no single sensitivity")
_NONE = said("no error of this kind, or it does not reach this result")
_OWN = said("another one for each result")
_RAISED = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_NOTHING = 1e-9
"""A share of the result that is rounding, no contribution."""
_AS_GOOD_AS_INFINITE = 1e4
_NOT_DRAWN = said("not propagated by Monte Carlo")


def budgets_section(source: ReportSource) -> Section | None:
    """Return the budget of the run whose results are the least certain, or None if no run has one."""
    runs = _runs_with_budgets(source)
    if not runs:
        return None
    least = max(runs, key=lambda run: max(_share(budget) for budget in _budgets(run)))
    worst = said(
        "The budget shown is that of run {number}, whose results are the least certain; see "
        "Uncertainty by run.",
        number=least.number,
    )
    texts = (worst,) if len(runs) > 1 else ()
    return Section(
        "uncertainty-budget", said("Uncertainty budget"), (Texts((*texts, _EXPLANATION)), _table(least))
    )


def further_budgets_section(source: ReportSource) -> Section | None:
    """Return the other runs' uncertainties in a row each, in a detailed report their whole budgets.

    None where one run or none has a budget.
    """
    runs = _runs_with_budgets(source)
    if len(runs) < 2:
        return None
    tables = tuple(_table(run) for run in runs) if source.detailed else (_overview(runs),)
    return Section("further-budgets", said("Uncertainty by run"), tables, annex=True)


def _budgets(run: ReportRun) -> list[Mapping[str, Any]]:
    return [b for b in run.evaluated.get("budget") or [] if b.get("quantity") in _SYMBOLS]


def _runs_with_budgets(source: ReportSource) -> list[ReportRun]:
    return [run for run in source.runs if _budgets(run)]


def _of_record(budget: Mapping[str, Any]) -> float:
    """Return the standard uncertainty by Monte Carlo, or the combined one where none was drawn."""
    drawn = usable(budget.get("monte_carlo_standard_uncertainty"))
    return float(budget["standard_uncertainty"]) if drawn is None else drawn


def _share(budget: Mapping[str, Any]) -> float:
    return abs(_of_record(budget) / budget["value"]) if budget["value"] else 0.0


def _overview(runs: Sequence[ReportRun]) -> Table:
    """Return a row a run: the standard uncertainty of each result, and what contributes most to it."""
    names = list(dict.fromkeys(b["quantity"] for run in runs for b in _budgets(run)))
    columns = [Column(said("Run"))]
    for name in names:
        columns += [
            Column(said("u({symbols})", symbols=_SYMBOLS[name]), "%"),
            Column(said("u({symbols}) mainly from", symbols=_SYMBOLS[name])),
        ]
    rows = []
    for run in runs:
        found = {b["quantity"]: b for b in _budgets(run)}
        cells = [Cell(str(run.number), "number")]
        for name in names:
            budget = found.get(name)
            if budget is None:
                cells += [Cell(DASH, "missing", _NO_BUDGET)] * 2
                continue
            most = max(budget["sources"], key=lambda line: abs(line["contribution"]), default=None)
            cells.append(_percent(_of_record(budget), budget["value"]))
            cells.append(Cell(DASH, "missing", _NONE) if most is None else Cell(str(most["source"])))
        rows.append(tuple(cells))
    return Table(
        said("Standard uncertainty of each run, and its largest source"),
        tuple(columns),
        tuple(rows),
        note=said("{symbols}.", symbols=joined(", ", (_named(name) for name in names))),
    )


def _named(name: str) -> str:
    """Return the symbol of a result with what it stands for."""
    return said("{symbol}: {label}", symbol=_SYMBOLS[name], label=label(_LABELS[name]))


def _table(run: ReportRun) -> Table:
    budgets = _budgets(run)
    names = list(dict.fromkeys(line["source"] for b in budgets for line in b["sources"]))
    columns = [Column(said("Source")), Column("u"), Column("ν")]
    for budget in budgets:
        symbol = _SYMBOLS[budget["quantity"]]
        columns += [
            Column(said("c({symbol})", symbol=symbol)),
            Column(said("u({symbol})", symbol=symbol), "%"),
        ]
    rows = [_row(name, budgets) for name in names]
    rows.append(_total(said("Combined"), budgets, "standard_uncertainty"))
    rows.append(_total(said("Monte Carlo"), budgets, "monte_carlo_standard_uncertainty"))
    values = joined(
        "; ",
        (
            said(
                "{named} {value}{unit}",
                named=_named(b["quantity"]),
                value=significant(b["value"]),
                unit="" if b["unit"] == "1" else " " + b["unit"],
            )
            for b in budgets
        ),
    )
    return Table(
        said("Uncertainty budget of run {number}", number=run.number),
        tuple(columns),
        tuple(rows),
        note=values + ".",
    )


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
    return Cell(text if unit == "1" else said("{text} {unit}", text=text, unit=unit), "number")


def _total(title: str, budgets: Sequence[Mapping[str, Any]], key: str) -> tuple[Cell, ...]:
    cells = [Cell(title), Cell(""), Cell("")]
    for budget in budgets:
        u, dof = usable(budget.get(key)), usable(budget["degrees_of_freedom"])
        limited = dof is not None and dof < _AS_GOOD_AS_INFINITE and key == "standard_uncertainty"
        told = said("ν {dof}", dof=numeral(f"{dof:.0f}")) if limited else ""
        cells.append(Cell(told, "number" if limited else "text"))
        cells.append(Cell(DASH, "missing", _NOT_DRAWN) if u is None else _percent(u, budget["value"]))
    return tuple(cells)


def _number(value: Any) -> Cell:
    number = usable(value)
    if number is None:
        return Cell(DASH, "missing", _NONE)
    if number != 0.0 and abs(number) < 1e-3:
        return Cell(_with_power(number), "number")
    return Cell(significant(number, 3), "number")


def _with_power(number: float) -> str:
    """Return a small number with three digits and a power of ten, as typeset: ``2.45 × 10⁻⁵``."""
    mantissa, exponent = f"{number:.2e}".split("e")
    power = str(int(exponent)).replace("-", "−").translate(_RAISED)
    return numeral(f"{mantissa.replace('-', '−')} × 10{power}")


def _percent(part: float, value: float) -> Cell:
    share = 100.0 * abs(part / value) if value else 0.0
    return Cell("< 0.001" if share < 0.001 else to_digits(share, 2), "number")
