"""The documents say what the code does: names, windows and criteria."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from bufferstand.evaluation.across_runs import trends
from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.cycles import find as cycles
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loops.extreme_forces import FORCE_WINDOW
from bufferstand.evaluation.quantities import (
    evaluate as quantities,
)
from bufferstand.evaluation.quantities import (
    loop_readings,
)
from bufferstand.evaluation.quantities import (
    temperature as thermometry,
)
from bufferstand.evaluation.requirements import static
from bufferstand.evaluation.requirements.checklist import asked_items
from bufferstand.evaluation.requirements.limit_set import find_limit_set, shipped_limit_set, shipped_names
from bufferstand.evaluation.requirements.readings import LimitSetReadings

DOCS = Path(__file__).resolve().parents[2] / "docs"
EVALUATION = "\n".join(
    page.read_text(encoding="utf-8")
    for page in (DOCS / "evaluation.md", *sorted((DOCS / "evaluation").glob("*.md")))
)
SYMBOLS = (DOCS / "symbols.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", QUANTITIES.names)
def test_every_figure_has_a_symbol_line(name: str) -> None:
    assert f"`{name}`" in SYMBOLS


@pytest.mark.parametrize(
    "identity",
    [
        *(w.id for w in shipped_limit_set().force if w.stroke_mm in (0.0, 25.0)),
        "stored-energy", "absorbed-energy-ratio", "cycle-count", "rest-after-assembly", "temperature-range",
        "speed-limit", "pause-limit", "immediate-unloading", "full-release", "full-stroke",
        "stored-energy-category",
    ],
)  # fmt: skip
def test_every_requirement_is_explained(identity: str) -> None:
    assert f"`{identity}`" in EVALUATION


CONDITIONS = shipped_limit_set().conditions
STATED = [
    f"within {100 * cycles.STEADY_STROKE:g} % of its range",
    f"frequency within {100 * cycles.STEADY_FREQUENCY:g} %",
    f"distortion within {cycles.STEADY_DISTORTION}",
    f"returns within {100 * cycles.REST_CLOSURE:g} % of the range ({100 * cycles.EDGE_CLOSURE:g} %",
    f"over ±{100 * loop_readings.TANGENT_WINDOW:g} % of the range",
    f"parabola over {100 * loop_readings.SPEED_WINDOW:g} % of the branch",
    f"parabola over {100 * FORCE_WINDOW:g} % of each branch",
    f"farther than {thermometry.READING_INTERVAL_S:g} s",
    f"more than {100 * quantities.TWO_SIDED:g} % of its largest",
    f"±{static.FORCE_HALF_WIDTH_MM:g} mm",
    f"{static.PRELOAD_FROM_MM:g} to {static.PRELOAD_TO_MM:g} mm",
    f"prestress within {trends.PRESTRESS_TOLERANCE_MM:g} mm",
    f"amplitude within {trends.AMPLITUDE_TOLERANCE_MM:g} mm or {100 * trends.AMPLITUDE_TOLERANCE:g} %",
    f"above {trends.TEMPERATURE_SPREAD_C:g} K",
    f"above {CONDITIONS.dwell_max_s:g} s at the top",
    f"above {CONDITIONS.residual_stroke_max_mm:g} mm before",
    f"outside {CONDITIONS.temperature_min_C:g} to {CONDITIONS.temperature_max_C:g} °C",
    f"{Options().draws} draws",
]


@pytest.mark.parametrize("text", STATED)
def test_criteria_are_stated_as_coded(text: str) -> None:
    assert text in EVALUATION


LIMIT_SETS = (DOCS / "limit-sets.md").read_text(encoding="utf-8")


def test_every_reading_is_explained_with_its_options() -> None:
    for name, field in LimitSetReadings.model_fields.items():
        assert f"| `{name}` |" in LIMIT_SETS
        for option in get_args(field.annotation):
            assert f"`{option}`" in LIMIT_SETS


def test_every_shipped_set_and_every_item_is_explained() -> None:
    for name in shipped_names():
        assert f"| `{name}` |" in LIMIT_SETS
        for item in asked_items(find_limit_set(name)):
            assert f"`{item}`" in LIMIT_SETS
