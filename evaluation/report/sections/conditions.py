"""The conditions under which the runs were made (ISO/IEC 17025, 7.8.3.1 a)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    fixed,
    significant,
    usable,
)
from bufferstand.evaluation.report.sections.identity import stand_sheet
from bufferstand.evaluation.report.source import ReportRun, ReportSource, runs_text
from bufferstand.evaluation.wording import said

_ROLES = (("specimen", said("Temperature of the specimen")), ("ambient", said("Temperature of the air")))
_READ = (
    ("rest-after-assembly", said("Rest between assembly and test"), "h", min),
    ("pause-limit", said("Longest pause between static cycles"), "s", max),
    ("speed-limit", said("Greatest speed of static cycles"), "mm/s", max),
)
"""Conditions of a requirement: here of the runs alone that no statement of conformity gives them for."""
_MOST_OF_A_UNIT = 120.0
"""From so many seconds or minutes on, a duration is said in the next unit."""


def conditions_section(source: ReportSource) -> Section:
    """Return the conditions of the test as the records show them; one that no run shows has no row.

    The temperatures always have one, with the reason where none was recorded: environmental conditions are
    asked for (ISO/IEC 17025, 7.8.3.1 a).
    """
    seen = (
        *(_temperature(source, role, words) for role, words in _ROLES),
        *(_required(source, *what) for what in _READ),
        _speed(source),
        _between_runs(source),
    )
    recorded = Table(
        said("Conditions as recorded"),
        (
            Column(said("Condition")),
            Column(said("From … to")),
            Column(said("Unit")),
            Column(said("Seen in")),
        ),
        tuple(row for row in seen if row is not None),
    )
    return Section("conditions", said("Conditions of the test"), (recorded, stand_sheet(source)))


_Row = tuple[Cell, ...] | None
"""A row of the table; None where no run shows the condition."""


def _row(words: str, shown: Cell, unit: str, runs: Iterable[int]) -> _Row:
    return Cell(words), shown, Cell(unit), Cell(runs_text(runs))


def _temperature(source: ReportSource, role: str, words: str) -> tuple[Cell, ...]:
    values, numbers = [], []
    for run in source.runs:
        sensors = run.record.temperatures if run.record is not None else ()
        readings = [s.temperature_C for s in sensors if s.role == role]
        finite = [one[np.isfinite(one)] for one in readings]
        if any(one.size for one in finite):
            numbers.append(run.number)
            values += [float(end(one)) for one in finite if one.size for end in (np.min, np.max)]
    if values:
        return Cell(words), _span(values, 1), Cell("°C"), Cell(runs_text(numbers))
    none = Cell(DASH, "missing", said("no sensor of this kind was recorded"))
    return Cell(words), none, Cell("°C"), none


def _span(values: Sequence[float], decimals: int) -> Cell:
    low, high = fixed(min(values), decimals), fixed(max(values), decimals)
    return Cell(low if low == high else said("{low} … {high}", low=low, high=high), "number")


def _required(
    source: ReportSource, identifier: str, words: str, unit: str, worst: Callable[[Sequence[float]], float]
) -> _Row:
    found = [
        (run.number, value)
        for run in source.runs
        for requirement in (() if run.stated else run.requirements)
        if requirement["id"] == identifier and (value := usable(requirement.get("measured"))) is not None
    ]
    if not found:
        return None
    shown = Cell(significant(worst([value for _, value in found])), "number")
    return _row(words, shown, unit, dict.fromkeys(number for number, _ in found))


def _speed(source: ReportSource) -> _Row:
    speeds = {
        run.number: value
        for run in source.runs
        if run.kind == "harmonic" and (value := _greatest_speed(run)) is not None
    }
    words = said("Greatest speed of harmonic runs")
    return _row(words, _span(list(speeds.values()), 1), "mm/s", speeds) if speeds else None


def _greatest_speed(run: ReportRun) -> float | None:
    """Return the greatest speed of all samples; of the cycles where the document has no extremes."""
    if (extreme := run.extreme("speed_max_mm_per_s")) is not None:
        return extreme.value
    return max((value for cycle in run.cycles for value in _speeds(cycle)), default=None)


def _speeds(cycle: Mapping[str, Any]) -> list[float]:
    names = ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s")
    return [value for name in names if (value := usable(cycle.get(name))) is not None]


def _between_runs(source: ReportSource) -> _Row:
    words = said("Longest pause between runs")
    # Between runs of two specimens there is no pause of either.
    pairs = [
        (one, two)
        for one, two in zip(source.runs, source.runs[1:], strict=False)
        if one.fact("specimen", "id") == two.fact("specimen", "id")
    ]
    pauses = [pause for one, two in pairs if (pause := _pause_s(one, two)) is not None]
    # Runs of a stand that is simulated faster than real time overlap on the clock on the wall.
    if not pauses or (longest := max(pauses)) < 0.0:
        return None
    value, unit = _in_unit(longest)
    return _row(words, Cell(fixed(value, 1), "number"), unit, [run.number for run in source.runs])


def _in_unit(duration_s: float) -> tuple[float, str]:
    """Return a duration in the unit in which it is a number of at most three digits, up to weeks."""
    if duration_s < _MOST_OF_A_UNIT:
        return duration_s, "s"
    minutes = duration_s / 60.0
    return (minutes, "min") if minutes < _MOST_OF_A_UNIT else (minutes / 60.0, "h")


def _pause_s(one: ReportRun, two: ReportRun) -> float | None:
    if one.ended is None or two.started is None or (one.ended.tzinfo is None) != (two.started.tzinfo is None):
        return None
    return (two.started - one.ended).total_seconds()
