"""What is said of a step as it was run, where nobody could say before what it takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.daq.campaign.agenda import Agenda
from bufferstand.daq.campaign_folder.as_run import (
    AsRun,
    ExpectedOutcome,
    add_as_run,
    read_as_run,
    report_rows,
    totals,
)
from bufferstand.daq.warm_up.heat_log import StepHeat
from bufferstand.protocols.planning.plan import make_plan
from bufferstand.protocols.prediction.curve_predictor import CurvePredictor
from tests.protocols.conftest import SPECIMEN, STAND, Load
from tests.protocols.conftest import load as load  # noqa: PLC0414 - a fixture

CURVE = CurvePredictor(((0.0, 15.0), (25.0, 67.0), (60.0, 195.0), (96.0, 600.0)), 0.5, None, 1.15, "a sheet")
"""A data sheet that states the absorbed share and no heat capacity."""
STEPS = """
[limits]
temperature_stop_C = 60.0

[[step]]
kind = "warm-up"
temperature_C = 45.0
prestress_mm = 40.0
amplitude_mm = 20.0
frequency_Hz = 1.0

[[step]]
kind = "static"
stroke_limit_mm = 60.0
"""


def ran(load: Load, position: int) -> AsRun:
    plan = make_plan(load(STEPS), STAND, CURVE, SPECIMEN)
    step = plan.steps[position]
    seen = StepHeat(120.0, 21.0, 45.0, 21.0, 58_000.0)
    return Agenda(plan, lambda _: False, None).done(step, seen, 15, complete=True)


def test_the_most_cycles_of_a_warm_up_are_no_expectation(load: Load) -> None:
    row = ran(load, 0)
    assert row.planned is not None
    assert (row.planned.heat_J, row.planned.end_C, row.planned.at_most) == (None, None, True)
    assert "(planned: at most 9 min 10 s" in row.sentence()
    assert "heat not known, end not known)" in row.sentence()
    assert "58 kJ of heat (planned not known)" in totals([row]).sentence()
    assert "(planned at most 9 min 10 s)" in totals([row]).sentence()
    assert report_rows([row])[0][4] == "not known"


def test_heat_is_known_by_the_share_alone_and_temperatures_are_not(load: Load) -> None:
    row = ran(load, 1)
    assert row.planned is not None
    assert row.planned.heat_J is not None
    assert row.planned.heat_J > 1000.0
    assert row.planned.end_C is None
    assert f"{row.planned.heat_J / 1e3:.1f} kJ, end not known)" in row.sentence()


def test_what_is_not_known_is_kept_as_such(load: Load, tmp_path: Path) -> None:
    row = ran(load, 0)
    add_as_run(tmp_path, row)
    (again,) = read_as_run(tmp_path)
    assert again == row


def test_what_is_known_is_said_as_ever(load: Load) -> None:
    known = replace(ran(load, 0), planned=ExpectedOutcome(100.0, 12_300.0, 45.0))
    assert "(planned: 1 min 40 s, 12.3 kJ, 45.0 °C)" in known.sentence()
    assert totals([known]).planned_heat_J == pytest.approx(12_300.0)
