"""Further results from the records: contact, holds, residual strokes, settling, energy; before and after."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from bufferstand.evaluation.catalogue import QUANTITIES, SETTLING
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Section,
    Table,
    Texts,
    fixed,
    measured_cell,
    moment_of,
    quantity_cell,
    significant,
    usable,
)
from bufferstand.evaluation.report.sections.evidence import number_of
from bufferstand.evaluation.report.sections.verdicts import verdict_cell
from bufferstand.evaluation.report.source import ReportRun, ReportSource, numbers_text
from bufferstand.evaluation.wording import hold_words, joined, label, moment, said
from bufferstand.foundation.channels import STROKE_CHANNELS

Entry = Mapping[str, Any]

MOST_ROWS = 6
"""Of a run with more holds or residual strokes the first and the last so many are printed."""
_SETTLED = [(entry.name, label(entry.settled.heading)) for entry in SETTLING if entry.settled.heading]
_COMPARED = (
    ("preload_kN", said("Preload"), "kN"),
    *(
        (entry.name, label(entry.label), entry.printed_unit)
        for entry in QUANTITIES
        if entry.shown.before_after
    ),
)
_ZEROED = (
    *((name, said("Draw wire {what}", what=name.removeprefix("stroke_")), "mm") for name in STROKE_CHANNELS),
    ("position", said("Piston"), "mm"),
    ("force", said("Force"), "kN"),
)
"""Channels whose zero is shown: name, label, unit; a third and a fourth draw wire where it was zeroed."""
_SOMETIMES = STROKE_CHANNELS[2:]
_NO_U = said("the channels state no accuracy")
_FEW = said("fewer than three complete cycles, or one of them is without this figure")
_NONE_EVALUATED = said("no cycle was evaluated")
_OPEN = said("the last cycle is not within 2 % of those before it")


def contact_section(source: ReportSource) -> Section | None:
    """Return how zeros were set, and by how much that of each static run is off; None where neither is."""
    runs = [(run, contact) for run in source.runs if (contact := run.evaluated.get("first_contact"))]
    zeros = _zeros_table(source)
    if not runs:
        return (
            None if zeros is None else Section("first-contact", said("First contact"), (zeros,), annex=True)
        )
    table = Table(
        said("Place of first contact"),
        (
            Column(said("Run")),
            Column(said("Contact at stroke ± U"), "mm"),
            Column(said("Zero counted from contact ± U"), "mm"),
            Column(said("Zero stated within"), "mm"),
            Column(said("Force before contact"), "kN"),
            Column(said("Zero")),
        ),
        tuple(_contact(run, contact) for run, contact in runs),
        note=said(
            "Where the force leaves its rest level on the first approach. A zero that lies before the "
            "contact is negative. Off: by more than U and what the channels state. Requirements that "
            "this could change say so in their reason."
        ),
    )
    return Section(
        "first-contact", said("First contact"), (table,) if zeros is None else (zeros, table), annex=True
    )


def _zeros_table(source: ReportSource) -> Table | None:
    """Return each zero once with the runs that count from it; None where no run has one."""
    found: dict[str, tuple[list[int], Entry]] = {}
    for run in source.runs:
        if zero := run.evaluated["run"].get("zero"):
            found.setdefault(json.dumps(zero, sort_keys=True, default=str), ([], zero))[0].append(run.number)
    if not found:
        return None
    set_to_zero = {one["name"] for _, zero in found.values() for one in zero["channel"]}
    shown = [one for one in _ZEROED if one[0] not in _SOMETIMES or one[0] in set_to_zero]
    return Table(
        said("Determination of the zero"),
        (
            Column(said("Runs")),
            Column(said("By")),
            Column(said("Found (UTC)") if source.language.is_plain else said("Found")),
            *(Column(said("{label} ± U", label=label), unit) for _, label, unit in shown),
        ),
        tuple(_zero(numbers, zero, [name for name, _, _ in shown]) for numbers, zero in found.values()),
        note=said(
            "What the channels read at the zero; it is taken off. By touch: the piston creeps to a small "
            "force and back before the first stroke, and first contact is found from the samples. U "
            "holds noise, fit, resolution and what the channel states for its zero."
        ),
    )


def _zero(numbers: Sequence[int], zero: Entry, names: Sequence[str]) -> tuple[Cell, ...]:
    channels = {one["name"]: one for one in zero["channel"]}
    how = {"touch": said("touch"), "tare": said("tare at rest")}[zero["how"]]
    by = said("{how}, taken over", how=how) if zero.get("taken_over") else how
    read = [channels.get(name) for name in names]
    return (
        Cell(numbers_text(numbers)),
        Cell(by),
        Cell(_found(str(zero["found"]))),
        *(
            Cell(DASH, "missing", said("this channel was not zeroed"))
            if one is None
            else measured_cell(one["value"], 2.0 * one["u"], "")
            for one in read
        ),
    )


def _found(text: str) -> str:
    """Return when a zero was found; in English to the minute, its heading names the zone."""
    short, at = text[:16].replace("T", " "), moment_of(text)
    return short if at is None else moment(at, english=short)


def _contact(run: ReportRun, contact: Entry) -> tuple[Cell, ...]:
    why = str(contact.get("why") or said("the record does not show it"))
    U, rest = contact.get("expanded_uncertainty"), usable(contact.get("rest_force_kN"))
    stated = usable(contact.get("stated_zero_mm"))
    shown = usable(contact.get("stroke_mm")) is not None
    judged = Cell(said("off"), "bad") if contact.get("beyond") else Cell(said("kept"))
    return (
        Cell(str(run.number), "number"),
        measured_cell(contact.get("stroke_mm"), U, why),
        measured_cell(contact.get("recorded_zero_offset_mm"), U, why),
        Cell(significant(stated), "number") if stated else Cell(DASH, "missing", _NO_U),
        Cell(DASH, "missing", why) if rest is None else Cell(fixed(rest, 2), "number"),
        judged if shown else Cell(DASH, "missing", why),
    )


def history_section(source: ReportSource) -> Section | None:
    """Return what the records hold besides the figures of cycles; None where there is nothing."""
    blocks = [
        *_table(_HOLDS, *_listed(source, "holds", _hold, _HOLDS_NOTE)),
        *_table(_RESIDUAL, *_listed(source, "residual_strokes", _residual, _RESIDUAL_NOTE)),
        *_table(_COURSE, [_course(run, part) for run in source.runs for part in _parts(run)], _COURSE_NOTE),
        *_before_after(source),
        *_table(
            _PROOF, [row for total in _own(source, "proof_load_totals") for row in _proof(source, total)]
        ),
    ]
    if not blocks:
        return None
    return Section("history", said("Further results from the records"), tuple(blocks), annex=True)


_HOLDS = (
    said("Holds at the top"),
    (
        Column(said("Run")),
        Column(said("Cycle")),
        Column(said("Kind")),
        Column(said("Length"), "s"),
        Column(said("Force from"), "kN"),
        Column(said("to"), "kN"),
        Column(said("a decade of time ± U"), "kN"),
        Column(said("Stroke from"), "mm"),
        Column(said("to"), "mm"),
        Column(said("a decade of time ± U"), "mm"),
    ),
)
_HOLDS_NOTE = said(
    "Relaxation: the force changes while the stroke rests; creep: the other way round. The "
    "change a decade is that of each tenfold time since the arrival."
)
_RESIDUAL = (
    said("Residual strokes"),
    (
        Column(said("Run")),
        Column(said("Cycle")),
        Column(said("Residual stroke ± U"), "mm"),
        Column(said("Pause"), "s"),
        Column(said("Recovered in the pause"), "mm"),
    ),
)
_RESIDUAL_NOTE = said(
    "What remains of a stroke when its pause begins; U without the errors that both ends share."
)
_COURSE = (
    said("Settling and cumulated energy"),
    (
        Column(said("Run")),
        Column(said("Complete cycles")),
        *(Column(said("{words}, first to last ± U", words=words), "%") for _, words in _SETTLED),
        Column(said("All settled from cycle")),
        Column(said("Absorbed in all ± U"), "kJ"),
        Column(said("Cycles not evaluated")),
    ),
)
_COURSE_NOTE = said(
    "U of a change is by the noise within cycles, how blunt their turns are and errors in proportion to the "
    "figure; what is common to all cycles cancels. Where the noise is not known, the scatter of "
    "neighbouring cycles stands for it, which takes four cycles. Settled: all later cycles stay within 2 % "
    "of the mean of the last quarter. The absorbed energy is a lower bound where cycles were not "
    "evaluated; its U is the sum of theirs."
)
_PROOF = (
    said("Proof loads added over runs"),
    (
        Column(said("Specimen")),
        Column(said("Proof load")),
        Column(said("Run")),
        Column(said("Load cycles")),
        Column(said("Verdict")),
        Column(said("In all")),
    ),
)


def _table(
    head: tuple[str, tuple[Column, ...]], rows: Sequence[tuple[Cell, ...]], note: str = ""
) -> list[Table]:
    return [Table(*head, tuple(rows), note=note)] if rows else []


def _listed(
    source: ReportSource, key: str, row: Callable[[ReportRun, Entry], tuple[Cell, ...]], note: str
) -> tuple[list[tuple[Cell, ...]], str]:
    """Return a row for each entry, of many in one run of the first and the last, and the note."""
    rows, left = [], []
    for run in source.runs:
        entries = list(run.evaluated.get(key) or [])
        if len(entries) > 2 * MOST_ROWS:
            left.append(
                said(
                    "run {number}: {most_rows} of {count_of_entries}",
                    number=run.number,
                    most_rows=2 * MOST_ROWS,
                    count_of_entries=len(entries),
                )
            )
            entries = [*entries[:MOST_ROWS], *entries[-MOST_ROWS:]]
        rows += [row(run, entry) for entry in entries]
    if left:
        note += said(
            " Of many in one run the first and the last are printed ({list}).", list=joined("; ", left)
        )
    return rows, note


def _hold(run: ReportRun, hold: Entry) -> tuple[Cell, ...]:
    return (
        Cell(str(run.number), "number"),
        Cell(str(hold["cycle"]), "number"),
        Cell(hold_words(hold["kind"])),
        Cell(fixed(hold["duration_s"], 1), "number"),
        *(Cell(fixed(hold[f"force_{end}_kN"], 1), "number") for end in ("start", "end")),
        _per_decade(hold["force_per_decade_kN"]),
        *(Cell(fixed(hold[f"stroke_{end}_mm"], 2), "number") for end in ("start", "end")),
        _per_decade(hold["stroke_per_decade_mm"]),
    )


def _per_decade(slope: Entry) -> Cell:
    return measured_cell(slope["value"], slope["expanded_uncertainty"], _NO_U)


def _residual(run: ReportRun, left: Entry) -> tuple[Cell, ...]:
    return (
        Cell(str(run.number), "number"),
        Cell(str(left["cycle"]), "number"),
        measured_cell(left["residual_mm"], left["expanded_uncertainty"], _NO_U),
        Cell(fixed(left["pause_s"], 1), "number"),
        Cell(fixed(left["recovered_mm"], 2), "number"),
    )


def _parts(run: ReportRun) -> Iterable[int | None]:
    """Return the steps of a run that has several, None for the run as a whole; nothing to say: none."""
    settling = run.evaluated.get("settling") or []
    parts = list(dict.fromkeys(one["part"] for one in settling))
    cumulated = run.evaluated.get("cumulated_energy_J")
    return parts or ([None] if cumulated is not None else [])


def _course(run: ReportRun, part: int | None) -> tuple[Cell, ...]:
    own = {one["quantity"]: one for one in run.evaluated.get("settling") or [] if one["part"] == part}
    span = next(
        (
            said("{first_cycle} – {last_cycle}", first_cycle=one["first_cycle"], last_cycle=one["last_cycle"])
            for one in own.values()
        ),
        None,
    )
    settled = [own[name]["settled_at_cycle"] for name, _ in _SETTLED if name in own]
    last = Cell(DASH, "missing", _FEW)
    if settled:
        late = None if None in settled else max(settled)
        last = Cell(DASH, "missing", _OPEN) if late is None else Cell(str(late), "number")
    return (
        Cell(run.label if part is None else f"{run.number}#{part}", "number"),
        Cell(DASH, "missing", _FEW) if span is None else Cell(span, "number"),
        *(_change(own.get(name)) for name, _ in _SETTLED),
        last,
        *_energy(run, part),
    )


def _change(one: Entry | None) -> Cell:
    if one is None or one["relative_change"] is None:
        return Cell(DASH, "missing", _FEW)
    share, U = 100.0 * one["relative_change"], usable(one["expanded_uncertainty"])
    if U is None:
        return Cell(fixed(share, 2), "number")
    return measured_cell(share, 100.0 * U / abs(one["first"]), _FEW)


def _energy(run: ReportRun, part: int | None) -> tuple[Cell, Cell]:
    if part not in (None, 1):
        return Cell(said("see above")), Cell("")  # the sum is the run's, over all its steps
    energy = run.evaluated.get("cumulated_energy_J")
    if energy is None:
        return Cell(DASH, "missing", _NONE_EVALUATED), Cell(said("all"))
    U = usable(energy["expanded_uncertainty"])
    left = energy["not_evaluated"]
    return (
        measured_cell(1e-3 * energy["absorbed"], None if U is None else 1e-3 * U, _NO_U),
        Cell(
            joined(", ", map(str, left[:MOST_ROWS])) + (" …" if len(left) > MOST_ROWS else "") or said("none")
        ),
    )


def _own(source: ReportSource, key: str) -> list[Entry]:
    """Return the entries of the document that a run of this report is part of."""
    ids = {run.id for run in source.runs}

    def named(entry: Entry) -> set[str]:
        runs = entry.get("runs") or [entry["before"], *entry["after"]]
        return {str(one["run"]).partition("#")[0] for one in runs}

    return [entry for entry in source.document.get(key) or [] if named(entry) & ids]


def _before_after(source: ReportSource) -> list[Table | Texts]:
    """Return a table for each step that a specimen went through more than once."""
    blocks: list[Table | Texts] = []
    for entry in _own(source, "before_after"):
        before = entry["before"]
        rows = [
            _changed(source, after, *figure, after["changes"][figure[0]])
            for after in entry["after"]
            for figure in _COMPARED
            if figure[0] in after["changes"]
        ]
        blocks.append(
            Table(
                said(
                    "Before and after: specimen {specimen}, against run {source}",
                    specimen=entry["specimen"],
                    source=number_of(source, before["run"]),
                ),
                (
                    Column(said("Run")),
                    Column(said("Temperature"), "°C"),
                    Column(said("Figure")),
                    Column(said("Before")),
                    Column(said("After")),
                    Column(said("Change ± U")),
                    Column(said("Unit")),
                    Column(said("Change"), "%"),
                    Column(said("Beyond U")),
                ),
                tuple(rows),
                note=said(
                    "Errors that both runs have in common cancel as far as they act alike; U has the rest."
                ),
            )
        )
        if warnings := [str(text) for text in entry.get("warnings") or []]:
            blocks.append(Texts(tuple(warnings), listed=True))
    return blocks


def _changed(
    source: ReportSource, after: Entry, name: str, words: str, unit: str, change: Entry
) -> tuple[Cell, ...]:
    shown = "force_max_kN" if name == "preload_kN" else name
    relative, beyond = usable(change["relative_change"]), change["beyond"]
    return (
        Cell(number_of(source, after["run"]), "number"),
        quantity_cell("temperature_C", after["temperature_C"], said("no specimen temperature on record")),
        Cell(words),
        *(quantity_cell(shown, change[key], said("not to be had")) for key in ("before", "after")),
        measured_cell(change["change"], change["expanded_uncertainty"], said("not to be had")),
        Cell(unit),
        Cell(DASH, "missing", said("it was 0 before"))
        if relative is None
        else Cell(fixed(100.0 * relative, 2), "number"),
        Cell(DASH, "missing", _NO_U) if beyond is None else Cell(said("yes") if beyond else said("no")),
    )


def _proof(source: ReportSource, total: Entry) -> list[tuple[Cell, ...]]:
    return [
        (
            Cell(str(total["specimen"])),
            Cell(str(total["proof_load"])),
            Cell(number_of(source, run["run"]), "number"),
            Cell(str(run["load_cycles"]), "number"),
            verdict_cell(run["verdict"], said("nothing is required of it")),
            Cell(str(total["load_cycles"]), "number"),
        )
        for run in total["runs"]
    ]
