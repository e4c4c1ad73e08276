"""The uncertainty budget in a report: what the evaluation document states, in HTML and PDF alike."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace

import pypdfium2
import pytest

from bufferstand.evaluation.document.build import run_entry
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Section, Table
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.sections.budgets import budgets_section
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation.signals import StaticTest
from tests.evaluation_report.conftest import Made


@pytest.fixture(scope="module")
def evaluated() -> RunEvaluation:
    return StaticTest().evaluate()


@pytest.fixture(scope="module")
def source(report: Made) -> ReportSource:
    return report.source


@pytest.fixture(scope="module")
def budgeted(source: ReportSource, evaluated: RunEvaluation) -> ReportSource:
    entry = json.loads(json.dumps(run_entry(evaluated)))
    first, *others = source.runs
    with_budget = replace(first, evaluated={**first.evaluated, "budget": entry["budget"]})
    return replace(source, runs=(with_budget, *others))


def table_of(section: Section | None) -> Table:
    assert section is not None
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    return table


def test_every_source_has_a_row(budgeted: ReportSource, evaluated: RunEvaluation) -> None:
    table = table_of(budgets_section(budgeted))
    sources = [row[0].text for row in table.rows]
    assert sources[:-2] == list(dict.fromkeys(line.source for b in evaluated.budget for line in b.lines))
    assert sources[-2:] == ["Combined", "Monte Carlo"]
    assert [c.title for c in table.columns[:5]] == ["Source", "u", "ν", "c(W_s)", "u(W_s)"]


def test_the_numbers_are_those_of_the_budget(budgeted: ReportSource, evaluated: RunEvaluation) -> None:
    table = table_of(budgets_section(budgeted))
    zero = next(row for row in table.rows if row[0].text == "force: zero")
    stored = evaluated.budget[0]
    line = next(line for line in stored.lines if line.source == "force: zero")
    assert zero[2].text == "∞"
    assert float(zero[3].text) == pytest.approx(line.sensitivity, rel=0.01)
    assert float(zero[4].text) == pytest.approx(100.0 * line.contribution / stored.value, rel=0.06)
    combined = table.rows[-2]
    assert float(combined[8].text) == pytest.approx(
        100.0 * evaluated.budget[2].u / evaluated.budget[2].value, rel=0.06
    )


def test_it_is_a_section_of_the_report(budgeted: ReportSource, source: ReportSource) -> None:
    content = build_content(budgeted)
    assert "uncertainty-budget" in [s.id for s in content.sections]
    figures = tuple(draw(picture.plot) for picture in content.pictures())
    html, pdf = render_html(content, figures), render_pdf(content, figures)
    assert "u(K<sub>t</sub>)" in html
    assert pdf.startswith(b"%PDF")
    printed = "".join(page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(io.BytesIO(pdf)))
    for symbol, words in (("W_s", "Stored energy"), ("K_t", "Tangent stiffness"), ("D", "Damping")):
        assert f"{symbol.replace('_', '')}: {words}" in printed
        assert symbol == "D" or symbol not in printed + re.sub(r"base64,[^\"]*", "", html)
    assert "uncertainty-budget" not in [s.id for s in build_content(source).sections]
