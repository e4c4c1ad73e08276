"""The report as PDF, set by typst from the same content as JSON: data never become markup."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path

import matplotlib as mpl

from evaluation.report.content import Content
from evaluation.report.numbers import moment_of
from foundation.errors import BadInput

_UNKNOWN_DATE = datetime(1970, 1, 1, tzinfo=UTC)


def render_pdf(content: Content, figures: Sequence[str]) -> bytes:
    """Return the report as PDF.

    Parameters
    ----------
    content : Content
        What the report says.
    figures : sequence of str
        The figures as SVG text, in the order of their numbers.

    Returns
    -------
    bytes
        The same bytes for the same content: its date is the end of the last run.

    Raises
    ------
    BadInput
        If typst is not installed.
    RuntimeError
        If the typesetter warns or fails: a report with a missing letter must not go out.
    """
    try:
        import typst  # noqa: PLC0415 - an optional extra
    except ImportError:
        raise BadInput(
            "the PDF report needs typst, which is not installed",
            remedy="install the extra: pip install 'bufferstand[pdf]', or write the HTML report only",
        ) from None
    with tempfile.TemporaryDirectory(prefix="bufferstand-report-") as name:
        folder = Path(name)
        template = files("evaluation.report").joinpath("templates", "report.typ").read_text(encoding="utf-8")
        (folder / "report.typ").write_text(template, encoding="utf-8")
        document = json.dumps(content.document(), ensure_ascii=False, sort_keys=True)
        (folder / "report.json").write_text(document, encoding="utf-8")
        for number, svg in enumerate(figures, start=1):
            (folder / f"figure-{number}.svg").write_text(svg, encoding="utf-8")
        try:
            pdf, warnings = typst.compile_with_warnings(
                str(folder / "report.typ"),
                root=str(folder),
                font_paths=[str(Path(mpl.get_data_path()) / "fonts" / "ttf")],
                ignore_system_fonts=True,
                timestamp=(moment_of(content.ended) or _UNKNOWN_DATE).replace(microsecond=0),
                format="pdf",
            )
        except typst.TypstError as error:
            raise RuntimeError(f"typst could not set the report: {error.message}") from error
    if warnings:
        raise RuntimeError("typst warned: " + "; ".join(str(warning.message) for warning in warnings))
    if not isinstance(pdf, bytes):
        raise RuntimeError(f"typst returned {type(pdf).__name__} instead of one document")
    return pdf
