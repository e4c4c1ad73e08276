"""What the twin said during the runs stands in the report, and there is no section where it said nothing."""

from __future__ import annotations

from dataclasses import replace

from bufferstand.evaluation.report.build import build_content
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_evidence import section, table

SAID = "3 cycles in a row (since cycle 8) lie outside the model's band: loss +18.0 % ± 2.0 %"


def test_without_the_twin_there_is_no_section(report: Made) -> None:
    assert section(report.content, "twin") is None


def test_every_event_of_the_twin_has_a_row(report: Made) -> None:
    runs = list(report.source.runs)
    runs[1] = replace(runs[1], events=(*runs[1].events, (12.34, "twin", SAID), (13.0, "operator", "a note")))
    (row,) = table(build_content(replace(report.source, runs=tuple(runs))), "twin").rows
    assert [cell.text for cell in row] == ["2", "12.34", SAID]
