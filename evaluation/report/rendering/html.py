"""The report as one HTML file: no script, no request, readable on a screen, a phone and on paper."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence

from jinja2 import PackageLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment
from markupsafe import Markup, escape

from bufferstand.evaluation.report.content import SUBSCRIPTED, UNBROKEN, Content
from bufferstand.evaluation.report.rendering.frame import frame_words
from bufferstand.evaluation.report.rendering.overridden_html import (
    own_loader,
    picture_addresses,
    template_name,
    told_by_line,
)

_UNBROKEN = re.compile(UNBROKEN)
_SUBSCRIPTED = re.compile(SUBSCRIPTED)
_BRACES = re.compile(r"\{\w+\}")


def render_html(content: Content, figures: Sequence[str]) -> str:
    """Return the report as HTML text.

    Parameters
    ----------
    content : Content
        What the report says.
    figures : sequence of str
        The figures as SVG text, in the order of their numbers. Each becomes an image of its own (a data
        address), because matplotlib's ids would collide if they shared one document.

    Returns
    -------
    str
        The same text for the same content.

    Raises
    ------
    BadInput
        If the laboratory's own template is none, with its file and line.
    """
    shipped = PackageLoader("bufferstand.evaluation.report.rendering", "templates")
    # A template of the laboratory's own sees the report, and nothing of the machine.
    environment = ImmutableSandboxedEnvironment(
        loader=own_loader(shipped, content.template),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["kept"] = kept
    environment.filters["filled"] = filled
    images = ["data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode() for svg in figures]
    types = {"png": "image/png", "jpg": "image/jpeg", "svg": "image/svg+xml"}
    given = {
        name: f"data:{types[image.suffix]};base64," + base64.b64encode(image.data).decode()
        for name, image in content.given().items()
    }
    style, _, _ = shipped.get_source(environment, "report.css")
    own_style = None if content.template is None else content.template.text("report.css")
    name = template_name(environment, content.template)
    with told_by_line(content.template):
        # Style sheets are the program's and the laboratory's, not data: they must not be escaped.
        return environment.get_template(name).render(
            report=content.document(),
            words=frame_words(content.language),
            language=content.language.code,
            images=images,
            given=given,
            own=picture_addresses(content.template),
            style=Markup(style + (own_style or "")),
        )


def filled(words: str, *parts: object) -> Markup:
    """Return words with what a template puts into their braces, in their order."""
    pieces = _BRACES.split(words)
    out = [escape(pieces[0])]
    for part, piece in zip(parts, pieces[1:], strict=True):
        out += [escape(part), escape(piece)]
    return Markup("").join(out)


def kept(text: str) -> Markup:
    """Return text for HTML with subscripts, in which no line is broken within a number and its unit."""
    pieces, end = [], 0
    for found in _UNBROKEN.finditer(text):
        pieces += [
            _set(text[end : found.start()]),
            Markup('<span class="kept">{}</span>').format(_set(found[0])),
        ]
        end = found.end()
    return Markup("").join([*pieces, _set(text[end:])])


def _set(text: str) -> Markup:
    """Return text with the subscripts of its symbols."""
    return Markup(_SUBSCRIPTED.sub(_with_subscript, str(escape(text))))


def _with_subscript(found: re.Match[str]) -> str:
    symbol, index = found[0].split("_")
    return f"{symbol}<sub>{index}</sub>"
