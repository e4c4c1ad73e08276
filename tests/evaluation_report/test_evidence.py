"""Skew, wires, inertia and temperature in the report: where they are said, and what stands for nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from bufferstand.evaluation.document.evidence import comparison_entries
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Content, Section, Table
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation.test_thermal_comparison import static
from tests.evaluation_report.conftest import Made

SKEW = {
    "cycles": [2],
    "absorbed_energy_J_per_ms": {"by_shifting": 11.1, "closed_form": 11.0},
    "damping_per_ms": {"by_shifting": -0.0044, "closed_form": None},
    "form": "sine-stroke",
}
WIRES = {
    "largest_difference_mm": 0.31, "at_s": 4.0, "offset_mm": 0.1, "scale_mismatch": 0.001,
    "remaining_mm": 0.06, "limit_mm": None, "out": [],
}  # fmt: skip
INERTIA = {"moving_mass_kg": 150.0, "source": "stand", "largest_force_kN": 0.193}


def with_facts(source: ReportSource, number: int, **facts: Any) -> ReportSource:
    runs = list(source.runs)
    runs[number] = replace(runs[number], evaluated={**runs[number].evaluated, **facts})
    return replace(source, runs=tuple(runs))


def section(content: Content, identifier: str) -> Section | None:
    return next((s for s in content.sections if s.id == identifier), None)


def table(content: Content, identifier: str) -> Table:
    found = section(content, identifier)
    assert found is not None
    return next(block for block in found.blocks if isinstance(block, Table))


def test_without_evidence_there_is_no_section(report: Made) -> None:
    assert section(report.content, "evidence") is None
    assert section(report.content, "temperature") is None


def test_skew_wires_and_inertia_of_a_run(report: Made) -> None:
    source = with_facts(report.source, 1, skew_sensitivity=SKEW, draw_wires=WIRES, inertia_correction=INERTIA)
    (row,) = table(build_content(source), "evidence").rows
    absorbed, damping = (source.runs[1].result(name) for name in ("absorbed_energy_J", "damping"))
    assert absorbed
    assert damping
    assert [cell.text for cell in row[:3]] == ["2", "+11.1", f"+{1110.0 / absorbed:.2g}"]
    assert row[3].text == "−0.00440"
    assert float(row[4].text.replace("−", "-")) == pytest.approx(-0.44 / damping, rel=0.05)
    assert [cell.text for cell in row[5:7]] == ["0.31", "0.06"]
    assert (row[7].tone, row[7].why) == ("missing", "the channels state no accuracy")
    assert row[8].text == "150 kg (stand file), up to 0.19 kN"


def test_one_wire_and_no_correction_are_said(report: Made) -> None:
    nothing = {"moving_mass_kg": 0.0, "source": "none", "largest_force_kN": 0.0}
    source = with_facts(report.source, 1, skew_sensitivity=None, draw_wires=None, inertia_correction=nothing)
    (row,) = table(build_content(source), "evidence").rows
    assert {cell.why for cell in row[1:5]} == {"no cycle that could be shifted"}
    assert {cell.why for cell in row[5:8]} == {"the record has no two draw wires"}
    assert row[8].text == "not corrected"


def test_a_comparison_of_temperatures_has_a_table_and_a_figure(report: Made) -> None:
    cold, warm = (run.id for run in report.source.runs[1:3])
    compared = comparison_entries([static(cold, 25.0, 42.5), static(warm, 75.0, 44.5)])
    source = replace(report.source, document={**report.source.document, "temperature_comparisons": compared})
    content = build_content(source)
    rows = table(content, "temperature").rows
    assert [row[4].text for row in rows] == ["End force", "Stored energy", "Absorbed energy", "Damping"]
    assert {(row[0].text, row[1].text, row[3].text) for row in rows} == {("3", "75.0", "42.5")}
    # The draw-hook spring loses 44 % of its end force from 25 to 75 °C (test_thermal_comparison.py).
    assert float(rows[0][8].text.split(" ")[0].replace("−", "-")) == pytest.approx(-44.0, abs=2.0)
    (picture,) = [p for p in content.pictures() if "temperatures of the specimen" in p.caption]
    assert [curve.label for curve in picture.plot.curves] == ["25.0 °C (run 2)", "75.0 °C (run 3)"]
    assert [row[0].text for row in picture.numbers.rows] == ["2", "3"]
    assert "Comparison of temperatures" in render_html(content, ["<svg/>"] * len(content.pictures()))
