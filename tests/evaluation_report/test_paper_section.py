"""The comparison with the paper: of its own campaign only, each number judged by U and its rounding."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.catalogue.published_values import PUBLISHED_VALUES
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Section, Table
from bufferstand.evaluation.report.sections.paper_section import paper_section
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.foundation.published_campaigns import PAPER_CAMPAIGN
from bufferstand.protocols.campaign_file.schema import load_campaign
from tests.evaluation_report.conftest import Made

SAMPLES = Path(__file__).parents[2] / "sample_runs"


def of_paper(source: ReportSource, kind: str = "buffer", **damping: Any) -> ReportSource:
    """Return a source whose campaign is said to be the paper's; ``damping`` replaces that of run 5."""
    runs = []
    for run in source.runs:
        metadata = run.metadata | {
            "campaign": {**(run.fact("campaign") or {}), "reproduces": PAPER_CAMPAIGN},
            "specimen": {**(run.fact("specimen") or {}), "kind": kind},
        }
        evaluated = run.evaluated
        if damping and run.number == 5:
            evaluated = {**evaluated, "summary": {**run.summary, "damping": damping}}
        runs.append(replace(run, metadata=metadata, evaluated=evaluated))
    return replace(source, runs=tuple(runs))


def rows(section: Section | None) -> dict[tuple[str, str], list[str]]:
    assert section is not None
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    return {(row[1].text, row[2].text): [cell.text for cell in row[3:]] for row in table.rows}


def test_it_is_there_only_where_the_campaign_file_says_so(report: Made) -> None:
    assert paper_section(report.source) is None
    content = build_content(of_paper(report.source))
    titles = [section.title for section in content.sections]
    assert titles.index("Comparison with the paper’s figures") < titles.index("Conditions of the test")


@pytest.mark.parametrize(
    ("value", "agrees"),
    [
        (0.225, "within U"),
        (0.2253, "within U"),  # 0.225 may be as much as 0.2255
        (0.2264, "within U"),
        (0.2266, "◆ beyond U"),
        (0.2234, "◆ beyond U"),
    ],
)
def test_a_value_agrees_within_its_u_and_what_the_paper_has_rounded(
    report: Made, value: float, agrees: str
) -> None:
    source = of_paper(report.source, value=value, expanded_uncertainty=0.001, coverage_factor=2)
    row = rows(paper_section(source))["Damping", "20 ± 20 mm, 1.27 Hz"]
    assert row[:2] == ["0.225", "5"]
    assert row[-1] == agrees
    assert row[2] == f"{value:.4f} ± 0.0010"


def test_a_step_that_was_not_run_is_a_dash_with_its_reason(report: Made) -> None:
    section = paper_section(of_paper(report.source))
    row = rows(section)["Damping", "40 ± 40 mm, 0.32 Hz"]
    assert row[1:4] == ["—"] * 3
    assert section is not None
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    assert {cell.why for line in table.rows for cell in line if cell.tone == "missing"} >= {
        "no run of this campaign is of this step"
    }


def test_a_stroke_that_was_corrected_is_not_held_against_one_of_the_piston(report: Made) -> None:
    source = of_paper(report.source)
    assert rows(paper_section(source))["Prestress", "50 ± 30 mm, 0.42 Hz"][1] == "9"
    runs = tuple(replace(run, strokes=({"compensated": True},)) for run in source.runs)
    said = rows(paper_section(replace(source, runs=runs)))
    assert said["Prestress", "50 ± 30 mm, 0.42 Hz"][1] == "—"
    assert said["Frequency", "50 ± 30 mm, 0.42 Hz"][1] == "9"


def test_a_specimen_of_another_kind_has_its_own_numbers(report: Made) -> None:
    steps = {step for _, step in rows(paper_section(of_paper(report.source, "draw-gear")))}
    assert steps == {"to 42.5 mm, 25 °C", "to 44.5 mm, 75 °C"}
    assert paper_section(of_paper(report.source, "coupler")) is None


def test_a_simulated_run_says_what_its_agreement_is_worth(report: Made) -> None:
    said = str(paper_section(of_paper(report.source)))
    simulated = any(run.simulated for run in report.source.runs)
    assert ("were made to show the paper’s dampings" in said) == simulated


def test_every_published_number_has_a_quantity_and_a_place_in_the_paper() -> None:
    text = Path(__file__).parents[2].joinpath("docs", "paper-comparison.md").read_text(encoding="utf-8")
    for one in PUBLISHED_VALUES:
        QUANTITIES.named(one.quantity)
        assert 0.0 < one.rounded_by < 0.02 * one.value
        of_hundred = f"{100.0 * one.value:g} %"
        assert one.printed in text or of_hundred in text
        assert re.fullmatch(r"\d+[ab]?(, \d+[ab]?)?", one.figure)


def test_the_shipped_campaigns_of_the_paper_say_so_and_others_do_not() -> None:
    said = {
        file.stem: load_campaign(file).as_dict().get("reproduces")
        for file in sorted(SAMPLES.glob("*.toml"))
        if file.read_text("utf-8").count("\n[campaign]")
    }
    assert {name for name, of in said.items() if of == PAPER_CAMPAIGN} == {
        "demo",
        "fig9",
        "paper",
        "paper-full",
    }
    assert set(said.values()) == {PAPER_CAMPAIGN, None}
