"""The printed comparison of three specimens: as short as can be, nothing torn apart, nothing said twice."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content.content import Table
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.report.source.specimens import side_by_side
from tests.evaluation_report.test_pages import Printed, broken, prose
from tests.house.test_recipes import RUNS

MOST_PAGES = 13
"""Before the annex: six steps of three specimens, each with its statement of conformity."""


def of_specimen(source: ReportSource, identifier: str, runs: int) -> ReportSource:
    """Return some of a campaign's runs as those of another specimen, whose forces are all the same."""
    own = [
        replace(run, metadata=run.metadata | {"specimen": dict(run.fact("specimen"), id=identifier)})
        for run in source.runs[:runs]
    ]
    return replace(source, name=identifier.lower(), runs=tuple(own))


@pytest.fixture(scope="module")
def printed() -> Printed:
    source = read_source(RUNS, None, Given(options=Options(draws=200), fields=ReportFields()))
    named = (("KX-1", 6), ("KX-2", 6), ("KX-3", 4))
    content = build_comparison(side_by_side([of_specimen(source, *one) for one in named], ReportFields()))
    return Printed("comparison", content, render_pdf(content, [draw(one.plot) for one in content.pictures()]))


def test_no_more_pages_than_someone_reads(printed: Printed) -> None:
    assert len(printed.body()) <= MOST_PAGES
    first, second, *_ = printed.texts()
    for words in ("Tested by", "Authorised by", "items tested.", "Figure 1."):
        assert words in first
        assert words not in second


def test_nothing_is_torn_apart(printed: Printed) -> None:
    assert list(broken(printed.pdf)) == []
    titles = {block.title for s in printed.content.sections for block in s.blocks if hasattr(block, "title")}
    titles |= {section.title for section in printed.content.sections} | {"Annex"}
    for text in printed.texts():
        said = [
            line.strip() for line in text.splitlines() if line.strip() not in {"", printed.content.subtitle}
        ]
        assert said[-1] not in titles


def test_a_short_table_is_whole_with_its_note(printed: Printed) -> None:
    short = [
        block
        for section in printed.content.sections
        for block in section.blocks
        if isinstance(block, Table) and 0 < len(block.rows) <= 6 and block.note
    ]
    pages = [" ".join(text.split()) for text in printed.texts()]
    assert short
    for table in short:
        note = " ".join(table.note.split())[:60]
        held = [page for page in pages if table.title in page and note in page]
        assert held, table.title


def test_no_fact_is_said_twice(printed: Printed) -> None:
    said = Counter(prose(printed.content.document()))
    assert [text for text, count in said.items() if count > 1] == []


def test_the_specimens_stand_side_by_side(printed: Printed) -> None:
    (section,) = [one for one in printed.content.sections if one.id == "identification"]
    (table,) = section.blocks
    assert isinstance(table, Table)
    assert [cell.text for cell in table.rows[0]] == ["Identification", "KX-1", "KX-2", "KX-3"]


def test_steps_of_two_specimens_only_are_named_with_the_reason(printed: Printed) -> None:
    (section,) = [one for one in printed.content.sections if one.id == "comparison"]
    titles = [block.title for block in section.blocks if isinstance(block, Table)]
    assert "Steps without a counterpart" not in titles  # KX-1 and KX-2 have run each of them
    assert "Spread among the specimens, and degrees of equivalence" in titles
