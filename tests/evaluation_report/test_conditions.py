"""The conditions of the test: what runs show, and no row of what none shows."""

from __future__ import annotations

from dataclasses import replace

from bufferstand.evaluation.report.content import DASH, Table
from bufferstand.evaluation.report.sections.conditions import conditions_section
from bufferstand.evaluation.report.source import ReportSource
from tests.evaluation_report.conftest import Made


def rows(source: ReportSource) -> dict[str, str]:
    (table,) = [block for block in conditions_section(source).blocks if isinstance(block, Table)]
    return {str(row[0].text): str(row[3].text) for row in table.rows if row[3].text != DASH}


def test_each_condition_names_the_runs_that_show_it(report: Made) -> None:
    found = rows(report.source)
    harmonic = [run.number for run in report.source.runs if run.kind == "harmonic"]
    assert found["Greatest speed of harmonic runs"].startswith("runs ")
    assert str(harmonic[0]) in found["Greatest speed of harmonic runs"]
    assert "Temperature of the specimen" in found


def test_what_no_run_shows_has_no_row(report: Made) -> None:
    static = tuple(run for run in report.source.runs if run.kind == "static")[:1]
    found = rows(replace(report.source, runs=static))
    assert set(found.values()) == {f"run {static[0].number}"}
    for words in ("Greatest speed of harmonic runs", "Longest pause between runs"):
        assert words not in found
    bare = tuple(replace(run, record=None, evaluated={**run.evaluated, "requirements": []}) for run in static)
    assert rows(replace(report.source, runs=bare)) == {}
    (table,) = [
        one for one in conditions_section(replace(report.source, runs=bare)).blocks if isinstance(one, Table)
    ]
    assert [row[0].text for row in table.rows] == ["Temperature of the specimen", "Temperature of the air"]
    assert {row[1].why for row in table.rows} == {"no sensor of this kind was recorded"}
