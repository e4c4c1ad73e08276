"""The first page holds in every language with all that a laboratory can state; hashes can be searched for."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from datetime import date

import pypdfium2
import pytest
from PIL import Image as Pixels

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content import SigningLine
from bufferstand.evaluation.report.rendering.pdf import render_pdf, typeset_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.wording import LANGUAGES, Code, language_of
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_rendering import pages, squeezed

FULL = ReportFields(
    laboratory="Test hall 2 of the institute for rolling stock",
    laboratory_address="Studentská 95, Zelené Předměstí, 532 10 Pardubice, Czech Republic",
    place_of_test="Pardubice, hall 2, stand of 630 kN beside the north gate",
    customer="Wagon works of Poprad and Košice, department of draw and buffing gear",
    customer_address="Štefánikova 1, 058 01 Poprad, Slovak Republic",
    method="EN 15551:2022, procedure P-7 rev. 3 of the laboratory, with deviations as stated",
    received=date(2026, 2, 20),
    issued=date(2026, 12, 9),
    tested_by="Ing. Jaroslav Novák",
    checked_by="Ing. Kateřina Veselá",
    authorised_by="doc. Ing. Petr Vágner, Ph.D.",
    specimen_condition="new, undamaged, painted grey, with its transport lock taken off",
    sampling="every 50th of the lot, by the customer",
    accreditation_number="L 1234",
    amends="BR-000000000000",
    amends_issued=date(2026, 3, 1),
    amendment_reason="serial number of the specimen and date of its assembly corrected by the customer",
    amendment_changes=("Serial number 0815 instead of 0816.",),
)
LIMITS = {
    "edition": None,
    "clause": None,
    "source": "paper “Stiffness characteristics of railway buffers”, Table 3",
}
"""What makes a report a draft that says so at length, as with a shipped limit set."""


@dataclass(frozen=True)
class FullReport:
    pages: list[str]
    line: SigningLine | None


def unreferenced(source: ReportSource) -> ReportSource:
    """Return the source with requirements of no edition and no clause on record."""
    runs = []
    for run in source.runs:
        requirements = [row | LIMITS for row in run.evaluated.get("requirements") or ()]
        runs.append(replace(run, evaluated={**run.evaluated, "requirements": requirements}))
    return replace(source, runs=tuple(runs))


@pytest.fixture(scope="module", params=LANGUAGES)
def full(
    request: pytest.FixtureRequest, report: Made, tmp_path_factory: pytest.TempPathFactory
) -> FullReport:
    folder = tmp_path_factory.mktemp("images")
    images = {}
    for name, size in (("mark", (900, 300)), ("photo", (300, 400)), ("accreditation", (300, 300))):
        Pixels.new("RGB", size, (0, 0, 200)).save(folder / f"{name}.png")
        images[name] = read_image(str(folder / f"{name}.png"), name, name)
    code: Code = request.param
    source = replace(
        unreferenced(report.source), fields=FULL, language=language_of(code, "Europe/Prague"), **images
    )
    content = build_content(source)
    made = typeset_pdf(content, [draw(one.plot, content.language) for one in content.pictures()])
    assert content.certificate[-1].items  # type: ignore[union-attr] - the sentence on what the results relate to
    last = squeezed(content.certificate[-1].items[0])  # type: ignore[union-attr]
    assert last in squeezed(pages(made.pdf)[0]), f"{code}: the first page is more than one"
    return FullReport([squeezed(page) for page in pages(made.pdf)], made.signing_line)


def test_all_of_the_first_page_is_on_it(full: FullReport) -> None:
    first, second = full.pages[:2]
    for words in (FULL.authorised_by, FULL.customer_address, FULL.sampling, FULL.method):
        assert squeezed(words) in first
    assert squeezed(FULL.authorised_by) not in second


def test_the_line_to_sign_on_is_where_it_is_printed(full: FullReport) -> None:
    assert full.line is not None
    assert full.line.page == 1
    # It ends where the text area does (margin 18 mm), at whatever size the page is set.
    assert abs(full.line.right_pt - (595.28 - 18.0 / 25.4 * 72.0)) < 1.0
    assert 100.0 < full.line.right_pt - full.line.left_pt < 180.0
    assert 60.0 < full.line.foot_pt < 150.0


def test_a_hash_and_a_file_name_are_found_in_the_text_of_the_pdf(report: Made) -> None:
    long = replace(
        report.source.runs[0], file="a-rather-long-folder/with-runs-of-one-specimen/001-static-5mm_s.h5"
    )
    content = build_content(replace(report.source, runs=(long, *report.source.runs[1:])))
    pdf = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, report.figures)))
    text = "\n".join(page.get_textpage().get_text_range() for page in pdf)
    assert "\u200b" not in text
    for run in report.source.runs:
        assert run.sha256 in text  # in one piece, as one searches for it
    assert long.file in text.replace("\r\n", "")
