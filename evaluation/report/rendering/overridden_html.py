"""An own template of the HTML report: what it may override, and messages with file and line."""

from __future__ import annotations

import base64
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jinja2 import BaseLoader, ChoiceLoader, DictLoader, Environment, PrefixLoader, TemplateError, nodes
from jinja2.exceptions import TemplateSyntaxError

from bufferstand.evaluation.report.content import OwnTemplate
from bufferstand.foundation import BadInput

HTML = "report.html.j2"
HTML_BLOCKS = ("style", "top", "identification", "contents", "end")
"""What an own template may put in the place of the shipped; documented in own-report-template.md."""
HOW = "see the page “A report template of your own” (docs/how-to/own-report-template.md)"
_SHIPPED = "bufferstand"
_OWN = f"own/{HTML}"


def own_loader(shipped: BaseLoader, own: OwnTemplate | None) -> BaseLoader:
    """Return a loader that finds the shipped templates, also below ``bufferstand/``, and the own one."""
    text = None if own is None else own.text(HTML)
    below = PrefixLoader({_SHIPPED: shipped})
    return ChoiceLoader([below, shipped] if text is None else [below, DictLoader({_OWN: text}), shipped])


def template_name(environment: Environment, own: OwnTemplate | None) -> str:
    """Return the template to render: the shipped one, or the own one, when it has what one needs.

    Raises
    ------
    BadInput
        With the line of the own one: if it is no template, does not extend the shipped one, or has a block
        that the shipped one has not.
    """
    text = None if own is None else own.text(HTML)
    if own is None or text is None:
        return HTML
    file = own.folder / HTML
    try:
        tree = environment.parse(text)
    except TemplateSyntaxError as error:
        raise _refused(file, error.lineno, error.message or "no template") from None
    extended = [
        node.template.value
        for node in tree.find_all(nodes.Extends)
        if isinstance(node.template, nodes.Const) and isinstance(node.template.value, str)
    ]
    if extended != [f"{_SHIPPED}/{HTML}"]:
        raise _refused(file, 1, f'it does not begin with {{% extends "{_SHIPPED}/{HTML}" %}}')
    for block in tree.find_all(nodes.Block):
        if block.name not in HTML_BLOCKS:
            known = ", ".join(HTML_BLOCKS)
            raise _refused(
                file, block.lineno, f"there is no block “{block.name}” to override; there are {known}"
            )
    return _OWN


@contextmanager
def told_by_line(own: OwnTemplate | None) -> Iterator[None]:
    """Turn what goes wrong in an own HTML template into a message with its line.

    Raises
    ------
    BadInput
        In place of any error of an own template.
    """
    try:
        yield
    except Exception as error:
        if own is None or own.text(HTML) is None:
            raise
        frames = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if _is_own(frame.filename) or frame.filename.endswith(".j2")
        ]
        if not frames or not _is_own(frames[-1].filename):
            raise  # a fault of the shipped template, or of the program
        what = error.message if isinstance(error, TemplateError) else f"{type(error).__name__}: {error}"
        raise _refused(own.folder / HTML, frames[-1].lineno or 1, str(what)) from None


def _is_own(filename: str) -> bool:
    """Say whether a line is one of the own template, which jinja has as a text without a file."""
    return filename in {_OWN, "<template>"}


def picture_addresses(own: OwnTemplate | None) -> dict[str, str]:
    """Return the pictures of an own template as data addresses, by file name."""
    types = {".png": "image/png", ".jpg": "image/jpeg"}
    return {
        one.name: f"data:{types[Path(one.name).suffix]};base64," + base64.b64encode(one.data).decode()
        for one in (own.pictures() if own is not None else ())
    }


def _refused(file: Path, line: int, problem: str) -> BadInput:
    return BadInput(problem, file=file, place=f"line {line}", remedy=HOW)
