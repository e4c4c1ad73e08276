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
from bufferstand.evaluation.wording import joined, said

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
                Cell(
                    said("{value}", value=fixed(float(value), 2))
                    + (said(" ± {u}", u=fixed(float(u), 2)) if u > 0.0 else ""),
                    "number",
                ),
            )
            for (row, _), value, u in zip(found, change, U, strict=True)
        ]
    if not series:
        return None
    letters = [sides.sides[n].letter for n in (place, 0)]
    return Picture(
        caption=said(
            "Differences of {letters} to {letters_2} in % of {letters_2}, step by step. Bars: expanded "
            "uncertainty (k = 2) of the difference; where a bar reaches 0, nothing tells the two apart.",
            letters=letters[0],
            letters_2=letters[1],
        ),
        alt=said(
            "Differences of {count_of_series} quantities over the steps; the numbers are tabulated.",
            count_of_series=len(series),
        ),
        plot=changes_plot(series, max(row.condition.number for row in compared)),
        numbers=Table(
            said("Differences of {letters} to {letters_2}", letters=letters[0], letters_2=letters[1]),
            (Column(said("Quantity")), Column(said("Step")), Column(said("Change ± U"), "%")),
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
            said("{letter} (run {label}", letter=side.letter, label=run.label)
            + ("" if warm is None else said(", {warm} °C", warm=fixed(warm, 1)))
            + ")"
        )
        rows.append(_numbers(side.letter, run, loop))
    if len(loops) < 2:
        return None
    more = (
        said(
            " Loops of the first {most_loop_figures} of {conditions} steps are drawn; the tables hold all.",
            most_loop_figures=MOST_LOOP_FIGURES,
            conditions=conditions,
        )
        if condition.number == 1 and conditions > MOST_LOOP_FIGURES
        else ""
    )
    return Picture(
        caption=said(
            "Step {number}, {words}: loops of {count_of_loops} specimens.{more}",
            number=condition.number,
            words=condition.words,
            count_of_loops=len(loops),
            more=more,
        ),
        alt=said(
            "Force–stroke loops of one step: {list}; the numbers are tabulated.", list=joined(", ", labels)
        ),
        plot=labelled_loops(loops, labels),
        numbers=Table(
            said("Cycles shown"),
            (
                Column(said("Of")),
                Column(said("Run")),
                Column(said("Cycle")),
                Column(said("End stroke"), "mm"),
                Column(said("Force max."), "kN"),
                Column(said("Damping Wₐ/Wₛ"), "–"),
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
        quantity_cell("damping", cycle.get("damping"), said("not to be had of this cycle")),
    )
