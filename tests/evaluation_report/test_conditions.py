"""The conditions of the test: what runs show, and no row of what none shows."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from bufferstand.evaluation.report.content import DASH, Table
from bufferstand.evaluation.report.sections.conditions import conditions_section
from bufferstand.evaluation.report.source import ReportSource
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import requirement


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


def test_what_the_statement_of_conformity_says_is_not_said_again(report: Made) -> None:
    """Speed, pause and rest of a conformity test stand in its statement; of a characterisation only here."""
    static = next(run for run in report.source.runs if run.kind == "static")
    required = requirement("speed-limit", 1, "pass", measured=4.95, unit="mm/s")
    judged = replace(static, evaluated={**static.evaluated, "requirements": [required]})
    assert judged.stated
    words = "Greatest speed of static cycles"
    assert words not in rows(replace(report.source, runs=(judged,)))
    characterising = replace(judged, evaluated={**judged.evaluated, "purpose": "characterisation"})
    assert not characterising.stated
    assert rows(replace(report.source, runs=(characterising,)))[words] == f"run {static.number}"


@pytest.mark.parametrize(
    ("pause_s", "shown"), [(2.45, ("2.5", "s")), (150.0, ("2.5", "min")), (9000.0, ("2.5", "h"))]
)
def test_the_longest_pause_has_its_unit_in_the_column_of_units(
    report: Made, pause_s: float, shown: tuple[str, str]
) -> None:
    first, second = report.source.runs[:2]
    assert first.ended is not None
    facts = {**second.metadata["run"], "started_utc": (first.ended + timedelta(seconds=pause_s)).isoformat()}
    later = replace(second, metadata={**second.metadata, "run": facts})
    (table,) = [
        one
        for one in conditions_section(replace(report.source, runs=(first, later))).blocks
        if isinstance(one, Table)
    ]
    (row,) = [row for row in table.rows if row[0].text == "Longest pause between runs"]
    assert (row[1].text, row[2].text) == shown


def test_between_runs_of_two_specimens_there_is_no_pause(report: Made) -> None:
    first, second = report.source.runs[:2]
    source = replace(report.source, runs=(first, second))
    assert "Longest pause between runs" in rows(source)
    other = second.metadata | {"specimen": second.metadata["specimen"] | {"id": "KX-0816"}}
    source = replace(report.source, runs=(first, replace(second, metadata=other)))
    assert "Longest pause between runs" not in rows(source)
