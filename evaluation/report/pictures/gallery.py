"""The figures of a report, each with its caption, what it shows in words, and the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.figures import (
    STATIC_MM,
    LoopCurve,
    Plot,
    Window,
    amplitude_loops,
    dynamic_loops,
    frequency_loops,
    labelled_loops,
    static_loops,
)
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Picture,
    Section,
    Table,
    Texts,
    fixed,
    significant,
    usable,
)
from bufferstand.evaluation.report.pictures.model import model_pictures
from bufferstand.evaluation.report.pictures.timelines import stroke_pictures, temperature_pictures
from bufferstand.evaluation.report.pictures.trends import runs_of_trend, trend_pictures
from bufferstand.evaluation.report.sections import (
    as_recorded,
    columns,
    cycle_head,
    model_section,
    severity,
    value_cell,
    worst,
)
from bufferstand.evaluation.report.source import ReportRun, ReportSource, at_strokes, loop_of, runs_text
from bufferstand.evaluation.wording import joined, kind_words, numeral, said, said_count, verdict_words

_FIRST_PAGE_MM = 62.0
"""Height of the figure on the first page."""
_LEVEL_STEP_MM = 10.0
_LOOP_COLUMNS = QUANTITIES.that(lambda entry: entry.shown.beside_loops)


def certificate_picture(source: ReportSource) -> Picture | None:
    """Return the force over the stroke for the first page.

    That of the test that the statement rests on, with its permitted ranges; else of another slow run; else
    the loops of the harmonic runs.
    """
    shown = _shown_first(source)
    if shown is not None:
        return _static_picture(shown, _FIRST_PAGE_MM, legend=False)
    return next(iter(_dynamic_pictures(source)), None)


def _shown_first(source: ReportSource) -> ReportRun | None:
    """Return the run that the first page draws, or None if no slow run can be drawn."""
    runs = [run for run in source.runs if run.kind != "harmonic" and _loops(run)]
    return min(runs, key=lambda run: (not run.stated, _severity(run)), default=None)


def _severity(run: ReportRun) -> int:
    verdict = run.evaluated.get("verdict")
    return len(run.requirements) if verdict is None else severity(verdict)


def figures_section(source: ReportSource) -> Section | None:
    """Return every figure that the runs give something to show in, but for that of the first page."""
    first = _shown_first(source)
    slow = [run for run in source.runs if run.kind != "harmonic" and run is not first]
    pictures = [
        *(picture for run in slow if (picture := _static_picture(run)) is not None),
        *_dynamic_pictures(source)[first is None :],
        *trend_pictures(source),
        *_temperature_pictures(source),
        *(() if _of_one_run(source) else temperature_pictures(source)),
    ]
    if pictures:
        return Section("figures", said("Figures"), tuple(pictures))
    if any(run.record is not None for run in source.runs):
        return None
    return Section("figures", said("Figures"), (Texts((said("No run holds samples that could be drawn."),)),))


def course_section(source: ReportSource) -> Section | None:
    """Return the stroke over the campaign, for the annex; with the temperatures where it is one run's."""
    pictures = [*(temperature_pictures(source) if _of_one_run(source) else ()), *stroke_pictures(source)]
    return (
        Section("course", said("Course of the campaign"), tuple(pictures), annex=True) if pictures else None
    )


def _of_one_run(source: ReportSource) -> bool:
    """Say whether a report is of one run: its few pages are for what came out, and the rest is annex."""
    return len(source.runs) == 1


def model_comparison_section(source: ReportSource) -> Section | None:
    """Return by how much a given spring model misses the runs, with its figures; None without a model."""
    section = model_section(source)
    if section is None or source.modelled is None:
        return None
    return replace(section, blocks=(*section.blocks, *model_pictures(source.runs, source.modelled)))


def _loops(run: ReportRun) -> list[LoopCurve]:
    cycles = [cycle for cycle in run.cycles if cycle.get("complete")] or run.cycles
    return [loop for cycle in cycles if (loop := loop_of(run, cycle)) is not None]


def _static_picture(run: ReportRun, height_mm: float = STATIC_MM, *, legend: bool = True) -> Picture | None:
    """Return the cycles of a run with its permitted ranges; whose these are stands in the ``legend``, too."""
    loops = _loops(run)
    if not loops:
        return None
    windows = _windows(run)
    limits = said(" with the permitted ranges of {run}", run=_source_of_windows(run)) if windows else ""
    top = max(loops, key=lambda loop: float(np.nanmax(loop.stroke_mm)))
    force, stroke = (fixed(float(np.nanmax(v)), 1) for v in (top.force_kN, top.stroke_mm))
    count = said_count("{count} cycle", "{count} cycles", len(loops))
    return Picture(
        caption=said(
            "Force over stroke of {count} of run {number} ({kind}){limits}.",
            count=count,
            number=run.number,
            kind=kind_words(run.kind),
            limits=limits,
        ),
        alt=said(
            "{count_of_loops} force–stroke loops of run {number}, up to {force} kN at {stroke} mm. ",
            count_of_loops=len(loops),
            number=run.number,
            force=force,
            stroke=stroke,
        )
        + joined(
            " ",
            (
                said("At {at} mm: {what}.", at=numeral(f"{w.at:g}"), what=verdict_words(w.verdict))
                for w in windows
            ),
        ),
        plot=static_loops(loops, windows, _source_of_windows(run) if legend else "", height_mm=height_mm),
        numbers=_levels_table(loops),
    )


def _source_of_windows(run: ReportRun) -> str:
    """Return standard and clause, or the source, that the force windows are from."""
    sources = dict.fromkeys(
        joined(", ", (str(part) for part in (r["standard"], r.get("clause") or r.get("source")) if part))
        for r in run.stated
        if usable(r.get("stroke_mm")) is not None
    )
    return joined("; ", sources)


def _windows(run: ReportRun) -> list[Window]:
    """Return the permitted force ranges with what was measured in all cycles, and the gravest verdict.

    A window that the limit set leaves open to one side is tabled and not drawn; a run that only characterises
    has none.
    """
    by_id: dict[tuple[float, str], list[Mapping[str, Any]]] = {}
    for requirement in run.stated:
        if (stroke_mm := usable(requirement.get("stroke_mm"))) is not None:
            by_id.setdefault((stroke_mm, str(requirement["id"])), []).append(requirement)
    windows = []
    for (at, _), requirements in sorted(by_id.items()):
        lower, upper = (usable(requirements[0].get(key)) for key in ("lower_limit", "upper_limit"))
        if lower is None or upper is None:
            continue
        measured = tuple(
            value
            for requirement in requirements
            if (value := usable(requirement.get("measured"))) is not None
        )
        verdict = worst([str(requirement["verdict"]) for requirement in requirements])
        label = said(
            "{preload}{lower}–{upper}",
            preload=said("preload") + " " if at == 0.0 else "",
            lower=numeral(f"{lower:g}"),
            upper=numeral(f"{upper:g}"),
        )
        if not measured:
            label += "\n" + verdict_words(verdict)
        windows.append(Window(at, lower, upper, measured, verdict, label))
    return windows


def _levels_table(loops: Sequence[LoopCurve]) -> Table:
    """Return the forces of each loop at round strokes."""
    reach = max(float(np.nanmax(loop.stroke_mm)) for loop in loops)
    levels = [_LEVEL_STEP_MM * step for step in range(1, int(reach // _LEVEL_STEP_MM) + 1)]
    read = [at_strokes(loop, levels) for loop in loops]
    rows = []
    for number, level in enumerate(levels):
        cells = [Cell(numeral(f"{level:g}"), "number")]
        for forces in read:
            for force in forces[number]:
                missing = Cell(
                    DASH, "missing", said("the cycle does not reach this stroke, or samples are missing")
                )
                cells.append(missing if force is None else Cell(fixed(force, 1), "number"))
        rows.append(tuple(cells))
    columns = [Column(said("Stroke"), "mm")]
    for loop in loops:
        columns += [
            Column(said("Cycle {cycle} loading", cycle=loop.cycle), "kN"),
            Column(said("Cycle {cycle} unloading", cycle=loop.cycle), "kN"),
        ]
    return Table(said("Force at round strokes"), tuple(columns), tuple(rows))


def _dynamic_pictures(source: ReportSource) -> list[Picture]:
    shown = {
        run.number: (run, cycle, loop)
        for run in source.runs
        if run.kind == "harmonic"
        and (cycle := run.shown_cycle()) is not None
        and (loop := loop_of(run, cycle)) is not None
    }
    if not shown:
        return []
    static, over = _static_loop(source)
    pictures = [
        _loops_picture(
            list(shown.values()),
            said("Dynamic loops of {runs}{over}.", runs=runs_text(shown), over=over),
            dynamic_loops([loop for _, _, loop in shown.values()], static),
        )
    ]
    for quantity in ("damping", "tangent_stiffness"):
        for trend in source.document.get("trends") or []:
            numbers = [number for number in runs_of_trend(source, trend) if number in shown]
            varies = usable(trend.get("amplitude_mm")) is None
            if trend.get("quantity") != quantity or len(numbers) < 2 or varies is (quantity == "damping"):
                continue
            chosen = [shown[number] for number in numbers]
            loops = [loop for _, _, loop in chosen]
            over_static = said(",{over}", over=over) if over else ""
            if varies:
                caption = said(
                    "Loops at constant prestress and several amplitudes, {trend}{over_static}.",
                    trend=_conditions(trend),
                    over_static=over_static,
                )
                pictures.append(_loops_picture(chosen, caption, amplitude_loops(loops, static)))
            else:
                constant = said("constant prestress and amplitude and several frequencies")
                caption = said(
                    "Loops at {constant}, {trend}{over_static}.",
                    constant=constant,
                    trend=_conditions(trend),
                    over_static=over_static,
                )
                pictures.append(_loops_picture(chosen, caption, frequency_loops(loops, static)))
    return pictures


def _temperature_pictures(source: ReportSource) -> list[Picture]:
    """Return a figure for each comparison of runs of one step at several temperatures."""
    pictures = []
    for comparison in source.document.get("temperature_comparisons") or []:
        loops, labels = [], []
        for entry in (comparison["reference"], *comparison["runs"]):
            run = next((run for run in source.runs if run.id == entry["run"]), None)
            cycle = None if run is None else run.shown_cycle()
            loop = None if run is None or cycle is None else loop_of(run, cycle)
            if run is not None and loop is not None:
                loops.append(loop)
                labels.append(
                    said(
                        "{temperature_c} °C (run {number})",
                        temperature_c=fixed(entry["temperature_C"], 1),
                        number=run.number,
                    )
                )
        if len(loops) < 2:
            continue
        pictures.append(
            Picture(
                caption=said(
                    "Force over stroke of the same step at {count_of_loops} temperatures of the specimen.",
                    count_of_loops=len(loops),
                ),
                alt=said(
                    "Force–stroke loops at {list}; the numbers are tabulated.", list=joined(", ", labels)
                ),
                plot=labelled_loops(loops, labels),
                numbers=as_recorded(source, comparison),
            )
        )
    return pictures


def _conditions(trend: Mapping[str, Any]) -> str:
    prestress, amplitude = usable(trend.get("prestress_mm")), usable(trend.get("amplitude_mm"))
    text = (
        said("prestress unknown")
        if prestress is None
        else said("prestress {prestress} mm", prestress=significant(prestress, 3))
    )
    return (
        text
        if amplitude is None
        else said("{text}, amplitude {amplitude} mm", text=text, amplitude=significant(amplitude, 3))
    )


def _static_loop(source: ReportSource) -> tuple[LoopCurve | None, str]:
    """Return the quasi-static cycle to draw dynamic loops over, and how the caption names it."""
    for run in source.runs:
        cycle = run.shown_cycle() if run.kind == "static" else None
        loop = loop_of(run, cycle) if cycle is not None else None
        if loop is not None:
            return loop, said(
                " over the quasi-static cycle {cycle} of run {number} (dotted)",
                cycle=loop.cycle,
                number=run.number,
            )
    return None, ""


def _loops_picture(
    chosen: Sequence[tuple[ReportRun, Mapping[str, Any], LoopCurve]], caption: str, plot: Plot
) -> Picture:
    highest = max(float(np.nanmax(loop.force_kN)) for _, _, loop in chosen)
    rows = []
    for run, cycle, _ in chosen:
        rows.append((*cycle_head(run, cycle), *(value_cell(entry, cycle) for entry in _LOOP_COLUMNS)))
    return Picture(
        caption=caption,
        alt=said(
            "{count_of_chosen} force–stroke loops, up to {highest} kN; the numbers are tabulated.",
            count_of_chosen=len(chosen),
            highest=fixed(highest, 1),
        ),
        plot=plot,
        numbers=Table(
            said("Cycles shown"),
            (
                Column(said("Run")),
                Column(said("Cycle")),
                Column(said("State")),
                *columns(_LOOP_COLUMNS),
            ),
            tuple(rows),
        ),
    )
