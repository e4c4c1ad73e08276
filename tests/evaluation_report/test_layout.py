"""The pages of the PDF against committed pictures: a moved block is seen, other letter rendering is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from tests.evaluation_report.layout import (
    DOTS_PER_INCH,
    TOLERANCE,
    Grey,
    contents,
    distance,
    references,
    rendered,
)

NAMES = ("campaign", "comparison")
_MOVED_MM = 4.0
_RENEW = "if that is meant: python -m tests.evaluation_report.layout --renew, and look at the pictures"


@pytest.fixture(scope="module")
def pdfs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    made = contents(tmp_path_factory.mktemp("layout"))
    return {
        name: render_pdf(content, [draw(picture.plot) for picture in content.pictures()])
        for name, content in made.items()
    }


@pytest.mark.parametrize("name", NAMES)
def test_the_pages_are_laid_out_as_in_the_references(
    pdfs: dict[str, bytes], name: str, tmp_path: Path
) -> None:
    pages, expected = rendered(pdfs[name]), references(name)
    far = [
        n for n, pair in enumerate(zip(pages, expected, strict=False), start=1) if distance(*pair) > TOLERANCE
    ]
    (tmp_path / f"{name}.pdf").write_bytes(pdfs[name])
    kept = f"the PDF is {tmp_path / name}.pdf; {_RENEW}"
    assert len(pages) == len(expected), f"{len(pages)} pages instead of {len(expected)}; {kept}"
    assert not far, f"pages {far} look otherwise; {kept}"


def moved(page: Grey) -> Grey:
    """Return a page with everything below its upper third a little lower."""
    down, third = round(_MOVED_MM * DOTS_PER_INCH / 25.4), page.shape[0] // 3
    out = page.copy()
    out[third + down :] = page[third : page.shape[0] - down]
    out[third : third + down] = 255.0
    return out


def test_a_block_moved_by_4_mm_is_seen_on_every_page_that_has_one(pdfs: dict[str, bytes]) -> None:
    seen = 0
    for name in NAMES:
        for page, expected in zip(rendered(pdfs[name]), references(name), strict=True):
            below = page[page.shape[0] // 3 : -40]
            if np.mean(below < 200.0) > 0.02:
                assert distance(moved(page), expected) > TOLERANCE
                seen += 1
    assert seen >= 10


def test_a_missing_figure_or_a_blank_page_is_seen(pdfs: dict[str, bytes]) -> None:
    for name in NAMES:
        for expected in references(name)[:-1]:
            assert distance(np.full_like(expected, 255.0), expected) > TOLERANCE


def test_another_rendering_of_letters_is_not_taken_for_another_layout(pdfs: dict[str, bytes]) -> None:
    for name in NAMES:
        pairs = zip(rendered(pdfs[name], finer=2), rendered(pdfs[name]), references(name), strict=True)
        for coarse, page, expected in pairs:
            heavier = 255.0 - np.minimum(255.0, (255.0 - page) * 1.2)
            assert distance(coarse, expected) < TOLERANCE
            assert distance(heavier, expected) < TOLERANCE
