"""Who, what, where and when: the identification that ISO/IEC 17025, 7.8.2.1, asks for."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import date

from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Sheet,
    Table,
    Tone,
    day_text,
    fixed,
    moment_text,
    significant,
    usable,
)
from bufferstand.evaluation.report.source import (
    NOT_RECORDED,
    ReportRun,
    ReportSource,
    numbers_text,
    runs_text,
)
from bufferstand.evaluation.wording import day, joined, numeral, said, span, specimen_words
from bufferstand.foundation import NO_TEMPERATURE_STOP

_NOT_USED = said("not used (simulated)")
"""Instead of whether a calibration was valid on the day: it is the stand file's, and nobody used it."""
_HASH = re.compile(r" sha256 ([0-9a-f]{12})[0-9a-f]{52}\b")
_IDENTITY = ("device", "serial", "firmware", "profile")
_TO_BE_GIVEN = said("not given: add it to report.toml beside the runs")
_SIMULATED = said(" (simulated)")
_MOST_BESIDE = 4
"""Specimens whose facts stand side by side; of more, one below the other."""
_SPECIMEN = (
    (said("Identification"), "id"),
    (said("Kind"), "kind"),
    (said("Category"), "category"),
    (said("Elastic system"), "elastic_system"),
    (said("Full stroke [mm]"), "max_stroke_mm"),
    (said("Assembled"), "assembled"),
    (said("Maker"), "maker"),
    (said("Serial number"), "serial"),
    (said("Year"), "year"),
    (said("Description"), "description"),
)


def given(text: object, why: str = _TO_BE_GIVEN) -> Cell:
    """Return a fact as a cell, or a dash with the reason."""
    shown = day(text) if isinstance(text, date) else str(text or "")
    return Cell(shown) if shown else Cell(DASH, "missing", why)


def laboratory(source: ReportSource) -> str:
    """Return the laboratory's name from ``report.toml``, else from the runs, else nothing."""
    return source.fields.laboratory or _first(
        source, ("stand", "stand", "laboratory"), ("test", "laboratory")
    )


def customer(source: ReportSource) -> str:
    """Return the customer from ``report.toml``, else from the specimen's facts, else nothing."""
    return source.fields.customer or _first(source, ("specimen", "customer"), ("campaign", "customer"))


def operator(source: ReportSource) -> str:
    """Return who tested, from ``report.toml``, else from the runs, else nothing."""
    return source.fields.tested_by or _first(source, ("run", "operator"), ("test", "operator"))


def _first(source: ReportSource, *paths: tuple[str, ...]) -> str:
    for path in paths:
        values = dict.fromkeys(str(run.fact(*path)) for run in source.runs if run.fact(*path))
        if values:
            return joined("; ", values)
    return ""


def stand_text(source: ReportSource) -> Cell:
    """Return the stand's name and id as the runs have them, and whether it was only simulated."""
    names = {
        joined(
            " · ",
            (
                str(part)
                for part in (run.fact("stand", "stand", "name"), run.fact("stand", "stand", "id"))
                if part
            ),
        )
        + (_SIMULATED if run.simulated else "")
        for run in source.runs
    } - {"", _SIMULATED}
    return given(joined("; ", sorted(names)), NOT_RECORDED)


def simulated_notice(source: ReportSource) -> tuple[str, ...]:
    """Return what is said of runs on a simulated stand: nothing of them was measured on a specimen."""
    made = [run.number for run in source.runs if run.simulated]
    if not made:
        return ()
    unused = said(
        "Serial numbers and calibrations of a simulated run are those of the stand file: no such "
        "instrument was used."
    )
    if len(made) == len(source.runs):
        return (
            said(
                "Simulated stand: nothing in this report was measured on a specimen. {unused}", unused=unused
            ),
        )
    mixed = said(
        "Simulated stand in {runs}: nothing of them was measured on a specimen; the other runs of "
        "this report were not made on a simulated stand, and simulated and real runs are in no trend "
        "or comparison together. {unused}",
        runs=runs_text(made),
        unused=unused,
    )
    return (mixed,)


def test_dates(source: ReportSource) -> Cell:
    """Return first start and last end as the runs recorded them."""
    starts = [run.started for run in source.runs if run.started is not None]
    ends = [run.ended for run in source.runs if run.ended is not None]
    if not starts:
        return Cell(DASH, "missing", NOT_RECORDED)
    return Cell(span(min(starts), max(ends or starts)))


def head(source: ReportSource) -> Sheet:
    """Return the identification on the first page; what is missing stands in the list of a draft instead."""
    fields = source.fields
    facts = (
        (said("Number"), fields.number),
        (said("Replaces report"), fields.amends),
        (said("Laboratory"), laboratory(source)),
        (said("Address"), fields.laboratory_address),
        (said("Accreditation"), fields.accreditation_number),
        (said("Place of the test"), fields.place_of_test),
        (said("Customer"), customer(source)),
        (said("Customer’s address"), fields.customer_address),
        *_specimen(source),
        (said("Its condition"), fields.specimen_condition),
        (said("Specimen received"), fields.received),
        (said("Sampling"), fields.sampling),
        (said("Test method"), fields.method),
        (said("Campaign"), _campaign(source)),
        (said("Test stand"), stand_text(source)),
        (said("Tested"), test_dates(source)),
        (said("Report issued"), fields.issued),
    )
    cells = [(name, value if isinstance(value, Cell) else given(value)) for name, value in facts]
    return Sheet("", tuple((name, cell) for name, cell in cells if cell.tone != "missing"))


def _specimen(source: ReportSource) -> tuple[tuple[str, Cell], ...]:
    """Return what tells the specimen from others, in few lines."""
    what = [_specimen_fact(source, key) for key in ("kind", "category", "elastic_system", "max_stroke_mm")]
    kind, category, system, stroke = (one.text if one.tone != "missing" else "" for one in what)
    known = [
        text
        for text in (
            specimen_words(kind),
            said("category {category}", category=category) if category else "",
            specimen_words(system),
            said("full stroke {stroke} mm", stroke=numeral(stroke)) if stroke else "",
        )
        if text
    ]
    made = [_specimen_fact(source, key).text for key in ("maker", "year")]
    return (
        (said("Specimen"), _specimen_fact(source, "id")),
        (said("Kind"), given(joined(", ", known), NOT_RECORDED)),
        (said("Maker, year"), given(joined(", ", (text for text in made if text != DASH)), NOT_RECORDED)),
        (said("Serial number"), _specimen_fact(source, "serial")),
        (said("Assembled"), _specimen_fact(source, "assembled")),
        (said("Description"), _specimen_fact(source, "description")),
    )


def _campaign(source: ReportSource) -> Cell:
    titled = source.common("campaign", "title")
    return source.common("run", "campaign") if titled.tone == "missing" or not titled.text else titled


def recording_software(source: ReportSource) -> Cell:
    """Return what recorded the runs, with the runs of each where they differ."""
    versions: dict[str, list[int]] = {}
    for run in source.runs:
        parts = (run.fact("software", "name"), run.fact("software", "version"))
        versions.setdefault(joined(" ", (str(part) for part in parts if part)), []).append(run.number)
    if set(versions) == {""}:
        return Cell(DASH, "missing", NOT_RECORDED)
    if len(versions) == 1:
        return Cell(next(iter(versions)))
    return Cell(
        joined(
            "; ",
            (
                said("{what} ({runs})", what=version or DASH, runs=runs_text(of))
                for version, of in versions.items()
            ),
        )
    )


def identification(specimens: Sequence[tuple[str, ReportSource]]) -> Section:
    """Return the facts of the specimens of a comparison: side by side where a page has room for them.

    Parameters
    ----------
    specimens : sequence of (str, ReportSource)
        Each with its title.
    """
    if len(specimens) > _MOST_BESIDE:
        sheets = [specimen_sheet(title, of) for title, of in specimens]
        return Section("identification", said("Identification"), tuple(sheets))
    table = Table(
        said("Identification"),
        (Column(said("On record")), *(Column(title) for title, _ in specimens)),
        tuple((Cell(name), *(_specimen_fact(of, key) for _, of in specimens)) for name, key in _SPECIMEN),
    )
    return Section("identification", said("Identification"), (table,))


def specimen_sheet(title: str, source: ReportSource) -> Sheet:
    """Return what is on record of the specimen."""
    return Sheet(title, tuple((name, _specimen_fact(source, key)) for name, key in _SPECIMEN))


def _specimen_fact(source: ReportSource, key: str) -> Cell:
    cell = source.common("specimen", key)
    if cell.text == "":
        return Cell(DASH, "missing", NOT_RECORDED)
    if key == "max_stroke_mm" and (stroke := _number(cell.text)) is not None:
        return Cell(significant(stroke))
    if key == "assembled" and (moment := moment_text(cell.text)) is not None:
        return Cell(moment)
    if key in {"kind", "elastic_system"}:
        return Cell(specimen_words(cell.text), cell.tone, cell.why)
    return cell


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:  # specimens with several, each with its runs
        return None


def stand_sheet(source: ReportSource) -> Sheet:
    """Return the controller, and the limits in force during the runs."""
    facts: list[tuple[str, Cell]] = [(said("Controller"), _identity(source))]
    for name, key, unit in (
        (said("Force limit"), "force_max_kN", "kN"),
        (said("Stroke limit"), "stroke_max_mm", "mm"),
        (said("Frequency limit"), "frequency_max_Hz", "Hz"),
        (said("Speed limit"), "speed_max_mm_per_s", "mm/s"),
    ):
        found = dict.fromkeys(run.limit(key) for run in source.runs)
        texts = [
            said("{value} {unit}", value=significant(value), unit=unit)
            + (said(" (set by {by})", by=by) if by else "")
            for value, by in found
            if value is not None
        ]
        facts.append((name, given(joined("; ", texts), NOT_RECORDED)))
    stops = {run.temperature_stop_C for run in source.runs} - {None}
    text = joined(
        "; ",
        (said("{stop} °C", stop=significant(stop)) for stop in sorted(s for s in stops if s is not None)),
    )
    if all(any(one.startswith(NO_TEMPERATURE_STOP) for one in _said_of(run)) for run in source.runs):
        text = said("none: see “Not guarded”")
    facts.append((said("Temperature stop"), given(text, NOT_RECORDED)))
    facts += [(said("Not guarded"), Cell(text)) for text in _not_guarded(source)]
    return Sheet(said("Test stand and limits in force"), tuple(facts))


def _not_guarded(source: ReportSource) -> list[str]:
    """Return what the stand could not guard, with the runs it is true of where it is not all of them."""
    found: dict[str, list[int]] = {}
    for run in source.runs:
        for text in _said_of(run):
            found.setdefault(text, []).append(run.number)
    return [
        text
        if len(numbers) == len(source.runs)
        else said("{text} ({runs})", text=text, runs=runs_text(numbers))
        for text, numbers in found.items()
    ]


def _said_of(run: ReportRun) -> list[str]:
    """Return what the stand could not guard in a run."""
    return [str(text) for text in run.fact("limits", "not_guarded") or ()]


def _identity(source: ReportSource) -> Cell:
    found: dict[str, None] = {}
    for run in source.runs:
        identity = run.fact("stand", "identity")
        if isinstance(identity, Mapping):
            text = joined(
                ", ",
                (
                    said("{key} {identity}", key=key, identity=_short_hash(str(identity[key])))
                    for key in _IDENTITY
                    if identity.get(key)
                ),
            )
            found[text + (_SIMULATED if run.simulated else "")] = None
        elif identity:
            found[_short_hash(str(identity))] = None
    return given(joined("; ", found), NOT_RECORDED)


def _short_hash(text: str) -> str:
    """Return a text with the begin of a hash in it: the whole one is in the run file, and so in its hash."""
    return _HASH.sub(", SHA-256\u00a0\\1…", text)


def calibrations(source: ReportSource) -> Section:
    """Return each channel's calibration with its due date, judged on the day of the test."""
    rows: dict[tuple[str, ...], list[int]] = {}
    for run in source.runs:
        for stream in (run.fact("streams") or {}).values():
            for channel in stream.get("channels") or []:
                if channel.get("quantity") in {"command", "position"}:
                    continue
                on = run.started.date() if run.started else None
                key = _calibration_key(channel, on, used=not run.simulated)
                rows.setdefault(key, []).append(run.number)
    table = Table(
        said("Calibrations of the measuring channels"),
        (
            Column(said("Channel")),
            Column(said("Place")),
            Column(said("Calibration")),
            Column(said("Certificate")),
            Column(said("Calibrated")),
            Column(said("Valid until")),
            Column(said("On the day of the test")),
            Column(said("Delay"), "ms"),
            Column(said("Accuracy"), "%"),
            Column(said("Runs")),
        ),
        tuple(_calibration_row(key, rows[key]) for key in sorted(rows, key=_by_channel)),
        note=said("Accuracy is the limit of the relative error that certificate or data sheet states."),
    )
    return Section("calibrations", said("Calibrations"), (table,))


def _by_channel(key: tuple[str, ...]) -> tuple[int, str]:
    """Return the place of a channel: force, stroke, then the others; each by its name."""
    quantities = ("force", "stroke")
    place = next((n for n, quantity in enumerate(quantities) if key[0].startswith(quantity)), len(quantities))
    return place, key[0]


def _calibration_key(channel: Mapping[str, object], on: date | None, *, used: bool) -> tuple[str, ...]:
    calibration = channel.get("calibration") or {}
    uncertainty = channel.get("uncertainty") or {}
    assert isinstance(calibration, Mapping)
    assert isinstance(uncertainty, Mapping)
    due = str(calibration.get("valid_until") or "")
    state = "" if not due or on is None else (said("valid") if on.isoformat() <= due else said("overdue"))
    state = state if used else _NOT_USED
    delay = usable(channel.get("delay_s"))
    accuracy = usable(uncertainty.get("accuracy_percent"))
    return (
        str(channel.get("name")),
        str(channel.get("place") or ""),
        str(calibration.get("id") or ""),
        str(calibration.get("certificate") or ""),
        str(calibration.get("date") or ""),
        due,
        state,
        "" if delay is None else fixed(1000.0 * delay, 2),
        "" if accuracy is None else significant(accuracy),
    )


def _calibration_row(key: tuple[str, ...], numbers: list[int]) -> tuple[Cell, ...]:
    name, place, calibration, certificate, made, due, state, delay, accuracy = key
    tones: Mapping[str, Tone] = {"valid": "good", "overdue": "bad", _NOT_USED: "open"}
    verdict = (
        Cell(state, tones[state])
        if state
        else Cell(DASH, "missing", said("no due date or no date of the test on record"))
    )
    return (
        Cell(name, "code"),
        given(place, said("place not recorded")),
        given(calibration, NOT_RECORDED),
        given(certificate, said("no certificate named")),
        given(day_text(made), said("no date named")),
        given(day_text(due), said("no due date named")),
        verdict,
        Cell(delay, "number") if delay else Cell(DASH, "missing", NOT_RECORDED),
        Cell(accuracy, "number") if accuracy else Cell(DASH, "missing", said("no accuracy stated")),
        Cell(numbers_text(numbers)),
    )


def overdue(section: Section) -> list[str]:
    """Return a warning for each calibration that was overdue on the day of the test."""
    (table,) = section.blocks
    assert isinstance(table, Table)
    return [
        said(
            "The calibration of {text} ({text_2}) was overdue: valid until {text_3}.",
            text=row[0].text,
            text_2=row[2].text,
            text_3=row[5].text,
        )
        for row in table.rows
        if row[6].text == "overdue"
    ]
