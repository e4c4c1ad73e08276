"""Who, what, where and when: the identification that ISO/IEC 17025, 7.8.2.1, asks for."""

from __future__ import annotations

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
    fixed,
    moment_text,
    significant,
    usable,
)
from bufferstand.evaluation.report.source import NOT_RECORDED, ReportRun, ReportSource, runs_text
from bufferstand.foundation import NO_TEMPERATURE_STOP

_NOT_USED = "not used (simulated)"
"""Instead of whether a calibration was valid on the day: it is the stand file's, and nobody used it."""
_IDENTITY = ("device", "serial", "firmware", "profile")
_TO_BE_GIVEN = "not given: add it to report.toml beside the runs"
_SIMULATED = " (simulated)"
_MOST_BESIDE = 4
"""Specimens whose facts stand side by side; of more, one below the other."""
_SPECIMEN = (
    ("Identification", "id"),
    ("Kind", "kind"),
    ("Category", "category"),
    ("Elastic system", "elastic_system"),
    ("Full stroke [mm]", "max_stroke_mm"),
    ("Assembled", "assembled"),
    ("Maker", "maker"),
    ("Serial number", "serial"),
    ("Year", "year"),
    ("Description", "description"),
)


def given(text: object, why: str = _TO_BE_GIVEN) -> Cell:
    """Return a fact as a cell, or a dash with the reason."""
    shown = text.isoformat() if isinstance(text, date) else str(text or "")
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
            return "; ".join(values)
    return ""


def stand_text(source: ReportSource) -> Cell:
    """Return the stand's name and id as the runs have them, and whether it was only simulated."""
    names = {
        " · ".join(
            str(part)
            for part in (run.fact("stand", "stand", "name"), run.fact("stand", "stand", "id"))
            if part
        )
        + (_SIMULATED if run.simulated else "")
        for run in source.runs
    } - {"", _SIMULATED}
    return given("; ".join(sorted(names)), NOT_RECORDED)


def simulated_notice(source: ReportSource) -> tuple[str, ...]:
    """Return what is said of runs on a simulated stand: nothing of them was measured on a specimen."""
    made = [run.number for run in source.runs if run.simulated]
    if not made:
        return ()
    unused = (
        "Serial numbers and calibrations of a simulated run are those of the stand file: no such instrument "
        "was used."
    )
    if len(made) == len(source.runs):
        return (f"Simulated stand: nothing in this report was measured on a specimen. {unused}",)
    mixed = (
        f"Simulated stand in {runs_text(made)}: nothing of them was measured on a specimen; the other runs "
        "of this report were not made on a simulated stand, and simulated and real runs are in no trend or "
        f"comparison together. {unused}"
    )
    return (mixed,)


def test_dates(source: ReportSource) -> Cell:
    """Return first start and last end as the runs recorded them."""
    starts = [run.started for run in source.runs if run.started is not None]
    ends = [run.ended for run in source.runs if run.ended is not None]
    if not starts:
        return Cell(DASH, "missing", NOT_RECORDED)
    first, last = moment_text(min(starts).isoformat()), moment_text(max(ends or starts).isoformat())
    day, _, time = str(first).partition(" ")
    if str(last).startswith(f"{day} "):
        return Cell(f"{day}, {time.rpartition(' ')[0]} to {str(last).partition(' ')[2]}")
    return Cell(f"{first} to {last}")


def head(source: ReportSource) -> Sheet:
    """Return the identification on the first page; what is missing stands in the list of a draft instead."""
    fields = source.fields
    facts = (
        ("Number", fields.number),
        ("Replaces report", fields.amends),
        ("Laboratory", laboratory(source)),
        ("Address", fields.laboratory_address),
        ("Accreditation", fields.accreditation_number),
        ("Place of the test", fields.place_of_test),
        ("Customer", customer(source)),
        ("Customer’s address", fields.customer_address),
        *_specimen(source),
        ("Its condition", fields.specimen_condition),
        ("Specimen received", fields.received),
        ("Sampling", fields.sampling),
        ("Test method", fields.method),
        ("Campaign", _campaign(source)),
        ("Test stand", stand_text(source)),
        ("Tested", test_dates(source)),
        ("Report issued", fields.issued),
    )
    cells = [(name, value if isinstance(value, Cell) else given(value)) for name, value in facts]
    return Sheet("", tuple((name, cell) for name, cell in cells if cell.tone != "missing"))


def _specimen(source: ReportSource) -> tuple[tuple[str, Cell], ...]:
    """Return what tells the specimen from others, in few lines."""
    what = [_specimen_fact(source, key) for key in ("kind", "category", "elastic_system", "max_stroke_mm")]
    words = ("{}", "category {}", "{}", "full stroke {} mm")
    known = [form.format(one.text) for form, one in zip(words, what, strict=True) if one.tone != "missing"]
    made = [_specimen_fact(source, key).text for key in ("maker", "year")]
    return (
        ("Specimen", _specimen_fact(source, "id")),
        ("Kind", given(", ".join(known), NOT_RECORDED)),
        ("Maker, year", given(", ".join(text for text in made if text != DASH), NOT_RECORDED)),
        ("Serial number", _specimen_fact(source, "serial")),
        ("Assembled", _specimen_fact(source, "assembled")),
        ("Description", _specimen_fact(source, "description")),
    )


def _campaign(source: ReportSource) -> Cell:
    titled = source.common("campaign", "title")
    return source.common("run", "campaign") if titled.tone == "missing" or not titled.text else titled


def recording_software(source: ReportSource) -> Cell:
    """Return what recorded the runs, with the runs of each where they differ."""
    versions: dict[str, list[int]] = {}
    for run in source.runs:
        parts = (run.fact("software", "name"), run.fact("software", "version"))
        versions.setdefault(" ".join(str(part) for part in parts if part), []).append(run.number)
    if set(versions) == {""}:
        return Cell(DASH, "missing", NOT_RECORDED)
    if len(versions) == 1:
        return Cell(next(iter(versions)))
    return Cell("; ".join(f"{version or DASH} ({runs_text(of)})" for version, of in versions.items()))


def identification(specimens: Sequence[tuple[str, ReportSource]]) -> Section:
    """Return the facts of the specimens of a comparison: side by side where a page has room for them.

    Parameters
    ----------
    specimens : sequence of (str, ReportSource)
        Each with its title.
    """
    if len(specimens) > _MOST_BESIDE:
        sheets = [specimen_sheet(title, of) for title, of in specimens]
        return Section("identification", "Identification", tuple(sheets))
    table = Table(
        "Identification",
        (Column("On record"), *(Column(title) for title, _ in specimens)),
        tuple((Cell(name), *(_specimen_fact(of, key) for _, of in specimens)) for name, key in _SPECIMEN),
    )
    return Section("identification", "Identification", (table,))


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
    return cell


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:  # specimens with several, each with its runs
        return None


def stand_sheet(source: ReportSource) -> Sheet:
    """Return the controller, and the limits in force during the runs."""
    facts: list[tuple[str, Cell]] = [("Controller", _identity(source))]
    for name, key, unit in (
        ("Force limit", "force_max_kN", "kN"),
        ("Stroke limit", "stroke_max_mm", "mm"),
        ("Frequency limit", "frequency_max_Hz", "Hz"),
        ("Speed limit", "speed_max_mm_per_s", "mm/s"),
    ):
        found = dict.fromkeys(run.limit(key) for run in source.runs)
        texts = [
            f"{significant(value)} {unit}" + (f" (set by {by})" if by else "")
            for value, by in found
            if value is not None
        ]
        facts.append((name, given("; ".join(texts), NOT_RECORDED)))
    stops = {run.temperature_stop_C for run in source.runs} - {None}
    text = "; ".join(f"{significant(stop)} °C" for stop in sorted(s for s in stops if s is not None))
    if all(any(one.startswith(NO_TEMPERATURE_STOP) for one in _said_of(run)) for run in source.runs):
        text = "none: see “Not guarded”"
    facts.append(("Temperature stop", given(text, NOT_RECORDED)))
    facts += [("Not guarded", Cell(text)) for text in _not_guarded(source)]
    return Sheet("Test stand and limits in force", tuple(facts))


def _not_guarded(source: ReportSource) -> list[str]:
    """Return what the stand could not guard, with the runs it is true of where it is not all of them."""
    found: dict[str, list[int]] = {}
    for run in source.runs:
        for text in _said_of(run):
            found.setdefault(text, []).append(run.number)
    return [
        text if len(numbers) == len(source.runs) else f"{text} ({runs_text(numbers)})"
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
            text = ", ".join(f"{key} {identity[key]}" for key in _IDENTITY if identity.get(key))
            found[text + (_SIMULATED if run.simulated else "")] = None
        elif identity:
            found[str(identity)] = None
    return given("; ".join(found), NOT_RECORDED)


def calibrations(source: ReportSource) -> Section:
    """Return each channel's calibration with its due date, judged on the day of the test."""
    rows: dict[tuple[str, ...], list[int]] = {}
    for run in source.runs:
        for stream in (run.fact("streams") or {}).values():
            for channel in stream.get("channels") or []:
                if channel.get("quantity") in {"command", "position"}:
                    continue
                day = run.started.date() if run.started else None
                key = _calibration_key(channel, day, used=not run.simulated)
                rows.setdefault(key, []).append(run.number)
    table = Table(
        "Calibrations of the measuring channels",
        (
            Column("Channel"),
            Column("Place"),
            Column("Calibration"),
            Column("Certificate"),
            Column("Calibrated"),
            Column("Valid until"),
            Column("On the day of the test"),
            Column("Delay", "ms"),
            Column("Accuracy", "%"),
            Column("Runs"),
        ),
        tuple(_calibration_row(key, numbers) for key, numbers in rows.items()),
        note="Accuracy is the limit of the relative error that certificate or data sheet states.",
    )
    return Section("calibrations", "Calibrations", (table,))


def _calibration_key(channel: Mapping[str, object], day: date | None, *, used: bool) -> tuple[str, ...]:
    calibration = channel.get("calibration") or {}
    uncertainty = channel.get("uncertainty") or {}
    assert isinstance(calibration, Mapping)
    assert isinstance(uncertainty, Mapping)
    due = str(calibration.get("valid_until") or "")
    state = "" if not due or day is None else ("valid" if day.isoformat() <= due else "overdue")
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
        else Cell(DASH, "missing", "no due date or no date of the test on record")
    )
    return (
        Cell(name, "code"),
        given(place, "place not recorded"),
        given(calibration, NOT_RECORDED),
        given(certificate, "no certificate named"),
        given(made, "no date named"),
        given(due, "no due date named"),
        verdict,
        Cell(delay, "number") if delay else Cell(DASH, "missing", NOT_RECORDED),
        Cell(accuracy, "number") if accuracy else Cell(DASH, "missing", "no accuracy stated"),
        Cell(runs_text(numbers).removeprefix("runs ").removeprefix("run ")),
    )


def overdue(section: Section) -> list[str]:
    """Return a warning for each calibration that was overdue on the day of the test."""
    (table,) = section.blocks
    assert isinstance(table, Table)
    return [
        f"The calibration of {row[0].text} ({row[2].text}) was overdue: valid until {row[5].text}."
        for row in table.rows
        if row[6].text == "overdue"
    ]
