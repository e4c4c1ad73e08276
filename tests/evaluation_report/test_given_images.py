"""The laboratory's mark and the photo of the specimen: on the first page, or refused with one message."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from PIL import Image as Pixels

from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content import Image
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import hand_made_document


def picture(path: Path, colour: tuple[int, int, int], size: tuple[int, int]) -> bytes:
    Pixels.new("RGB", size, colour).save(path)
    return path.read_bytes()


def test_both_stand_on_the_first_page_and_are_part_of_the_id(report: Made, tmp_path: Path) -> None:
    mark = picture(tmp_path / "mark.png", (200, 0, 0), (300, 100))
    photo = picture(tmp_path / "specimen.jpg", (0, 0, 200), (300, 400))
    file = tmp_path / "report.toml"
    file.write_text('mark = "mark.png"\nspecimen_photo = "specimen.jpg"\n', encoding="utf-8")
    (report.folder / "report.toml").write_bytes(file.read_bytes())
    for name, data in (("mark.png", mark), ("specimen.jpg", photo)):
        (report.folder / name).write_bytes(data)
    try:
        content = build_content(read_source(report.folder, hand_made_document()))
    finally:
        (report.folder / "report.toml").unlink()
    assert content.report_id != report.content.report_id
    assert content.photo is not None
    html = render_html(content, report.figures)
    for data, kind, words in (
        (mark, "png", "Mark of the laboratory"),
        (photo, "jpeg", "Photo of the specimen"),
    ):
        address = f"data:image/{kind};base64,{base64.b64encode(data).decode()}"
        assert f'src="{address}" alt="{words}"' in html
    first, second, *_ = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, report.figures)))
    assert reds_and_blues(first) == (True, True)
    assert reds_and_blues(second) == (False, False)
    for words in ("Authorised by", "approval of the laboratory."):
        assert words in re.sub(r"\s+", " ", first.get_textpage().get_text_range())
    other = replace(content, photo=replace(content.photo, data=content.photo.data + b"\0"))
    assert other.report_id != content.report_id


def reds_and_blues(page: pypdfium2.PdfPage) -> tuple[bool, bool]:
    """Say whether more than a square centimetre of a page has the colour of the mark, and of the photo."""
    pixels = np.asarray(page.render(scale=1.0).to_pil().convert("RGB")).astype(int)
    found = [np.abs(pixels - colour).max(axis=2) < 12 for colour in ((200, 0, 0), (0, 0, 200))]
    return bool(found[0].sum() > 800), bool(found[1].sum() > 800)


def test_none_is_no_picture() -> None:
    assert read_image("", "mark", "Mark") is None


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (None, "the picture cannot be read: No such file or directory"),
        (b"GIF89a", "the picture is neither PNG, JPEG nor SVG"),
        (b"\x89PNG\r\n\x1a\n" + b"\0" * 40, "the picture is damaged"),
        (b"\xff\xd8\xff" + b"\0" * 40, "the picture is damaged"),
        (b"\x89PNG\r\n\x1a\n" + b"\0" * 5_000_000, "the picture has 5.0 MB, more than 5 MB"),
    ],
)
def test_what_is_no_picture_is_refused_by_file_and_key(tmp_path: Path, data: bytes | None, said: str) -> None:
    file = tmp_path / "mark.png"
    if data is not None:
        file.write_bytes(data)
    with pytest.raises(BadInput, match=said) as refused:
        read_image(str(file), "mark", "Mark")
    assert "mark" in str(refused.value)
    assert file.name in str(refused.value)


def test_a_picture_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "specimen.jpg"
    data = picture(file, (10, 20, 30), (400, 400))
    file.write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match="the picture is damaged"):
        read_image(str(file), "specimen_photo", "Photo")


@pytest.mark.parametrize("sizes", [[(1600, 160)], [(1600, 160), (300, 300)], [(300, 300), (1600, 160)]])
def test_a_wide_mark_leaves_the_title_its_place(
    report: Made, tmp_path: Path, sizes: list[tuple[int, int]]
) -> None:
    given = [
        Image("mark", "png", picture(tmp_path / f"{n}.png", (200, 0, 0), one)) for n, one in enumerate(sizes)
    ]
    mark, accreditation = (*given, None)[:2]
    content = replace(report.content, mark=mark, accreditation=accreditation)
    page = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, report.figures)))[0]
    text = page.get_textpage()
    whole = text.get_text_range()
    first, last = (text.get_charbox(whole.index(word)) for word in ("Test report:", "characteristics"))
    assert first[3] - last[1] < 3 * 14.0, "two lines of 14 points"


SVG = '<svg xmlns="http://www.w3.org/2000/svg"{size}>{inside}</svg>'
SIZE = ' viewBox="0 0 300 100"'


def test_a_mark_may_be_a_drawing(report: Made, tmp_path: Path) -> None:
    file = tmp_path / "mark.svg"
    inside = '<defs><path id="p" d="M0 0H300V100H0Z"/></defs><use href="#p" fill="rgb(200,0,0)"/>'
    file.write_text(SVG.format(size=SIZE, inside=inside), encoding="utf-8")
    content = replace(report.content, mark=read_image(str(file), "mark", "Mark of the laboratory"))
    assert content.report_id != report.content.report_id
    data = base64.b64encode(file.read_bytes()).decode()
    assert f'src="data:image/svg+xml;base64,{data}"' in render_html(content, report.figures)
    first, *_ = pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, report.figures)))
    assert reds_and_blues(first) == (True, False)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<svg", "the drawing is not taken: it is no XML"),
        ('<!DOCTYPE svg SYSTEM "file:///etc/passwd">' + SVG.format(size=SIZE, inside=""), "a document type"),
        ("<svg/>", "the drawing is no SVG"),
        (SVG.format(size="", inside=""), "the drawing has no size"),
        (
            SVG.format(size=SIZE, inside="<text>A</text>"),
            "letters that need a font; convert the text to paths",
        ),
        (SVG.format(size=SIZE, inside='<image href="x.png"/>'), "a picture in it"),
        (SVG.format(size=SIZE, inside="<script>1</script>"), "a script"),
        (SVG.format(size=SIZE, inside='<path onclick="1" d=""/>'), "a script"),
        (SVG.format(size=SIZE, inside='<use href="https://example.org/x.svg#a"/>'), "from elsewhere"),
        (SVG.format(size=SIZE, inside="<style>@import url(x.css);</style>"), "from elsewhere"),
        (SVG.format(size=SIZE, inside='<path fill="url(x.svg#a)" d=""/>'), "from elsewhere"),
    ],
)
def test_a_drawing_that_needs_more_than_itself_is_refused(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "mark.svg"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape(said)) as refused:
        read_image(str(file), "mark", "Mark")
    assert (refused.value.file, refused.value.place) == (str(file), "mark")


def test_a_photo_in_the_colours_of_print_is_refused_and_a_grey_one_taken(tmp_path: Path) -> None:
    """The typesetter would refuse it as a PDF/A error of the laboratory's own template."""
    file = tmp_path / "photo.jpg"
    Pixels.new("CMYK", (30, 40), (0, 0, 0, 80)).save(file)
    with pytest.raises(BadInput, match=r"\(CMYK\).*save it in RGB"):
        read_image(str(file), "specimen_photo", "Photo")
    Pixels.new("L", (30, 40), 80).save(file)
    assert read_image(str(file), "specimen_photo", "Photo") is not None
