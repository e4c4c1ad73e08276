"""Specimens side by side: the same quantities of the same steps, and their differences with U."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.across_runs import Difference, UncertainValue, difference, equivalences
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import SharedContributions, shared_of
from bufferstand.evaluation.figures import LoopCurve
from bufferstand.evaluation.report.content import (
    DASH,
    Block,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    fixed,
    measured_cell,
    to_digits,
    usable,
)
from bufferstand.evaluation.report.sections.conformity import conformity_section
from bufferstand.evaluation.report.sections.references import draft_texts
from bufferstand.evaluation.report.sections.unmatched import unmatched_table
from bufferstand.evaluation.report.sections.verdicts import name_of, run_verdict_cell
from bufferstand.evaluation.report.source import (
    ComparedSpecimens,
    Condition,
    ReportRun,
    at_strokes,
    conditions_of,
    loop_of,
    purpose_texts,
    runs_text,
)
from bufferstand.evaluation.wording import joined, label, numeral, said

_COMPARED = QUANTITIES.that(lambda entry: entry.shown.compared)
_TO_COMMON_STROKE = ("stored_energy_J", "absorbed_energy_J", "damping")
"""As :func:`_energies` returns them."""
_SAME_END_MM = 0.5
"""Loops whose ends are further apart are compared to the stroke that both reach, too."""
_APART_K = 2.0
_GRID = 400
_RESOLVED = 1e-6
"""Share of a value below which differences of specimens are not resolved."""
_METHOD = said(
    "The first is the reference. Steps are the same if prestress agrees within 2 mm, amplitude "
    "and frequency within 5 %, the speed of static runs within 10 %. Errors that both have in "
    "common, as their records name the same certificate, cancel in a difference as far as they "
    "act alike; U has what is left. E_n is the difference over its U (k = 2): beyond ±1 the "
    "specimens differ by more than is known of them. It says nothing of conformity; see the "
    "statements of each specimen."
)
_NO_STEP_SHARED = said("No step was run on more than one of them: nothing can be compared.")
_NOTHING_COMPARED = said("The steps that they share have no result in common: nothing can be compared.")
_NO_U = said("the record of one of them states no accuracy")
_NOT_RUN = said("this step was not run on it")
_NOT_HAD = said("not to be had from the run")


@dataclass(frozen=True)
class ComparedFigures:
    """One quantity of one step: the value of each side (None: it has none)."""

    condition: Condition
    name: str
    words: str
    unit: str
    values: tuple[UncertainValue | None, ...]

    def differences(self) -> Iterator[tuple[int, Difference]]:
        """Yield each further side's place and its difference to the first, where both have a value."""
        reference = self.values[0]
        for place, value in enumerate(self.values[1:], start=1):
            if reference is not None and value is not None:
                yield place, difference(value, reference)


def compared_of(conditions: Sequence[Condition]) -> list[ComparedFigures]:
    """Return every quantity of every shared step that two sides or more have a value of."""
    found = []
    for condition in conditions:
        rows = [
            ComparedFigures(
                condition,
                entry.name,
                label(str(entry.shown.compared)),
                entry.printed_unit,
                tuple(_summary_value(run, entry.name) for run in condition.runs),
            )
            for entry in _COMPARED
        ]
        rows.insert(0, _greatest_force(condition))
        rows += _to_common_stroke(condition)
        rows += _windows(condition)
        found += [row for row in rows if sum(value is not None for value in row.values) > 1]
    return found


def _greatest_force(condition: Condition) -> ComparedFigures:
    """Return the greatest force of all samples of each side."""
    found = [None if run is None else run.extreme("force_max_kN") for run in condition.runs]
    values = tuple(
        None if one is None or one.value is None else UncertainValue(one.value, one.expanded_uncertainty)
        for one in found
    )
    return ComparedFigures(condition, "extreme_force_max_kN", said("Force max. of all samples"), "kN", values)


def _summary_value(run: ReportRun | None, name: str) -> UncertainValue | None:
    if run is None or (value := run.result(name)) is None:
        return None
    entry = run.summary.get(name)
    expanded = usable(entry.get("expanded_uncertainty")) if isinstance(entry, dict) else None
    return UncertainValue(value, expanded, _shared(run, name))


def _shared(run: ReportRun, name: str) -> SharedContributions:
    """Return what of a figure's uncertainty other runs have, too; nothing where it is not stated."""
    try:
        shared = shared_of(run.evaluated.get("shared_errors"))
    except ValueError:
        return SharedContributions()
    return SharedContributions() if shared is None else shared.of(name)


def _windows(condition: Condition) -> list[ComparedFigures]:
    """Return the forces at the strokes where the limit set reads them, each the mean over the cycles.

    U of a mean is taken as the greatest U of a cycle: its larger part is common to all cycles.
    """
    names: dict[str, str] = {}
    for run in condition.runs:
        for requirement in run.requirements if run is not None else ():
            if usable(requirement.get("stroke_mm")) is not None:
                names[str(requirement["id"])] = name_of(requirement)
    return [
        ComparedFigures(condition, name, words, "kN", tuple(_window(run, name) for run in condition.runs))
        for name, words in names.items()
    ]


def _window(run: ReportRun | None, name: str) -> UncertainValue | None:
    rows = [r for r in (run.requirements if run is not None else ()) if r["id"] == name]
    values = [value for r in rows if (value := usable(r.get("measured"))) is not None]
    if not values:
        return None
    expanded = [u for r in rows if (u := usable(r.get("expanded_uncertainty"))) is not None]
    mean = sum(values) / len(values)
    if run is None or len(expanded) < len(values):
        return UncertainValue(mean)
    return UncertainValue(mean, max(expanded), _shared(run, name))


def _to_common_stroke(condition: Condition) -> list[ComparedFigures]:
    """Return energies and damping up to the stroke that all loops reach, where they end apart."""
    if any(run is not None and run.kind == "harmonic" for run in condition.runs):
        return []
    loops = [None if run is None else shown_loop(run) for run in condition.runs]
    ends = [float(np.nanmax(loop.stroke_mm)) for loop in loops if loop is not None]
    if len(ends) < 2 or max(ends) - min(ends) <= _SAME_END_MM:
        return []
    end = min(ends)
    energies = [None if loop is None else _energies(loop, end) for loop in loops]
    rows = []
    for place, name in enumerate(_TO_COMMON_STROKE):
        entry = QUANTITIES.named(name)
        values = tuple(
            None if run is None or got is None else _like(run, name, got[place])
            for run, got in zip(condition.runs, energies, strict=True)
        )
        words = said("{compared} to {end} mm", compared=label(entry.shown.compared or ""), end=fixed(end, 1))
        rows.append(
            ComparedFigures(
                condition,
                f"{name}@{end:.1f}",
                words,
                entry.printed_unit,
                values,
            )
        )
    return rows


def shown_loop(run: ReportRun) -> LoopCurve | None:
    """Return the loop of the cycle that stands for a run."""
    cycle = run.shown_cycle()
    return None if cycle is None else loop_of(run, cycle)


def _energies(loop: LoopCurve, end_mm: float) -> tuple[float, float, float] | None:
    """Return stored and absorbed energy [J] and damping of a loop cut at a stroke."""
    start = max(0.0, float(np.nanmin(loop.stroke_mm)))
    strokes = np.linspace(start + 0.2, end_mm - 0.05, _GRID)
    pairs = at_strokes(loop, [float(x) for x in strokes])
    forces = np.array([[np.nan if f is None else f for f in pair] for pair in pairs])
    if np.isnan(forces).any():
        return None
    stored, returned = (float(np.trapezoid(forces[:, n], strokes)) for n in (0, 1))
    return (stored, stored - returned, (stored - returned) / stored) if stored > 0.0 else None


def _like(run: ReportRun, name: str, value: float) -> UncertainValue:
    """Return a value with the relative uncertainty that the run states for the whole loop."""
    whole = _summary_value(run, name)
    if whole is None or whole.expanded_uncertainty is None or not whole.value:
        return UncertainValue(value)
    scale = value / whole.value
    return UncertainValue(value, abs(scale) * whole.expanded_uncertainty, whole.shared.scaled(scale))


def comparison_sections(sides: ComparedSpecimens, compared: Sequence[ComparedFigures]) -> list[Section]:
    """Return the tables of the comparison: what is compared, the differences, and what has no counterpart."""
    shared = conditions_of(sides)
    conditions = list({row.condition.number: row.condition for row in compared}.values())
    blocks: list[Block] = [_steps(sides, conditions), Texts((_METHOD,))]
    blocks += [
        _differences(sides, [row for row in compared if row.condition is condition])
        for condition in conditions
    ]
    if len(sides.sides) > 2:
        blocks.append(_spread(sides, compared))
    if not conditions:
        blocks = [Texts((_NOTHING_COMPARED if shared else _NO_STEP_SHARED,))]
    notes = [*_temperature_notes(conditions), *_without_values(shared, conditions)]
    if notes:
        blocks.append(Texts(tuple(notes), listed=True))
    if (left := unmatched_table(sides, shared)) is not None:
        blocks.append(left)
    return [Section("comparison", said("Comparison"), tuple(blocks)), *_conformities(sides)]


def _steps(sides: ComparedSpecimens, conditions: Sequence[Condition]) -> Table:
    return Table(
        said("Subject of the comparison"),
        (
            Column(said("No.")),
            Column(said("Step")),
            *(Column(said("{letter}: run", letter=side.letter)) for side in sides.sides),
            *(Column(said("{letter}: temperature", letter=side.letter), "°C") for side in sides.sides),
        ),
        tuple(
            (
                Cell(str(condition.number), "number"),
                Cell(condition.words),
                *(
                    Cell(DASH, "missing", _NOT_RUN) if run is None else Cell(run.label, "number")
                    for run in condition.runs
                ),
                *(_temperature_cell(run) for run in condition.runs),
            )
            for condition in conditions
        ),
        note=joined(
            "; ", (said("{letter}: {name}", letter=side.letter, name=side.name) for side in sides.sides)
        )
        + said(". Temperature of the specimen at the start of the first cycle used."),
    )


def start_C(run: ReportRun | None) -> float | None:  # noqa: N802 - the unit's own letter
    """Return the specimen's temperature at the start of the first cycle used, or None."""
    used = run.cycles_used if run is not None else []
    first = next((c for c in (run.cycles if run is not None else ()) if c["index"] in used), None)
    return None if first is None else usable((first.get("temperature_C") or {}).get("start"))


def _temperature_cell(run: ReportRun | None) -> Cell:
    if run is None:
        return Cell(DASH, "missing", _NOT_RUN)
    value = start_C(run)
    return (
        Cell(DASH, "missing", said("no temperature on record"))
        if value is None
        else Cell(fixed(value, 1), "number")
    )


def _differences(sides: ComparedSpecimens, rows: Sequence[ComparedFigures]) -> Table:
    condition = rows[0].condition
    cells = []
    for row in rows:
        for place, apart in row.differences():
            cells.append(_difference_row(sides, row, place, apart))
    return Table(
        said("Step {number}: {words}", number=condition.number, words=condition.words),
        (
            Column(said("Quantity")),
            Column(said("Unit")),
            Column(said("Of")),
            Column(said("{letter} ± U", letter=sides.sides[0].letter)),
            Column(said("This ± U")),
            Column(said("Difference ± U")),
            Column(said("Change"), "%"),
            Column("E_n"),
            Column(said("Difference is")),
        ),
        tuple(cells),
        concludes=True,
    )


def _difference_row(
    sides: ComparedSpecimens, row: ComparedFigures, place: int, apart: Difference
) -> tuple[Cell, ...]:
    reference, value = row.values[0], row.values[place]
    assert reference is not None
    assert value is not None
    share = usable(apart.relative)
    return (
        Cell(row.words),
        Cell(row.unit),
        Cell(sides.sides[place].letter),
        measured_cell(reference.value, reference.expanded_uncertainty, _NOT_HAD),
        measured_cell(value.value, value.expanded_uncertainty, _NOT_HAD),
        measured_cell(apart.value, apart.expanded_uncertainty, _NOT_HAD),
        Cell(DASH, "missing", said("the reference is 0"))
        if share is None
        else Cell(_percent(share), "number"),
        Cell(DASH, "missing", _NO_U)
        if apart.normalised is None
        else Cell(_signed(apart.normalised, 1), "number"),
        {
            None: Cell(DASH, "missing", _NO_U),
            True: Cell(said("◆ beyond U"), "open"),
            False: Cell(said("within U")),
        }[apart.beyond],
    )


def _signed(value: float, decimals: int) -> str:
    text = fixed(value, decimals)
    return numeral(f"+{text}") if value > 0.0 and float(text) != 0.0 else text


def _percent(share: float) -> str:
    return _signed(100.0 * share, 1)


def _spread(sides: ComparedSpecimens, compared: Sequence[ComparedFigures]) -> Table:
    """Return mean, standard deviation and each one's degree of equivalence, where all have a value."""
    rows = []
    for row in compared:
        values = [value for value in row.values if value is not None]
        if len(values) < len(row.values):
            continue
        mean, degrees = equivalences(values)
        scatter = _scatter([value.value for value in values])
        rows.append(
            (
                Cell(str(row.condition.number), "number"),
                Cell(row.words),
                Cell(row.unit),
                Cell(to_digits(mean, 4), "number"),
                Cell(to_digits(scatter, 2), "number"),
                Cell(DASH, "missing", said("the mean is 0"))
                if not mean
                else Cell(fixed(100.0 * scatter / abs(mean), 1), "number"),
                *(measured_cell(one.deviation, one.expanded_uncertainty, _NOT_HAD) for one in degrees),
            )
        )
    return Table(
        said("Spread among the specimens, and degrees of equivalence"),
        (
            Column(said("Step")),
            Column(said("Quantity")),
            Column(said("Unit")),
            Column(said("Mean")),
            Column(said("Std. dev.")),
            Column(said("Std. dev."), "%"),
            *(Column(said("{letter} − mean ± U", letter=side.letter)) for side in sides.sides),
        ),
        tuple(rows),
        note=said(
            "Std. dev.: standard deviation of the specimens, also in % of the mean. The mean holds each of "
            "them, which the uncertainty of a deviation from it takes into account."
        ),
    )


def _scatter(values: Sequence[float]) -> float:
    """Return the standard deviation of the specimens; 0 where it is no more than the rounding of a mean.

    No channel tells a millionth: what is below is what summing leaves of equal values.
    """
    scatter = float(np.std(values, ddof=1))
    return scatter if scatter > _RESOLVED * max(map(abs, values)) else 0.0


def _temperature_notes(conditions: Sequence[Condition]) -> list[str]:
    notes = []
    for condition in conditions:
        known = [value for run in condition.runs if (value := start_C(run)) is not None]
        if len(known) > 1 and max(known) - min(known) > _APART_K:
            notes.append(
                said(
                    "Step {number}: the specimens were {apart} K apart; the differences hold the effect of "
                    "that.",
                    number=condition.number,
                    apart=fixed(max(known) - min(known), 1),
                )
            )
    return notes


def _without_values(all_conditions: Sequence[Condition], compared: Sequence[Condition]) -> list[str]:
    """Return a sentence for each step that two or more have run without a result that both have."""
    notes = []
    for condition in all_conditions:
        if condition.number not in {one.number for one in compared}:
            runs = [run for run in condition.runs if run is not None]
            lacking = {run.number for run in runs if not run.cycles_used}
            why = (
                said(": {runs} without a cycle that could be used", runs=runs_text(lacking))
                if lacking
                else ""
            )
            named = runs_text({run.number for run in runs})
            notes.append(
                said(
                    "Step {number} ({words}): {runs} have no result in common{why}.",
                    number=condition.number,
                    words=condition.words,
                    runs=named,
                    why=why,
                )
            )
    return notes


def _conformities(sides: ComparedSpecimens) -> list[Section]:
    """Return the statements of conformity of each, each under its letter."""
    blocks: list[Block] = []
    for side in sides.sides:
        section = conformity_section(side.source)
        blocks += [
            replace(
                block,
                title=said(
                    "{letter}, {name}: {title}", letter=side.letter, name=side.name, title=block.title
                ),
            )
            for block in (section.blocks if section is not None else ())
            if isinstance(block, Table)
        ]
    drafts = draft_texts(r for side in sides.sides for run in side.source.runs for r in run.stated)
    verdicts = [
        (side, run) for side in sides.sides for run in side.source.runs if run.evaluated.get("verdict")
    ]
    if not verdicts:
        return []
    table = Table(
        said("Verdicts"),
        (
            Column(said("Of")),
            Column(said("Specimen")),
            Column(said("Run")),
            Column(said("Run id")),
            Column(said("Verdict")),
        ),
        tuple(
            (
                Cell(side.letter),
                Cell(side.name),
                Cell(str(run.number), "number"),
                Cell(run.id, "code"),
                run_verdict_cell(run),
            )
            for side, run in verdicts
        ),
    )
    tests = [
        said("{letter}: {text}", letter=side.letter, text=text)
        for side in sides.sides
        for text in purpose_texts(side.source)
    ]
    told = (*drafts, *tests)
    return [
        Section(
            "conformity",
            said("Statement of conformity by clause"),
            (*([Texts(told, listed=True)] if told else ()), table, *blocks),
        )
    ]
