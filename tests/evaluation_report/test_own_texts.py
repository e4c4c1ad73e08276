"""Introduction, appendices, photos and the accreditation's mark: in both files, as data; or one message."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pypdfium2
import pytest
from PIL import Image as Pixels

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import read_fields
from bufferstand.evaluation.report.source.own_text import read_own_text
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import hand_made_document

INTRODUCTION = """# Why this was tested

The wagon works asked for *damping* and **stiffness** at `12 kN/mm`, see [the norm](https://example.org/n?a=1&b=2).

## Scope

1. first 3 mm/s
2. then
   - faster,
   - slower \\
     and again

> As agreed on the telephone.
"""
APPENDIX = """# Drawings & plans

| part | mass |
|------|------|
| \\<pot> | 3.5 kg |
| *lid* | 2 kg |

![The specimen in \\<the> stand](stand.png)

```
#let x = 1
```
---
"""


def picture(path: Path, colour: tuple[int, int, int], size: tuple[int, int]) -> None:
    Pixels.new("RGB", size, colour).save(path)


@pytest.fixture(scope="module")
def own(report: Made, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, list[str], str]:
    """HTML, the text of the PDF's pages, and the report's id."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "intro.markdown").write_text(INTRODUCTION, "utf-8")
    (folder / "drawings.markdown").write_text(APPENDIX, "utf-8")
    (folder / "plain.markdown").write_text("Only a sentence.\n", "utf-8")
    for name, colour in (("stand.png", (0, 90, 0)), ("set-up.jpg", (90, 0, 0)), ("ilac.png", (0, 0, 90))):
        picture(folder / name, colour, (300, 200))
    (folder / "report.toml").write_text(
        'introduction = "intro.markdown"\nappendices = ["drawings.markdown", "plain.markdown"]\n'
        'setup_photo = "set-up.jpg"\n'
        'accreditation_mark = "ilac.png"\naccreditation_number = "L 1234"\n',
        "utf-8",
    )
    source = read_source(
        report.folder, hand_made_document(), Given(fields=read_fields(folder / "report.toml"))
    )
    content = build_content(source)
    figures = [draw(one.plot) for one in content.pictures()]
    pages = [
        page.get_textpage().get_text_range()
        for page in pypdfium2.PdfDocument(io.BytesIO(render_pdf(content, figures)))
    ]
    return render_html(content, figures), pages, content.report_id


def test_the_introduction_stands_before_the_results_and_the_appendices_last(
    own: tuple[str, list[str], str],
) -> None:
    html, pages, _ = own
    headings = re.findall(r"<h2>(.*?)</h2>", html)
    assert headings[0] == "Why this was tested"
    assert headings[-2:] == ["Appendix 1: Drawings &amp; plans", "Appendix 2"]
    assert "Why this was tested" in pages[1]
    whole = "".join(pages)
    assert (
        whole.index("Annex") < whole.index("Appendix 1: Drawings & plans") < whole.index("Only a sentence.")
    )


def test_markdown_is_set_and_everything_else_is_text(own: tuple[str, list[str], str]) -> None:
    html, pages, _ = own
    for piece in (
        "<em>damping</em>",
        "<strong>stiffness</strong>",
        '<code><span class="kept">12 kN/mm</span></code>',
        '<a href="https://example.org/n?a=1&amp;b=2">the norm</a>',
        "<h3>Scope</h3>",
        '<ol start="1">',
        "<br>and again",
        "<blockquote>",
        "<td>&lt;pot&gt;</td>",
        'alt="The specimen in &lt;the&gt; stand"',
        "<hr>",
    ):
        assert piece in html, piece
    whole = re.sub(r"\s+", " ", " ".join(pages))
    for words in (
        "damping and stiffness at 12 kN/mm",
        "<pot>",
        "#let x = 1",
        "The specimen in <the> stand",
        "2. then",
    ):
        assert words in whole, words


def test_photo_and_mark_are_in_both_files_and_the_number_once(own: tuple[str, list[str], str]) -> None:
    html, pages, _ = own
    assert html.count('<figure class="own">') == 2
    assert html.count('<img class="mark"') == 1
    assert "Accreditation" in pages[0]
    assert "".join(pages).count("L 1234") == html.count("L 1234") == 1
    assert "The specimen in the stand." in "".join(pages)


def test_they_are_part_of_the_id(report: Made, own: tuple[str, list[str], str]) -> None:
    assert own[2] != report.content.report_id


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a\n\n<script>x</script>\n", "line 3: HTML is not taken"),
        ("a <b>c</b>\n", "line 1: HTML is not taken (<b>)"),
        (
            "a\n\n![far](https://example.org/a.png)\n",
            "line 3: the picture https://example.org/a.png is elsewhere",
        ),
        ("![far](//example.org/a.png)\n", "line 1: the picture //example.org/a.png is elsewhere"),
        ("![data](data:image/png;base64,AA)\n", "is elsewhere"),
        ("![](a.png)\n", "line 1: a picture without a caption"),
        ("![none]()\n", "line 1: a picture without a file"),
        ("words ![x](a.png)\n", "line 1: a picture within a line"),
        ("![lost](a.png)\n", "line 1: a.png: the picture cannot be read: No such file"),
        ("[x](javascript:alert)\n", "leads nowhere"),
        ("[x](notes.markdown)\n", "line 1: the link to “notes.markdown” leads nowhere"),
        ("a\n\n# two\n", "line 3: a heading “#” that is not the first line"),
        ("a\n\n#### four\n", "line 3: a heading “####”"),
        ("# only\n", "there is no text in it"),
        ("\n", "there is no text in it"),
        (">" * 40 + " deep\n", "deep"),
    ],
)
def test_what_a_report_does_not_take_is_refused_by_file_and_line(
    tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "intro.markdown"
    file.write_text(text, "utf-8")
    with pytest.raises(BadInput, match=re.escape(said)) as refused:
        read_own_text(str(file))
    assert str(refused.value).startswith(str(file))


def test_a_text_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such file"):
        read_own_text(str(tmp_path / "intro.markdown"))
    (tmp_path / "intro.markdown").write_bytes(b"\xff\xfe")
    with pytest.raises(BadInput, match="not UTF-8"):
        read_own_text(str(tmp_path / "intro.markdown"))


def test_a_mark_of_accreditation_without_its_number_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "report.toml"
    file.write_text('accreditation_mark = "ilac.png"\n', "utf-8")
    with pytest.raises(BadInput, match=r"accreditation_mark: .*not shown without its number"):
        read_fields(file)
