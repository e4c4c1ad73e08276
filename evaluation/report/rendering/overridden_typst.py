"""An own template of the PDF report: what it may override, and messages with file and line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bufferstand.evaluation.report.content import OwnTemplate
from bufferstand.evaluation.report.rendering.overridden_html import HOW
from bufferstand.foundation import BadInput

TYPST = "report.typ"
TYPST_BLOCKS = ("style", "page-header", "page-footer", "top", "identification", "end")
"""What an own template may put in the place of the shipped; documented in own-report-template.md."""
_FOLDER = "own"
"""Of the own files, beside the shipped template while a report is set."""
_NO_BLOCKS = "#let blocks = (:)\n"
_AT = re.compile(r"┌─ .*?own/report\.typ:(\d+):")
_PACKAGE = re.compile(r"[\"']@[\w-]+/")


def lay_out(own: OwnTemplate | None, folder: Path) -> None:
    """Put the own files where the shipped typst template looks for them; without one, an empty one.

    Raises
    ------
    BadInput
        If it names a package, which typst would load from elsewhere.
    """
    place = folder / _FOLDER
    place.mkdir()
    text = None if own is None else own.text(TYPST)
    if own is not None and text is not None:
        for number, line in enumerate(text.splitlines(), start=1):
            if _PACKAGE.search(line):
                raise _refused(own.folder / TYPST, number, "it loads a package from elsewhere")
    (place / TYPST).write_text(_NO_BLOCKS if text is None else text, encoding="utf-8", newline="\n")
    for one in own.pictures() if own is not None else ():
        (place / one.name).write_bytes(one.data)


def typst_refusal(own: OwnTemplate | None, error: Any) -> Exception:
    """Return what to raise when typst fails: the own template's message with its line, or a fault of ours."""
    said = str(error.message)
    if own is not None and own.text(TYPST) is not None:
        places = _AT.findall(str(error.diagnostic))
        if places:
            return _refused(own.folder / TYPST, int(places[0]), said)
        if said == "unresolved import":
            return _refused(own.folder / TYPST, 1, "it does not define “blocks”")
        _, marked, told = said.partition("own template: ")
        if marked:
            return _refused(own.folder / TYPST, None, told.rstrip('"'))
        # Without it the shipped template sets every report: what fails with it is what it makes of a block.
        return _refused(own.folder / TYPST, None, said)
    return RuntimeError(f"typst could not set the report: {said}")


def typst_warned(own: OwnTemplate | None, warnings: Sequence[Any]) -> Exception:
    """Return what to raise when typst warns."""
    said = "; ".join(str(warning.message) for warning in warnings)
    if own is not None and own.text(TYPST) is not None:
        places = [place for warning in warnings for place in _AT.findall(str(warning.diagnostic))]
        return _refused(own.folder / TYPST, int(places[0]) if places else None, said)
    return RuntimeError(f"typst warned: {said}")


def typst_hides_statement(own: OwnTemplate | None) -> BadInput:
    """Return what to raise when an own template hides the statement of the first page."""
    assert own is not None
    return BadInput(
        "with it the first page does not show the statement: verdict and reason",
        file=own.folder / TYPST,
        remedy=f"let “style” show all of what is shipped, in a colour that stands out; {HOW}",
    )


def _refused(file: Path, line: int | None, problem: str) -> BadInput:
    return BadInput(problem, file=file, place="" if line is None else f"line {line}", remedy=HOW)
