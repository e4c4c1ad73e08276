"""The verdict of the first page stays on one line with its symbol, however long its word is."""

from __future__ import annotations

import io

import pypdfium2
import pytest

from bufferstand.evaluation.report.content import Cell, Content, Sheet, VerdictLine
from bufferstand.evaluation.report.rendering.pdf import render_pdf


@pytest.mark.parametrize("words", ["✓ pass", "◇ unentschieden", "◇ a very long verdict of another language"])
def test_a_long_verdict_is_set_smaller(words: str) -> None:
    line = VerdictLine(Cell(words, "open"), "static test", "Nothing failed.", ("a",))
    content = Content("t", "s", (), (), Sheet("", ()), (), "", "x", certificate=(line,))
    text = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, ())))[0].get_textpage()
    found = text.get_text_range().replace("\xa0", " ")
    at = found.index(words)
    first, last = (text.get_charbox(place) for place in (at + 2, at + len(words) - 1))
    assert abs(first[1] - last[1]) < 4.0
