"""From recorded runs to report files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bufferstand.evaluation.document import check_table_name
from bufferstand.evaluation.report.attachments import attachments_of
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content import Attachment, Content
from bufferstand.evaluation.report.digital import render_digital
from bufferstand.evaluation.report.drawing import drawing
from bufferstand.evaluation.report.numbering import with_number
from bufferstand.evaluation.report.rendering import TypesetReport, render_html, render_workbook, typeset_pdf
from bufferstand.evaluation.report.signing import SigningKey, signed
from bufferstand.evaluation.report.source import (
    EVALUATION_NAME,
    MOST_SIDES,
    Given,
    ReportFields,
    ReportSource,
    check_chosen,
    language_for,
    read_source,
    side_by_side,
)
from bufferstand.evaluation.wording import Language
from bufferstand.foundation import BadInput, how_to_add
from bufferstand.foundation.files import check_outputs, replaced_whole

_Rendered = bytes | TypesetReport
_RENDERERS: Mapping[str, Callable[[Content, Sequence[str], Sequence[Attachment]], _Rendered]] = {
    "html": lambda content, figures, _: render_html(content, figures).encode(),
    "pdf": typeset_pdf,
}


def pdf_available() -> bool:
    """Say whether the typesetter of the PDF report is installed (extra ``pdf``)."""
    return find_spec("typst") is not None


def formats_here() -> list[str]:
    """Return the formats that this installation can write a report in."""
    return ["html", "pdf"] if pdf_available() else ["html"]


def write_report(
    path: Path,
    out: Path | None,
    *,
    formats: Sequence[str] = ("html", "pdf"),
    document: Mapping[str, Any] | None = None,
    given: Given | None = None,
    table: Path | None = None,
    digital: Path | None = None,
    key: SigningKey | None = None,
) -> list[Path]:
    """Write the test report of a run or a campaign.

    Parameters
    ----------
    path : Path
        A run file, or a campaign folder with its runs in ``runs/*.h5`` or ``*.h5``. A ``report.toml`` in the
        folder adds what only the laboratory knows.
    out : Path or None
        Folder for the report; made if it is not there. Files of the same name are replaced. None: only the
        workbook or the digital report is wanted.
    formats : sequence of str
        ``html``, ``pdf`` or both.
    document : mapping, optional
        Their evaluation document (docs/evaluation-document.md); without one they are evaluated here.
    given : Given, optional
        How to evaluate, and what to show besides: fields, model, earlier evaluation.
    table : Path, optional
        A workbook (.xlsx) for the tables of the report, those by cycle and behind the figures, too.
    digital : Path, optional
        A file for the digital test report (.xml: DCC 3.2.1).
    key : SigningKey, optional
        Signs the PDF (:func:`bufferstand.evaluation.report.signing.open_key`).

    Returns
    -------
    list of Path
        The files written, in the order of ``formats``, then the workbook and the digital report. The same
        runs, document and ``report.toml`` give the same bytes, up to the signature.

    Raises
    ------
    BadInput
        If there are no runs, one cannot be used, a format is unknown, typst is missing for a PDF, the
        workbook is no .xlsx or openpyxl is missing for it, a digital report is wanted of runs that do not
        say when they were made, or something cannot be written.
    """
    _check_formats(formats)
    _check_workbook(table)
    _check_signing(key, () if out is None else formats)
    _check_files((table, digital), out)
    source = read_source(path, document, given)
    check_chosen([source], given.conformity if given else ())
    if out is not None:
        _check_kept(source.fields, out / f"{source.name}-report.pdf")
    source = with_number(source)
    content = build_content(source)
    plots = [picture.plot for picture in content.pictures()] if out is not None else []
    with drawing(plots, content.language, given.jobs if given else 1) as drawn:
        xml = render_digital(source, content) if digital is not None else _digital(source, content)
        written = []
        if out is not None:
            inside = attachments_of(content, source, {EVALUATION_NAME: source.evaluation_json}, xml)
            written = _write(content, drawn(), inside, out, f"{source.name}-report", formats, key)
    if table is not None:
        written.append(_write_workbook(build_content(replace(source, detailed=True)), table))
    if digital is not None:
        with replaced_whole(digital) as place:
            place.write_bytes(xml or b"")
        written.append(digital)
    return written


def _digital(source: ReportSource, content: Content) -> bytes | None:
    """Return the digital test report; None of runs that do not say when they were made: it needs dates."""
    try:
        return render_digital(source, content)
    except BadInput:
        return None


def write_comparison(
    paths: Sequence[Path],
    out: Path,
    *,
    formats: Sequence[str] = ("html", "pdf"),
    given: Given | None = None,
    table: Path | None = None,
    key: SigningKey | None = None,
) -> list[Path]:
    """Write the report that sets several specimens or campaigns side by side; the first is the reference.

    Parameters
    ----------
    paths : sequence of Path
        Two or more run files or campaign folders.
    out, formats, table, key
        As of :func:`write_report`.
    given : Given, optional
        How to evaluate. Its fields are those of the comparison; the campaigns' own are not used.

    Returns
    -------
    list of Path
        ``comparison-report.html`` and ``.pdf``.

    Raises
    ------
    BadInput
        As :func:`write_report`, or if there are fewer than two paths, more than 26, the same one twice, or
        the same recording in two of them.
    """
    _check_formats(formats)
    _check_workbook(table)
    _check_signing(key, formats)
    _check_files((table,), out)
    given = given or Given()
    if given.model is not None or given.earlier is not None:
        raise BadInput(
            "a comparison of specimens takes no model and no earlier evaluation",
            remedy="give one PATH for a report with them",
        )
    _check_sides(paths)
    sources = [read_source(path, None, replace(given, fields=ReportFields())) for path in paths]
    _check_recordings(paths, sources)
    check_chosen(sources, given.conformity)
    fields = given.fields or ReportFields()
    sides = side_by_side(sources, fields, language_for(fields, given.language))
    _check_kept(sides.whole.fields, out / "comparison-report.pdf")
    sides = replace(sides, whole=with_number(sides.whole))
    content = build_comparison(sides)
    evaluations = {name: side.evaluation_json for name, side in sides.named.items()}
    plots = [picture.plot for picture in content.pictures()]
    with drawing(plots, content.language, given.jobs) as drawn:
        attached = attachments_of(content, sides.whole, evaluations)
        written = _write(content, drawn(), attached, out, "comparison-report", formats, key)
    if table is not None:
        written.append(_write_workbook(content, table))
    return written


def _check_workbook(table: Path | None) -> None:
    if table is None:
        return
    if table.suffix.lower() != ".xlsx":
        raise BadInput("the tables of a report are a workbook", file=table, remedy="name a .xlsx file")
    check_table_name(table)


def _check_files(files: Sequence[Path | None], out: Path | None) -> None:
    """Refuse names under which nothing can be written; the report's folder is made where one lies in it."""
    named = [file for file in files if file is not None]
    if out is not None and any(file.parent.resolve() == out.resolve() for file in named):
        _make_folder(out)
    check_outputs(named)


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"the report cannot be written: {error.strerror}", file=out, remedy="choose another folder"
        ) from None


def _write_workbook(content: Content, table: Path) -> Path:
    with replaced_whole(table) as place:
        place.write_bytes(render_workbook(content))
    return table


def _check_signing(key: SigningKey | None, formats: Sequence[str]) -> None:
    if key is not None and "pdf" not in formats:
        raise BadInput(
            "a signature is part of the PDF, and none is written",
            file="--sign",
            remedy=f"give --out DIR, and install typst where it is missing ({how_to_add('pdf')})",
        )


def _check_kept(fields: ReportFields, target: Path) -> None:
    """Refuse to write an amended report over the one that it replaces: that is on record with its hash."""
    if fields.amends_report and Path(fields.amends_report).resolve() == target.resolve():
        raise BadInput(
            "the amended report would take the place of the one that it replaces",
            file=target,
            remedy="choose another folder: both are kept",
        )


def _check_formats(formats: Sequence[str]) -> None:
    if unknown := [name for name in formats if name not in _RENDERERS]:
        raise BadInput(f"there is no report format “{unknown[0]}”", remedy=f"use {' or '.join(_RENDERERS)}")


def _check_sides(paths: Sequence[Path]) -> None:
    if not 2 <= len(paths) <= MOST_SIDES:
        raise BadInput(f"a comparison takes 2 to {MOST_SIDES} paths, not {len(paths)}")
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise BadInput(
                "this is given twice: it does not differ from itself", file=path, remedy="give it once"
            )
        seen.add(path.resolve())


def _check_recordings(paths: Sequence[Path], sources: Sequence[ReportSource]) -> None:
    """Refuse one recording on two sides, as a copy of a folder has it: it does not differ from itself."""
    seen: dict[str, Path] = {}
    for path, source in zip(paths, sources, strict=True):
        own = {str(run.metadata.get("content_sha256") or run.sha256): run for run in source.runs}
        for content, run in own.items():
            if content in seen:
                raise BadInput(
                    f"the recording {run.file} is one of {seen[content]}, too, with the same content: "
                    "it does not differ from itself",
                    file=path,
                    remedy="give each recording once",
                )
        seen |= dict.fromkeys(own, path)


def _write(
    content: Content,
    figures: Sequence[str],
    attached: Sequence[Attachment],
    out: Path,
    name: str,
    formats: Sequence[str],
    key: SigningKey | None,
) -> list[Path]:
    # All are rendered before the first is written: a report is whole or not there. Side by side, because the
    # typesetter works without Python's lock.
    with ThreadPoolExecutor() as pool:
        rendered = dict(
            zip(
                formats,
                pool.map(lambda kind: _RENDERERS[kind](content, figures, attached), formats),
                strict=True,
            )
        )
    state = "draft of report" if content.missing else "report"
    reason = f"{state} {content.report_id}"
    files = {kind: _bytes_of(one, key, reason, content.language) for kind, one in rendered.items()}
    written = []
    _make_folder(out)
    try:
        for kind, data in files.items():
            target = out / f"{name}.{kind}"
            unfinished = target.with_name(target.name + ".tmp")
            unfinished.write_bytes(data)
            unfinished.replace(target)
            written.append(target)
    except OSError as error:
        raise BadInput(
            f"the report cannot be written: {error.strerror}", file=out, remedy="choose another folder"
        ) from None
    return written


def _bytes_of(rendered: _Rendered, key: SigningKey | None, reason: str, language: Language) -> bytes:
    """Return a rendered report as it is written: the PDF signed, where there is a key."""
    if isinstance(rendered, bytes):
        return rendered
    if key is None:
        return rendered.pdf
    return signed(rendered.pdf, key, reason=reason, line=rendered.signing_line, language=language)
