"""Extremes of runs in a report: greatest and least of all samples, beside the means."""

from __future__ import annotations

from bufferstand.evaluation.report.content import DASH, Cell, Column, Table, fixed, measured_cell
from bufferstand.evaluation.report.source import ReportRun, ReportSource

_SHOWN = (
    ("force_max_kN", "Force max.", "kN"),
    ("force_min_kN", "Force min.", "kN"),
    ("stroke_max_mm", "Stroke max.", "mm"),
    ("speed_max_mm_per_s", "Speed max.", "mm/s"),
    ("temperature_max_C", "Temperature max.", "°C"),
)
_NOT_HAD = "not to be had from the record; see the warnings of the run"


def extremes_table(source: ReportSource) -> Table:
    """Return the extremes of each run with U, and when they were reached."""
    return Table(
        "Extremes of all samples",
        (
            Column("Run"),
            *(
                column
                for _, words, unit in _SHOWN
                for column in (Column(f"{words} ± U", unit), Column("at", "s"))
            ),
        ),
        tuple(_row(run) for run in source.runs),
        note="Over every sample of the run, also outside of cycles; all other figures are those of cycles, "
        "or means over them. ? : in doubt, see Warnings.",
    )


def _row(run: ReportRun) -> tuple[Cell, ...]:
    cells = [Cell(str(run.number), "number")]
    for name, _, _ in _SHOWN:
        extreme = run.extreme(name)
        if extreme is None:
            cells += [Cell(DASH, "missing", run.problem or _NOT_HAD)] * 2
            continue
        shown = measured_cell(extreme.value, extreme.expanded_uncertainty, _NOT_HAD)
        at = DASH if extreme.time_s is None else fixed(extreme.time_s, 2)
        cells += [
            Cell(f"{shown.text} ?", "open") if extreme.doubt else shown,
            Cell(at, "number"),
        ]
    return tuple(cells)
