"""A template of the laboratory's own: what docs/how-to/own-report-template.md says and shows, done."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pypdfium2
import pytest
from jinja2 import UndefinedError
from PIL import Image as Pixels

from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.overridden_html import HTML_BLOCKS
from bufferstand.evaluation.report.rendering.overridden_typst import TYPST_BLOCKS
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import read_fields
from bufferstand.evaluation.report.source.own_template import read_own_template
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "own-report-template.md").read_text(encoding="utf-8")


def shown(language: str) -> str:
    (code,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(code)


@pytest.fixture(scope="module")
def short(report: Made) -> Content:
    """A report of few sections, without figures."""
    return replace(
        report.content, sections=report.content.sections[:2], certificate=report.content.certificate[:2]
    )


def with_files(content: Content, folder: Path, files: Mapping[str, str]) -> Content:
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    return replace(content, template=read_own_template(str(folder)))


def test_the_page_s_own_example_does_what_it_says(short: Content, tmp_path: Path) -> None:
    Pixels.new("RGB", (60, 20), (122, 31, 31)).save(tmp_path / "letterhead.png")
    names = {"report.html.j2": "jinja", "report.css": "css", "report.typ": "typst"}
    own = with_files(short, tmp_path, {name: shown(language) for name, language in names.items()})
    html, pdf = render_html(own, ()), render_pdf(own, ())
    picture = base64.b64encode((tmp_path / "letterhead.png").read_bytes()).decode()
    assert f'<img src="data:image/png;base64,{picture}" alt="Test hall 2"> Test hall 2 · Pardubice' in html
    assert f"naming {own.report_id}" in html
    assert ".letterhead { color: #7a1f1f;" in html
    texts = [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(io.BytesIO(pdf))]
    assert "Test hall 2 · Pardubice" in texts[0]
    assert all("lab@example.org" in text for text in texts)
    for words in (own.title, own.report_id, "Deviations and stopped runs", "DRAFT", "Key values"):
        assert words in html
    assert own.report_id != short.report_id
    assert pdf == render_pdf(own, ())


def test_the_page_names_every_block_and_no_other() -> None:
    table = PAGE[PAGE.index("## The blocks") : PAGE.index("An HTML template begins")]
    rows = [line.split("|")[1:-1] for line in table.splitlines() if line.startswith("| `")]
    for column, blocks in ((2, HTML_BLOCKS), (3, TYPST_BLOCKS)):
        named = [name for row in rows if "✓" in row[column] for name in re.findall(r"`([\w-]+)`", row[0])]
        assert named == list(blocks)


def test_every_key_that_the_page_names_is_there(short: Content) -> None:
    document = short.document()
    for key in re.findall(r"`report\.(?!css|toml)([\w.]+)`", PAGE[PAGE.index("## What a template gets") :]):
        value = document
        for part in key.split("."):
            value = value[part]
    fact, section = document["head"]["facts"][0], document["sections"][0]
    assert set(fact) == {"name", "text", "tone", "note"}
    assert set(section) == {"id", "title", "annex", "blocks"}


HEAD = '{% extends "bufferstand/report.html.j2" %}\n'


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("report.html.j2", "<p>all mine</p>", "line 1: it does not begin with {% extends"),
        ("report.html.j2", HEAD + "{% block tpo %}{% endblock %}", "line 2: there is no block “tpo”"),
        ("report.html.j2", HEAD + "{% block top %}\n{{ }}{% endblock %}", "line 3: Expected an expression"),
        (
            "report.html.j2",
            HEAD + "{% block top %}{{ reprot.title }}{% endblock %}",
            "line 2: 'reprot' is undefined",
        ),
        (
            "report.html.j2",
            HEAD + "{% block top %}\n\n{{ 1 / 0 }}{% endblock %}",
            "line 4: ZeroDivisionError",
        ),
        (
            "report.html.j2",
            HEAD + "{% block top %}{{ own['x.png'] }}{% endblock %}",
            "line 2: 'dict object' has no",
        ),
        (
            "report.html.j2",
            HEAD + "{% block top %}{{ ''.__class__.__mro__ }}{% endblock %}",
            "line 2: access to",
        ),
        ("report.html.j2", HEAD + "{% block top %}{% include 'x' %}{% endblock %}", "line 2: x"),
        ("report.typ", "#let x = 1\n", "line 1: it does not define “blocks”"),
        ("report.typ", "#let blocks = (style: (r, s) => block(s))\n", "pagebreaks are not allowed inside"),
        (
            "report.typ",
            "#let blocks = (tpo: (r, s) => s)\n",
            "there is no block “tpo” to override; there are style",
        ),
        ("report.typ", "#let blocks = (\n top: (r, s) => {\n  1 + [x]\n })\n", "line 3: cannot add"),
        ("report.typ", "#let blocks = (\n top: (r, s) => [\n", "line 1: unclosed delimiter"),
        ("report.typ", '#let blocks = (top: (r, s) => image("/etc/x.png"))\n', "line 1: file not found"),
        ("report.typ", '\n#import "@preview/cetz:0.3.0"\n#let blocks = (:)\n', "line 2: it loads a package"),
        ("report.typ", '#let blocks = (top: (r, s) => text(font: "Nosuch", [a]))\n', "unknown font family"),
    ],
)
def test_a_wrong_template_gives_one_message_with_file_and_line(
    short: Content, tmp_path: Path, name: str, text: str, said: str
) -> None:
    own = with_files(short, tmp_path, {name: text})
    with pytest.raises(BadInput) as refused:
        render_html(own, ()) if name.endswith("j2") else render_pdf(own, ())
    message = str(refused.value)
    assert message.startswith(f"{tmp_path / name}: ")
    assert said in message
    assert "docs/how-to/own-report-template.md" in message


def test_a_fault_of_the_shipped_template_is_not_laid_on_the_laboratory(report: Made, tmp_path: Path) -> None:
    own = with_files(report.content, tmp_path, {"report.html.j2": HEAD, "report.css": ".x { }"})
    with pytest.raises(UndefinedError):  # the figures are missing
        render_html(own, ())


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({}, "has none of report.html.j2, report.css, report.typ"),
        ({"report.html": "x"}, "has none of report.html.j2, report.css, report.typ"),
        ({"report.css": "x", "logo.png": "x"}, "logo.png: no picture of the kind that its name says"),
    ],
)
def test_a_folder_that_is_no_template_is_refused(tmp_path: Path, files: Mapping[str, str], said: str) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    with pytest.raises(BadInput, match=re.escape(said)):
        read_own_template(str(tmp_path))


def test_what_is_no_folder_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="the template is no folder"):
        read_own_template(str(tmp_path / "none"))
    (tmp_path / "report.css").write_bytes(b"\xff")
    with pytest.raises(BadInput, match=r"report\.css: not UTF-8"):
        read_own_template(str(tmp_path))


def test_report_toml_names_the_folder_relative_to_itself(tmp_path: Path) -> None:
    (tmp_path / "report.toml").write_text('template = "letterhead"\n', "utf-8")
    assert read_fields(tmp_path / "report.toml").template == str(tmp_path / "letterhead")
    assert read_own_template("") is None


SHOWING = (
    "#let blocks = (style: (report, shipped) => { show heading: set text(fill: red); shipped })",
    "#let blocks = (style: (report, shipped) => { set page(background: rect(fill: luma(97%))); shipped })",
)
HIDING = {
    "dropped": "[nothing]",
    "hidden": "hide(shipped)",
    "on another page": "{ pagebreak(weak: false); [mine]; pagebreak(); shipped }",
    "of the colour of its ground": '{ show text: set text(fill: rgb("#f3f5f7")); shipped }',
    "faint": "{ show text: set text(fill: luma(85%)); shipped }",
    "covered": "{ set page(foreground: rect(width: 100%, height: 100%, fill: white)); shipped }",
}


@pytest.mark.parametrize("how", HIDING)
def test_a_template_that_hides_the_statement_is_refused(short: Content, tmp_path: Path, how: str) -> None:
    own = with_files(
        short, tmp_path, {"report.typ": f"#let blocks = (style: (report, shipped) => {HIDING[how]})\n"}
    )
    with pytest.raises(BadInput) as refused:
        render_pdf(own, ())
    said = str(refused.value)
    assert "report.typ" in said
    assert "does not show the statement" in said


@pytest.mark.parametrize("text", SHOWING)
def test_a_template_that_shows_the_statement_is_taken(short: Content, tmp_path: Path, text: str) -> None:
    render_pdf(with_files(short, tmp_path, {"report.typ": text + "\n"}), ())
