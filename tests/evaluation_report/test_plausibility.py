"""Findings in the report: a table among the evidence, a notice where a channel is not to be believed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.evaluation.facts.finding import Finding
from bufferstand.evaluation.report.build import build_content
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_evidence import section, table, with_facts

SPIKE = Finding("spike", "stroke_2", 2.5, 2.5, (), 0.42, "mm", "stroke_2: a spike at 2.5 s", "noted")
CLIPPED = Finding("clipped", "force", 1.0, 9.25, (2, 3), 512.5, "kN", "force clipped", "spoils")


def test_without_findings_there_is_no_section(report: Made) -> None:
    assert section(report.content, "plausibility") is None
    assert not any("not to be believed" in notice for notice in report.content.notices)


def test_findings_have_a_row_each(report: Made) -> None:
    source = with_facts(report.source, 1, plausibility=[SPIKE.entry(), CLIPPED.entry()])
    content = build_content(source)
    spike, clipped = table(content, "plausibility").rows
    shown = "2|stroke 2|spike|2.5|2.5|none|0.42|mm|noted"
    assert "|".join(cell.text for cell in spike) == shown
    assert [cell.text for cell in clipped[1:3]] == ["force", "clipped"]
    assert [cell.text for cell in clipped[5:]] == ["2, 3", "512", "kN", "spoils"]
    assert any("not to be believed" in notice and "un 2" in notice for notice in content.notices)
    assert content.document()["sections"]  # every row has a cell for each column


@pytest.mark.parametrize(("count", "shown"), [(5, "5 of 1 to 5"), (0, "none")])
def test_many_cycles_are_counted(report: Made, count: int, shown: str) -> None:
    many = replace(SPIKE, cycles=tuple(range(1, count + 1)))
    source = with_facts(report.source, 1, plausibility=[many.entry()])
    run = source.runs[1]
    cycles = [{"index": n, "temperature_C": {}} for n in range(1, 20)]
    source = with_facts(source, 1, cycles=[*run.evaluated["cycles"], *cycles])
    (row,) = table(build_content(source), "plausibility").rows
    assert row[5].text == shown
