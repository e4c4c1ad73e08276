"""The closing sections: deviations, stops, warnings, decision rule, raw data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.facts import expected_turns, held_against
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Sheet,
    Table,
    Texts,
    fixed,
    significant,
)
from bufferstand.evaluation.report.sections.attention import (
    beyond_limits,
    missed_targets,
    near_conditions,
)
from bufferstand.evaluation.report.sections.identity import calibrations, overdue
from bufferstand.evaluation.report.sections.verdicts import grouped_points, is_condition
from bufferstand.evaluation.report.source import (
    EVALUATION_NAME,
    ReportRun,
    ReportSource,
    evaluation_hash,
    purpose_warnings,
    runs_text,
)
from bufferstand.evaluation.wording import capital, numeral, said, status_words

DOUBTED = "doubted"
"""Kind of a run's event that tells what ended an earlier start of its campaign, which recorded nothing."""
_RULES = {
    "simple": (
        said(
            "Simple acceptance (ILAC-G8:09/2019, w = 0): a result passes if it lies within its limits, "
            "whatever its uncertainty. The risk of a false acceptance is at most 50 % for a value "
            "exactly on a limit; the conformance probability beside each result says how likely the true "
            "value conforms."
        )
    ),
    "guard-band": (
        said(
            "Guard band (ILAC-G8:09/2019, w = U): a result passes or fails only if it lies at least its "
            "expanded uncertainty inside or outside its limits, with a risk of a false acceptance of at "
            "most 2.5 %; between, the verdict is a conditional pass or a conditional fail."
        )
    ),
}


_TOLERANCES = (
    ("prestress_mm", said("mean stroke"), "mm", 5.0, 0.1),
    ("amplitude_mm", said("amplitude"), "mm", 1.0, 0.1),
    ("frequency_Hz", said("frequency"), "Hz", 0.0, 0.05),
)
"""How far a harmonic run may be from its step before the report says so: absolute, or relative if larger."""
_APPLIES = said(
    "It applies to every statement of conformity in this report; to which runs and cycles each "
    "of them refers stands beside it."
)
_ATTACHED = said(
    "the evaluation of these runs, inside the PDF: hash of what it found, without paths and versions"
)
_UNKNOWN_RULE = said("The evaluation document does not state by which decision rule its verdicts were given.")
_UNCERTAINTY = said(
    "Uncertainties are expanded uncertainties U = k u with coverage factor k = 2 (about 95 % "
    "coverage), in the unit of the measured value. Where the record states no accuracy of its "
    "channels, none is given."
)


def deviations_section(source: ReportSource) -> Section:
    """Return what deviates from the method, and the runs that ended early with their reasons."""
    items = [*source.fields.deviations, *_derived_deviations(source)]
    blocks: list[Texts | Table] = [Texts(tuple(dict.fromkeys(items)) or (said("None."),), listed=True)]
    early = [run for run in source.runs if run.status in {"stopped", "failed", "recovered"}]
    if early:
        blocks.append(
            Table(
                said("Runs that ended early"),
                (
                    Column(said("Run")),
                    Column(said("Run id")),
                    Column(said("Ended")),
                    Column(said("Reason")),
                    Column(said("Last event")),
                ),
                tuple(_early(run) for run in early),
                note=said("Everything recorded up to that moment is kept and evaluated."),
            )
        )
    return Section("deviations", said("Deviations and stopped runs"), tuple(blocks))


def _early(run: ReportRun) -> tuple[Cell, ...]:
    reason = str(run.metadata["run"].get("reason") or "")
    last = next((event for event in reversed(run.events) if not reason or reason not in event[2]), None)
    event = Cell(DASH, "missing", said("no event but the reason on record"))
    if last is not None:
        at_s, _, text = last
        event = Cell(text if at_s is None else said("{at_s} s: {text}", at_s=fixed(at_s, 1), text=text))
    return (
        Cell(str(run.number), "number"),
        Cell(run.id, "code"),
        Cell(status_words(run.status), "text" if run.status == "recovered" else "bad"),
        Cell(reason) if reason else Cell(DASH, "missing", said("no reason recorded")),
        event,
    )


def targets_section(source: ReportSource) -> Section | None:
    """Return what was asked, commanded and reached in each run; None where no run says it."""
    tables = tuple(table for table in (_strokes(source), _forces(source)) if table is not None)
    return Section("targets", said("Strokes and forces reached"), tables, annex=True) if tables else None


def _pair(row: Mapping[str, Any], what: str) -> str:
    """Return a mean ± an amplitude, or the stroke at which a slow motion turns [mm]."""
    mean, amplitude = row[f"{what}_mean_mm"], row[f"{what}_amplitude_mm"]
    return (
        fixed(mean, 2)
        if amplitude is None
        else said("{mean} ± {amplitude}", mean=fixed(mean, 2), amplitude=fixed(amplitude, 2))
    )


def _not_reached(run: ReportRun, row: Mapping[str, Any]) -> str:
    made, asked = _pair(row, "reached"), _pair(row, "asked")
    return said(
        "Run {number}: the stroke that was asked for was not reached: {made} mm in place of {asked} mm.",
        number=run.number,
        made=made,
        asked=asked,
    )


def _strokes(source: ReportSource) -> Table | None:
    """Return what was asked, commanded and reached in each run that says so; None if none does."""
    rows = []
    for run in source.runs:
        for row in run.strokes:
            whose = said("specimen") if row["compensated"] else said("piston")
            rows.append(
                (
                    Cell(str(run.number), "number"),
                    Cell(said("{row} ({whose})", row=_pair(row, "asked"), whose=whose)),
                    Cell(_pair(row, "last_commanded")),
                    Cell(_pair(row, "reached")),
                    _off(run, row),
                )
            )
    heads = (
        (said("Run"), ""),
        (said("Asked"), "mm"),
        (said("Commanded"), "mm"),
        (said("Reached"), "mm"),
        (said("Off"), ""),
    )
    note = said(
        "Mean ± amplitude of a sine, or the stroke at which a slow one turns: of the piston as "
        "commanded last, of the specimen as it was reached in the last full cycle. Cycles that are "
        "named were off by more than the campaign states. Where the piston’s stroke was asked for, "
        "what the plan expected of the specimen stands in place of a deviation."
    )
    columns = tuple(Column(head, unit) for head, unit in heads)
    return (
        Table(said("Strokes asked, commanded and reached"), columns, tuple(rows), note=note) if rows else None
    )


def _signed(value: float) -> str:
    text = fixed(value, 2)
    return numeral(f"+{text}") if value > 0.0 and float(text) != 0.0 else text


def _off(run: ReportRun, row: Mapping[str, Any]) -> Cell:
    """Return by how much a motion missed what was asked of the specimen, or what was expected of it."""
    if row["by_force"]:
        return Cell(said("turned at its force limit"))
    if row["compensated"]:
        percent = row["off_percent"]
        share = "" if percent is None else said("; amplitude {percent} %", percent=_signed(percent))
        cycles = (
            said("; cycles {cycles_off} of {cycles}", cycles_off=row["cycles_off"], cycles=row["cycles"])
            if row.get("cycles_off")
            else ""
        )
        return Cell(
            said("{off_mm} mm{share}{cycles}", off_mm=_signed(row["off_mm"]), share=share, cycles=cycles)
        )
    expected = expected_turns(run.fact("step") or {}, row["motion"])
    if expected is None:
        return Cell(DASH, "missing", said("what the plan expected of the specimen is not on record"))
    if row["reached_amplitude_mm"] is None:
        return Cell(said("expected {upper_mm}", upper_mm=fixed(expected.upper_mm, 2)))
    return Cell(
        said(
            "expected {mean_mm} ± {amplitude_mm}",
            mean_mm=fixed(expected.mean_mm, 2),
            amplitude_mm=fixed(expected.amplitude_mm, 2),
        )
    )


def _forces(source: ReportSource) -> Table | None:
    """Return what was asked and reached in each run between two forces; None if there is none."""
    rows = []
    for run in source.runs:
        for row in run.forces:
            off = said("none of {cycles} cycles", cycles=row["cycles"])
            if row["cycles_off"]:
                off = said(
                    "cycles {cycles_off} of {cycles}", cycles_off=row["cycles_off"], cycles=row["cycles"]
                )
            if row["stroke_limit_mm"] is not None:
                off += said(
                    "; the stroke limit of {stroke_limit_mm} mm came first",
                    stroke_limit_mm=numeral(f"{row['stroke_limit_mm']:g}"),
                )
            rows.append(
                (
                    Cell(str(run.number), "number"),
                    Cell(
                        said(
                            "{asked_min_kn} … {asked_max_kn}",
                            asked_min_kn=numeral(f"{row['asked_min_kN']:g}"),
                            asked_max_kn=numeral(f"{row['asked_max_kN']:g}"),
                        )
                    ),
                    Cell(
                        said(
                            "{reached_min_kn} … {reached_max_kn}",
                            reached_min_kn=fixed(row["reached_min_kN"], 1),
                            reached_max_kn=fixed(row["reached_max_kN"], 1),
                        )
                    ),
                    Cell(significant(row["tolerance_kN"], 3)),
                    Cell(off, "bad" if row["cycles_off"] else "text"),
                )
            )
    heads = (
        (said("Run"), ""),
        (said("Asked"), "kN"),
        (said("Reached"), "kN"),
        (said("Tolerance"), "kN"),
        (said("Off"), ""),
    )
    note = said(
        "Reached in the last cycle. Cycles that are named turned further from a force than the tolerance."
    )
    columns = tuple(Column(head, unit) for head, unit in heads)
    return Table(said("Forces asked and reached"), columns, tuple(rows), note=note) if rows else None


def _derived_deviations(source: ReportSource) -> list[str]:
    items = []
    limited: dict[tuple[float, str], list[int]] = {}
    for run in source.runs:
        limit, by = run.limit("force_max_kN")
        short = any(r["id"] == "full-stroke" and r["verdict"] == "inconclusive" for r in run.stated)
        if limit is not None and short:
            limited.setdefault((limit, by), []).append(run.number)
        broken = [row for row in run.stated if is_condition(row) and row["verdict"] == "fail"]
        items += [
            said("Run {number}: condition broken: {point}.", number=run.number, point=point)
            for point in grouped_points(broken)
        ]
    items += [
        said(
            "Force limited to {limit} kN by {by} ({runs}): full stroke was not reached.",
            limit=numeral(f"{limit:g}"),
            by=by,
            runs=runs_text(numbers),
        )
        for (limit, by), numbers in limited.items()
    ]
    items += [_not_reached(run, row) for run in source.runs for row in run.strokes if row.get("not_reached")]
    items += [
        said("Run {number}: {text}.", number=run.number, text=finding["text"])
        for run in source.runs
        for finding in run.evaluated.get("plausibility") or ()
        if finding["kind"] == "guard"
    ]
    items += [
        said("{text}.", text=capital(text))  # each run that came after tells it in the same words
        for run in source.runs
        for _, kind, text in run.events
        if kind == DOUBTED
    ]
    items += [
        said("Results of external providers: {text}", text=text) for text in source.fields.external_results
    ]
    imported = [run.number for run in source.runs if run.status == "imported"]
    if imported:
        items.append(
            said(
                "Imported from foreign records, not measured by this software: {runs}. Results of external "
                "providers.",
                runs=runs_text(imported),
            )
        )
    return items


def warnings_section(source: ReportSource) -> Section | None:
    """Return every warning once with the runs that it concerns, or None if there is none.

    What was planned, or is said with a requirement (``notes`` of the document), is no warning of a report.
    """
    of: dict[str, list[int]] = {}
    for run in source.runs:
        for warning in ([run.problem] if run.problem else []) + run.attention:
            of.setdefault(warning, []).append(run.number)
    further = [*purpose_warnings(source), *overdue(calibrations(source)), *beyond_limits(source)]
    for run in source.runs:
        further += [*not_as_required(run), *missed_targets(run)]
    further += near_conditions(source)
    items = [
        *source.findings,
        *further,
        *(_of_runs(text, numbers) for text, numbers in of.items()),
    ]
    return Section("warnings", said("Warnings"), (Texts(tuple(items), listed=True),)) if items else None


def _of_runs(text: str, numbers: Sequence[int]) -> str:
    """Return a warning with the runs that it is of, as a sentence."""
    named = capital(runs_text(numbers))
    if text.endswith("."):
        return said("{runs}: {text}", runs=named, text=text)
    return said("{runs}: {text}.", runs=named, text=text)


def not_as_required(run: ReportRun) -> list[str]:
    """Say where a harmonic run is not the step that it was recorded for."""
    texts = []
    for name, words, unit, absolute, relative in _TOLERANCES:
        required, measured = held_against(run.fact("step") or {}, name), run.result(name)
        if run.kind != "harmonic" or required is None or measured is None:
            continue
        if abs(measured - required.value) <= max(absolute, relative * abs(required.value)):
            continue
        value = said("{value} {unit}", value=significant(required.value, 3), unit=unit)
        what = said("the required {value} of the step", value=value)
        if required.of_piston is not None:
            of_piston = said("{of_piston} {unit}", of_piston=significant(required.of_piston, 3), unit=unit)
            what = said(
                "the {value} that the plan expected of the specimen for {of_piston} of the piston",
                value=value,
                of_piston=of_piston,
            )
        texts.append(
            said(
                "Run {number}: {words} {measured} {unit} is not {what}.",
                number=run.number,
                words=words,
                measured=significant(measured, 3),
                unit=unit,
                what=what,
            )
        )
    return texts


def rule_section(source: ReportSource) -> Section:
    """Return the decision rule with its risk, and how uncertainties are stated."""
    by = source.fields.decision_rule_set_by
    items = [
        _RULES.get(str(source.decision_rule), _UNKNOWN_RULE),
        *((said("The rule was set by: {by}.", by=by),) if by else ()),
        _APPLIES,
        _UNCERTAINTY,
        said("A result that is missing, not reached or not shown by the record is never counted as passed."),
    ]
    return Section("decision-rule", said("Decision rule and uncertainty"), (Texts(tuple(items)),))


def opinions_section(source: ReportSource) -> Section | None:
    """Return opinions and interpretations, kept apart from the results; None if there are none."""
    if not source.fields.opinions:
        return None
    apart = said("These are not results of the tests; who authorised the report answers for them.")
    return Section(
        "opinions",
        said("Opinions and interpretations"),
        (Texts(source.fields.opinions, listed=True), Texts((apart,))),
    )


def data_section(source: ReportSource, evaluations: Mapping[str, Mapping[str, Any]] | None = None) -> Section:
    """Return the raw data files and the evaluation with their hashes, and what the customer supplied.

    Parameters
    ----------
    source : ReportSource
        Runs, their evaluation, and what the laboratory adds.
    evaluations : mapping of str to mapping, optional
        The evaluations that the PDF has inside, by the name of the file; None: that of ``source``.
    """
    if evaluations is None:
        evaluations = {EVALUATION_NAME: source.evaluation}
    runs = [
        (Cell(str(run.number), "number"), Cell(run.file, "code"), Cell(run.sha256, "code"))
        for run in source.runs
    ]
    attached = [
        (Cell(DASH, "missing", _ATTACHED), Cell(name, "code"), Cell(evaluation_hash(found), "code"))
        for name, found in evaluations.items()
    ]
    table = Table(
        said("Raw data"),
        (Column(said("Run")), Column(said("File")), Column("SHA-256")),
        (*runs, *attached),
        note=said(
            "“bufferstand verify” on these files and on the PDF shows whether they are whole and unaltered."
        ),
    )
    originals = tuple(
        (
            said("Run {number}", number=run.number),
            Cell(
                said(
                    "{what}, SHA-256 {what_2}",
                    what=run.fact("original", "file"),
                    what_2=run.fact("original", "sha256"),
                )
            ),
        )
        for run in source.runs
        if run.fact("original", "file")
    )
    blocks: list[Table | Sheet | Texts] = [table]
    if originals:
        blocks.append(Sheet(said("Original files of imported runs"), originals))
    if source.fields.customer_supplied:
        blocks.append(Texts((said("Supplied by the customer, and not the laboratory’s responsibility:"),)))
        blocks.append(Texts(source.fields.customer_supplied, listed=True))
    return Section("data", said("Raw data"), tuple(blocks), annex=True)


def remarks_section(source: ReportSource) -> Section | None:
    """Return the laboratory's remarks; None if there are none."""
    remarks = source.fields.remarks
    return Section("remarks", said("Remarks"), (Texts(remarks),)) if remarks else None
