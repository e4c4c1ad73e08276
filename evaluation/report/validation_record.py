"""The validation record as a document to file: the same content becomes HTML and PDF."""

from __future__ import annotations

import json
from itertools import groupby
from math import isfinite
from pathlib import Path

from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Content,
    Section,
    Sheet,
    Table,
    Texts,
    VerdictLine,
)
from bufferstand.evaluation.report.rendering import render_html, render_pdf
from bufferstand.evaluation.report.writing import pdf_available
from bufferstand.evaluation.validation import Check, SetResult, Validation
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import replaced_whole

NAME = "validation"
_GROUPS = {
    "closed-form": "Closed forms",
    "noisy": "Noise, hum, converter steps",
    "static": "Static tests, each brought to one verdict",
    "steps": "Records with several steps",
    "timing": "Stamps, rates, delays, forms of a file",
}
_ABOUT = (
    "Each set is a record made from a closed form, or from curves that were integrated on 200 001 points, "
    "with the values that any right evaluation must find in it. It was imported and evaluated as any record "
    "is. A value counts as found if it lies within the tolerance that stands with the set; a verdict, if it "
    "is the same."
)
_EXTENT = (
    "The record covers the import of text files and the evaluation. It does not cover the stand, its sensors "
    "and their calibration."
)


def validation_content(validation: Validation) -> Content:
    """Return the content of the validation record."""
    document = validation.document()
    software = document["software"]
    libraries = ", ".join(f"{name} {version}" for name, version in software["libraries"].items())
    head = Sheet(
        "",
        (
            ("Validated", Cell(document["judged"])),
            ("Made", Cell(document["made"])),
            ("By", Cell(validation.by) if validation.by else _unknown("not stated (--by)")),
            ("SHA-256 of the code", Cell(software["code_sha256"], "code")),
            ("Libraries", Cell(f"Python {software['python']}, {libraries}")),
            ("Machine", Cell(" ".join(document["machine"].values()))),
            ("SHA-256 of the sets", Cell(document["sets_sha256"], "code")),
            ("SHA-256 of the record (validation.json)", Cell(document["sha256"], "code")),
        ),
    )
    sections = [Section("result", "Result", (_verdict(validation), Texts((_ABOUT, _EXTENT))))]
    sections += [_overview(validation)]
    by_group = groupby(validation.results, key=lambda result: result.standard.id.partition("/")[0])
    for group, results in by_group:
        title = _GROUPS.get(group, group)
        sections.append(Section(group, f"Values: {title}", tuple(_values(result) for result in results)))
    return Content(
        title="Validation record of the evaluation",
        subtitle=document["judged"],
        notices=(
            ()
            if validation.good
            else (f"{validation.missed} values are not as agreed: do not use it for results.",)
        ),
        lacks=(),
        head=head,
        sections=tuple(sections),
        ended=document["made"],
        software=f"bufferstand {validation.software.version}",
    )


def _unknown(why: str) -> Cell:
    return Cell(DASH, "missing", why)


def _verdict(validation: Validation) -> VerdictLine:
    bad = [result.standard.id for result in validation.results if not result.good]
    sentence = (
        f"{validation.checks - validation.missed} of {validation.checks} agreed values found in "
        f"{len(validation.results)} sets."
    )
    word = Cell("✓ as agreed", "good") if validation.good else Cell("✗ not as agreed", "bad")
    return VerdictLine(
        word, "Evaluation of standard data sets", sentence, tuple(f"not as agreed: {i}" for i in bad)
    )


def _overview(validation: Validation) -> Section:
    rows = []
    for result in validation.results:
        shares = [check.share for check in result.checks if check.share is not None]
        rows.append(
            (
                Cell(result.standard.id, "code"),
                Cell(result.standard.truth.title),
                Cell(str(len(result.checks)), "number"),
                _largest(shares),
                _result(good=result.good),
            )
        )
    columns = (
        Column("Set"),
        Column("What it is"),
        Column("Values"),
        Column("Largest deviation", "% of tolerance"),
        Column("Result"),
    )
    return Section("sets", "Sets", (Table("", columns, tuple(rows)),))


def _largest(shares: list[float]) -> Cell:
    if not shares:
        return _unknown("texts only")
    return Cell(f"{100.0 * max(shares):.0f}" if isfinite(max(shares)) else "a count is wrong", "number")


def _words(name: str) -> str:
    """Return the name of a quantity in words; its unit stands with the values."""
    for unit in ("_kN_per_mm", "_mm", "_kN", "_J", "_Hz"):
        name = name.removesuffix(unit)
    return name.replace("_", " ")


def _result(*, good: bool) -> Cell:
    return Cell("✓ as agreed", "good") if good else Cell("✗ not as agreed", "bad")


def _values(result: SetResult) -> Table:
    columns = (
        Column("Where"),
        Column("Value"),
        Column("Agreed"),
        Column("Tolerance"),
        Column("Found"),
        Column("By"),
        Column("Result"),
    )
    note = result.standard.truth.about + (f" {result.problem}" if result.problem else "")
    title = f"{result.standard.id}: {result.standard.truth.title}"
    return Table(title, columns, tuple(_row(check) for check in result.checks), note=note)


def _row(check: Check) -> tuple[Cell, ...]:
    agreed = check.agreed
    unit = f" {agreed.unit}" if agreed.unit not in ("", "1") else ""
    found = (
        _unknown("nothing was found in its place")
        if check.found is None
        else Cell(_shown(check.found) + unit)
    )
    return (
        Cell(agreed.of.text),
        Cell(_words(agreed.what)),
        Cell(_shown(agreed.value) + unit),
        Cell("the same") if agreed.tolerance is None else Cell(f"{agreed.tolerance:.2g}{unit}"),
        found,
        Cell(agreed.source),
        _result(good=check.good),
    )


def _shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"


def write_validation(validation: Validation, folder: Path) -> list[Path]:
    """Write ``validation.json`` and ``validation.pdf`` (``validation.html`` without typst) into a folder.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    BadInput
        If the folder or a file in it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot be made: {error.strerror or error}", file=folder) from None
    text = json.dumps(validation.document(), indent=1, ensure_ascii=False, allow_nan=False)
    content = validation_content(validation)
    if pdf_available():
        files = {f"{NAME}.json": text.encode(), f"{NAME}.pdf": render_pdf(content, ())}
    else:
        files = {f"{NAME}.json": text.encode(), f"{NAME}.html": render_html(content, ()).encode()}
    written = []
    for name, data in files.items():
        with replaced_whole(folder / name) as temporary:
            temporary.write_bytes(data)
        written.append(folder / name)
    return written
