"""Figures of a comparison: the loops of one step over each other, and the differences over the steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bufferstand.evaluation.catalogue import MAIN
from bufferstand.evaluation.figures import ChangeSeries, LoopCurve, changes_plot, labelled_loops
from bufferstand.evaluation.report.content import (
    Cell,
    Column,
    Picture,
    Table,
    fixed,
    quantity_cell,
    significant,
)
from bufferstand.evaluation.report.sections import ComparedFigures, shown_loop, start_C
from bufferstand.evaluation.report.source import ComparedSpecimens, Condition, ReportRun

MOST_LOOP_FIGURES = 8


def comparison_pictures(sides: ComparedSpecimens, compared: Sequence[ComparedFigures]) -> list[Picture]:
    """Return the differences of each side to the first, and the loops of the first eight shared steps."""
    conditions = list({row.condition.number: row.condition for row in compared}.values())
    pictures = [
        picture
        for place in range(1, len(sides.sides))
        if (picture := _changes_picture(sides, compared, place)) is not None
    ]
    drawn = [one for c in conditions if (one := _loops_picture(sides, c, len(conditions))) is not None]
    return [*pictures, *drawn[:MOST_LOOP_FIGURES]]


def _changes_picture(
    sides: ComparedSpecimens, compared: Sequence[ComparedFigures], place: int
) -> Picture | None:
    series, rows = [], []
    for name in MAIN.names:
        found = [
            (row, apart)
            for row in compared
            if row.name == name
            for at, apart in row.differences()
            if at == place and apart.relative is not None
        ]
        if not found:
            continue
        reference = [row.values[0] for row, _ in found]
        scale = np.array([100.0 / abs(one.value) for one in reference if one is not None])
        change = np.array([apart.value for _, apart in found]) * scale
        U = np.array([apart.expanded_uncertainty or 0.0 for _, apart in found]) * scale
        steps = np.array([float(row.condition.number) for row, _ in found])
        series.append(ChangeSeries(found[0][0].words, steps, change, U))
        rows += [
            (
                Cell(row.words),
                Cell(str(row.condition.number), "number"),
                Cell(f"{fixed(float(value), 2)}" + (f" ± {fixed(float(u), 2)}" if u > 0.0 else ""), "number"),
            )
            for (row, _), value, u in zip(found, change, U, strict=True)
        ]
    if not series:
        return None
    letters = [sides.sides[n].letter for n in (place, 0)]
    return Picture(
        caption=f"Differences of {letters[0]} to {letters[1]} in % of {letters[1]}, step by step. Bars: "
        "expanded uncertainty (k = 2) of the difference; where a bar reaches 0, nothing tells the two apart.",
        alt=f"Differences of {len(series)} quantities over the steps; the numbers are tabulated.",
        plot=changes_plot(series, max(row.condition.number for row in compared)),
        numbers=Table(
            f"Differences of {letters[0]} to {letters[1]}",
            (Column("Quantity"), Column("Step"), Column("Change ± U", "%")),
            tuple(rows),
        ),
    )


def _loops_picture(sides: ComparedSpecimens, condition: Condition, conditions: int) -> Picture | None:
    loops: list[LoopCurve] = []
    labels, rows = [], []
    for side, run in zip(sides.sides, condition.runs, strict=True):
        loop = None if run is None else shown_loop(run)
        if run is None or loop is None:
            continue
        loops.append(loop)
        warm = start_C(run)
        labels.append(
            f"{side.letter} (run {run.label}" + ("" if warm is None else f", {fixed(warm, 1)} °C") + ")"
        )
        rows.append(_numbers(side.letter, run, loop))
    if len(loops) < 2:
        return None
    more = (
        f" Loops of the first {MOST_LOOP_FIGURES} of {conditions} steps are drawn; the tables hold all."
        if condition.number == 1 and conditions > MOST_LOOP_FIGURES
        else ""
    )
    return Picture(
        caption=f"Step {condition.number}, {condition.words}: loops of {len(loops)} specimens.{more}",
        alt=f"Force–stroke loops of one step: {', '.join(labels)}; the numbers are tabulated.",
        plot=labelled_loops(loops, labels),
        numbers=Table(
            "The cycles drawn",
            (
                Column("Of"),
                Column("Run"),
                Column("Cycle"),
                Column("End stroke", "mm"),
                Column("Force max.", "kN"),
                Column("Damping Wₐ/Wₛ", "–"),
            ),
            tuple(rows),
        ),
    )


def _numbers(letter: str, run: ReportRun, loop: LoopCurve) -> tuple[Cell, ...]:
    cycle = run.shown_cycle() or {}
    return (
        Cell(letter),
        Cell(run.label, "number"),
        Cell(str(loop.cycle), "number"),
        quantity_cell("stroke_max_mm", float(np.nanmax(loop.stroke_mm)), ""),
        Cell(significant(float(np.nanmax(loop.force_kN))), "number"),
        quantity_cell("damping", cycle.get("damping"), "not to be had of this cycle"),
    )
