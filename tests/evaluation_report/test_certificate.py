"""The first page: one statement of the gravest verdict, and the five values that say most."""

from __future__ import annotations

import dataclasses
from typing import Any

from bufferstand.evaluation.report.sections.certificate import (
    MOST_VALUES,
    key_values,
    statement,
    told_on_first_page,
)
from bufferstand.evaluation.report.sections.conformity import not_tested_section
from bufferstand.evaluation.report.sections.verdicts import nearest_to_a_limit
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import requirement
from tests.evaluation_report.test_content import strings, with_evaluated


def row(
    name: str, measured: float | None, verdict: str = "pass", cycle: int = 1, **more: Any
) -> dict[str, Any]:
    facts = {"measured": measured, "lower_limit": 10.0, "upper_limit": 50.0, "unit": "kN"}
    return requirement(name, cycle, verdict, **(facts | more))


def judged(report: Made, rows: list[dict[str, Any]], verdict: str = "pass", number: int = 1) -> ReportSource:
    return with_evaluated(report.source, number, verdict=verdict, requirements=rows, purpose="conformity")


def test_nearest_is_the_gravest_then_the_least_likely_then_the_closest() -> None:
    rows = [
        row("failed", 9.0, "fail"),
        row("unlikely", 30.0, conformance_probability=0.6),
        row("close", 12.0),
        row("in the middle", 30.0),
        row("one-sided", 40.0, upper_limit=None),
        row("nothing", None),
    ]
    assert sorted(rows, key=nearest_to_a_limit) == [rows[n] for n in (0, 1, 2, 3, 4, 5)]


def test_of_each_requirement_the_cycle_nearest_to_a_limit_is_a_key_value(report: Made) -> None:
    rows = [
        row("preload", 20.0),
        row("preload", 11.0, cycle=2, expanded_uncertainty=0.12),
        row("stored-energy", 13000.0, lower_limit=12500.0, upper_limit=None, unit="J"),
        row("speed-limit", 49.9, unit="mm/s"),
    ]
    table = key_values(judged(report, rows))
    shown = [[cell.text for cell in line] for line in table.rows]
    assert shown[:2] == [
        ["Preload", "11.00 ± 0.12", "10 … 50", "kN", "1 (2)", "✓ pass"],
        ["Stored energy", "13000", "≥ 12500", "J", "1 (1)", "✓ pass"],
    ]
    assert [line[0] for line in shown[2:]] == ["Damping", "Tangent stiffness", "Greatest force"]
    assert len(shown) == MOST_VALUES, "a condition is none, and there are no more"


def test_more_requirements_than_room_leave_out_the_safest(report: Made) -> None:
    rows = [row(f"force-at-{at}mm", 10.0 + at, stroke_mm=float(at)) for at in (1, 5, 10, 15, 18, 20)]
    names = [line[0].text for line in key_values(judged(report, rows)).rows]
    assert names == [f"Force at {at} mm" for at in (1, 5, 10, 15, 18)]


def test_of_several_tests_the_gravest_is_stated(report: Made) -> None:
    source = judged(report, [row("preload", 20.0)])
    failed = row("preload", 9.0, "fail", why="9.0 kN lies below 10 kN")
    second = judged(dataclasses.replace(report, source=source), [failed], "fail", number=2)
    line = statement(second)
    assert line.verdict.text == "✗ fail"
    assert line.subject.startswith("EN 15551: ")
    assert line.subject.endswith("runs 1–2")
    assert line.sentence == "Gravest is run 2. 1 of 1 requirements are not met:"
    assert line.points == ("Preload (cycle 1): 9.0 kN lies below 10 kN",)


def test_without_a_judged_run_it_says_that_there_is_no_statement(report: Made) -> None:
    source = judged(report, [], verdict="pass")
    line = statement(source)
    assert (line.verdict.text, line.subject) == ("No statement", "Characterisation")
    assert key_values(source).rows[0][0].text == "Damping"


def test_reasons_stand_once_on_the_first_page_or_where_it_has_no_room(report: Made) -> None:
    def of(count: int) -> tuple[ReportSource, str]:
        rows = [row(f"force-at-{at}mm", None, "not-tested", why=f"why {at}") for at in range(1, count + 1)]
        source = judged(report, rows, "not-tested")
        section = not_tested_section(source)
        return source, "\n".join(strings([dataclasses.asdict(block) for block in section.blocks]))

    source, said = of(3)
    assert told_on_first_page(source) is source.runs[0]
    assert [point for point in statement(source).points if "why 2" in point]
    assert "why 2" not in said
    assert "Run 1: Force at 1 mm, Force at 2 mm, Force at 3 mm. The reasons stand on the first page." in said
    source, said = of(6)
    assert told_on_first_page(source) is None
    assert statement(source).points[-1] == "and 2 more: see Statement of conformity by clause"
    assert "Run 1: Force at 6 mm (cycle 1): why 6." in said
