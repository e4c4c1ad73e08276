"""What a signature shows: above the line of who authorises, and nothing else of the page is another."""

from __future__ import annotations

import io

import numpy as np
import pikepdf
import pypdfium2
import pytest
from numpy.typing import NDArray

from bufferstand.evaluation.report.content import SigningLine
from bufferstand.evaluation.report.rendering import typeset_pdf
from bufferstand.evaluation.report.signing import open_key, signed
from bufferstand.evaluation.report.signing.appearance import drawing
from bufferstand.evaluation.wording import LANGUAGES, Language
from tests.evaluation_report import keys
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.signed_reports import SignedReport

DOTS_A_POINT = 2


def first_page(pdf: bytes) -> NDArray[np.float64]:
    """Return the first page as grey values, with what its form fields show."""
    document = pypdfium2.PdfDocument(pdf)
    document.init_forms()
    page = document[0].render(scale=DOTS_A_POINT, may_draw_forms=True).to_numpy()
    document.close()
    return page.astype(np.float64).mean(axis=2)


def test_the_line_is_where_the_words_below_it_are(report: Made) -> None:
    line = typeset_pdf(report.content, report.figures).signing_line
    assert line is not None
    document = pypdfium2.PdfDocument(report.pdf)
    text = document[0].get_textpage()
    left, bottom, _, top = text.get_charbox(text.get_text_range().index("Authorised by"))
    document.close()
    assert line.page == 1
    assert line.left_pt == pytest.approx(left, abs=2.0)
    assert top < line.foot_pt < bottom + 20.0
    assert line.right_pt - line.left_pt == pytest.approx((210 - 36 - 16) / 3 / 25.4 * 72, abs=0.5)


def test_the_signature_shows_above_the_line_and_nowhere_else(sealed: SignedReport) -> None:
    line = sealed.line
    assert line is not None
    plain, shown = first_page(sealed.plain), first_page(sealed.signed)
    differs = np.argwhere(np.abs(plain - shown) > 32.0) / DOTS_A_POINT
    height_pt = plain.shape[0] / DOTS_A_POINT
    assert len(differs) > 200, "letters that can be seen"
    left, foot, right, top = line.box
    assert differs[:, 1].min() >= left - 1
    assert differs[:, 1].max() <= right + 1
    assert differs[:, 0].min() >= height_pt - top - 1
    assert differs[:, 0].max() <= height_pt - foot + 1


@pytest.mark.parametrize("name", ["Zkušebna nárazníků, doc. Ing. Jana Nováková, Ph.D.", "缓冲器"])
def test_a_long_name_is_set_smaller_and_one_that_cannot_be_drawn_left_out(
    sealed: SignedReport, tmp_path_factory: pytest.TempPathFactory, name: str
) -> None:
    line = sealed.line
    assert line is not None
    key = keys.make(tmp_path_factory.mktemp("key"), name)
    with open_key(str(key.p12), lambda: keys.PASSWORD) as opened:
        pdf = signed(sealed.plain, opened, line=line)
    differs = np.argwhere(np.abs(first_page(sealed.plain) - first_page(pdf)) > 32.0) / DOTS_A_POINT
    assert differs[:, 1].max() <= line.box[2] + 1
    assert (len(drawing(name, 150.0)) > 2 * len(drawing("", 150.0))) is name.startswith("Z")


def test_without_a_line_it_is_on_no_page(sealed: SignedReport) -> None:
    with open_key(str(sealed.key.p12), lambda: keys.PASSWORD) as opened:
        pdf = signed(sealed.plain, opened)
    with pikepdf.open(io.BytesIO(pdf)) as document:
        (field,) = document.Root.AcroForm.Fields
        assert [float(number) for number in field.Rect] == [0.0, 0.0, 0.0, 0.0]


def test_the_box_lies_above_the_line() -> None:
    assert SigningLine(1, 100.0, 250.0, 200.0).box == (100, 201, 250, 227)


def test_what_it_shows_is_in_the_language_of_the_report() -> None:
    own = {code: drawing("", 150.0, Language(code)) for code in LANGUAGES}
    assert own["en"] == drawing("", 150.0)
    assert len(set(own.values())) == len(LANGUAGES)
