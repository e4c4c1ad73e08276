"""The report as PDF, set by typst from the same content as JSON: data never become markup."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.ft2font import FT2Font

from bufferstand.evaluation.report.content import (
    SUBSCRIPTED,
    UNBROKEN,
    Attachment,
    Content,
    SigningLine,
    VerdictLine,
    moment_of,
)
from bufferstand.evaluation.report.rendering.frame import frame_words
from bufferstand.evaluation.report.rendering.overridden_typst import (
    TYPST,
    TYPST_BLOCKS,
    lay_out,
    typst_hides_statement,
    typst_refusal,
    typst_warned,
)
from bufferstand.evaluation.report.rendering.statement_shown import DOTS_PER_INCH, statement_shown
from bufferstand.foundation import BadInput, how_to_add

_FONTS = Path(mpl.get_data_path()) / "fonts" / "ttf"
_OPTIONS: Mapping[str, Any] = {"font_paths": [str(_FONTS)], "ignore_system_fonts": True}
_TEMPLATES = ("report.typ", "prose.typ")
_A4_HEIGHT_PT = 297.0 / 25.4 * 72.0
_A_FEW_LINES = 0.36
"""A last page that ends above this share of its height holds little: set closer, a report may do without."""
_UNKNOWN_DATE = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class TypesetReport:
    """A report as PDF, and where it is signed (None where it has no lines for that)."""

    pdf: bytes
    signing_line: SigningLine | None


def render_pdf(content: Content, figures: Sequence[str], attachments: Sequence[Attachment] = ()) -> bytes:
    """Return the report as PDF: :func:`typeset_pdf` without where it is signed."""
    return typeset_pdf(content, figures, attachments).pdf


def typeset_pdf(
    content: Content, figures: Sequence[str], attachments: Sequence[Attachment] = ()
) -> TypesetReport:
    """Return the report as PDF/A-3b (ISO 19005-3).

    Parameters
    ----------
    content : Content
        What the report says.
    figures : sequence of str
        The figures as SVG text, in the order of their numbers.
    attachments : sequence of Attachment
        Files that it has inside.

    Returns
    -------
    TypesetReport
        The same bytes for the same content: its date is the end of the last run.

    Raises
    ------
    BadInput
        If typst is not installed, the font lacks a letter (it would be printed as a box), or the laboratory's
        own template is none, with its file and line, or hides the statement of the first page.
    RuntimeError
        If the typesetter warns or fails.
    """
    try:
        import typst  # noqa: PLC0415
    except ImportError:
        raise BadInput(
            "the PDF report needs typst, which is not installed",
            remedy=f"install it ({how_to_add('pdf')}), or write the HTML report only",
        ) from None
    with tempfile.TemporaryDirectory(prefix="bufferstand-report-") as name:
        _put(content, figures, attachments, Path(name))
        try:
            source = Path(name) / "report.typ"
            made = _set(typst, source, content.ended)
            if made.ends_on > 1 and made.ends_at < _A_FEW_LINES:
                closer = _set(typst, source, content.ended, closer="yes")
                made = closer if closer.ends_on < made.ends_on else made
            compiler, pdf = made.compiler, made.pdf
            ends = json.loads(compiler.query("<signing-line>", field="value"))
            hidden = _may_hide(content) and not _shows_statement(compiler)
        except typst.TypstError as error:
            raise typst_refusal(content.template, error) from error
    if made.warnings:
        raise typst_warned(content.template, made.warnings)
    if hidden:
        raise typst_hides_statement(content.template)
    if not isinstance(pdf, bytes):
        raise RuntimeError(f"typst returned {type(pdf).__name__} instead of one document")
    return TypesetReport(pdf, _signing_line(ends))


@dataclass(frozen=True)
class _Set:
    """A report as the typesetter set it, and where it ends: the page, and how far down it [share]."""

    compiler: Any
    pdf: Any
    warnings: Sequence[Any]
    ends_on: int
    ends_at: float


def _set(typst: Any, source: Path, ended: str, **inputs: str) -> _Set:
    """Set a report; with ``closer`` among the inputs, in less room."""
    compiler = typst.Compiler(str(source), root=str(source.parent), sys_inputs=inputs, **_OPTIONS)
    pdf, warnings = compiler.compile_with_warnings(
        timestamp=(moment_of(ended) or _UNKNOWN_DATE).replace(microsecond=0),
        format="pdf",
        pdf_standards="a-3b",
    )
    places = json.loads(compiler.query("<end-of-report>", field="value"))
    if not places:  # a laboratory's own template may leave it out
        return _Set(compiler, pdf, warnings, 1, 1.0)
    down = float(places[-1]["y"].removesuffix("pt")) / _A4_HEIGHT_PT
    return _Set(compiler, pdf, warnings, int(places[-1]["page"]), down)


def _may_hide(content: Content) -> bool:
    """Say whether a template that is not ours sets a statement."""
    own = content.template is not None and content.template.text(TYPST) is not None
    return own and any(isinstance(block, VerdictLine) for block in content.certificate)


def _shows_statement(compiler: Any) -> bool:
    corners = json.loads(compiler.query("<statement>", field="value"))
    drawn = compiler.compile(format="png", ppi=DOTS_PER_INCH)
    return statement_shown(corners, [drawn] if isinstance(drawn, bytes) else drawn)


def _put(content: Content, figures: Sequence[str], attachments: Sequence[Attachment], folder: Path) -> None:
    """Write what the typesetter reads into a folder."""
    inside = {f"attached-{number}": one for number, one in enumerate(attachments, start=1)}
    said = content.document() | {
        "unbroken": UNBROKEN,
        "subscripted": SUBSCRIPTED,
        "words": frame_words(content.language),
        "language": content.language.code,
        "overridable": list(TYPST_BLOCKS),
        "attached": _attached(inside),
    }
    document = json.dumps(said, ensure_ascii=False, sort_keys=True)
    _check_letters(document)
    templates = files("bufferstand.evaluation.report.rendering").joinpath("templates")
    for name in _TEMPLATES:
        template = templates.joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(template, encoding="utf-8", newline="\n")
    (folder / "report.json").write_text(document, encoding="utf-8", newline="\n")
    lay_out(content.template, folder)
    for given, image in content.given().items():
        (folder / f"{given}.{image.suffix}").write_bytes(image.data)
    for place, attachment in inside.items():
        (folder / place).write_bytes(attachment.data)
    for number, svg in enumerate(figures, start=1):
        (folder / f"figure-{number}.svg").write_text(svg, encoding="utf-8", newline="\n")


def _signing_line(ends: Sequence[Mapping[str, Any]]) -> SigningLine | None:
    if len(ends) != 2:  # a laboratory's own template may have other lines to sign on
        return None
    left, right = ends
    x_left, x_right, y, height = (
        float(text.removesuffix("pt")) for text in (left["x"], right["x"], left["y"], left["height"])
    )
    return SigningLine(int(left["page"]), x_left, x_right, height - y)


def _attached(inside: Mapping[str, Attachment]) -> list[dict[str, str]]:
    return [
        {"file": place, "name": one.name, "description": one.description, "media_type": one.media_type}
        for place, one in inside.items()
    ]


def _check_letters(document: str) -> None:
    """Refuse a letter that the font lacks; typst would put a box in its place without a word."""
    known = FT2Font(str(_FONTS / "DejaVuSans.ttf")).get_charmap()
    if lacking := sorted(
        {letter for letter in document if ord(letter) not in known and not letter.isspace()}
    ):
        named = ", ".join(f"“{letter}” (U+{ord(letter):04X})" for letter in lacking[:5])
        raise BadInput(
            f"the PDF report’s font has no {named}",
            remedy="write the HTML report only, or spell the name in Latin, Greek or Cyrillic letters",
        )
