"""Transducers that have failed stop the stand, calibrations that have expired are said loudly."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.guards.kinds.plausibility import PlausibilityGuard
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import scale
from bufferstand.daq.stand.calibration_dates import expired_calibrations
from bufferstand.drivers.interfaces import SampleBlock, StreamFacts
from bufferstand.foundation.channels.calibration import Branch, Calibration
from bufferstand.foundation.channels.channel import Channel, Plausibility
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import FACTS as CAMPAIGN_FACTS
from tests.daq.fake_stand import CONTROLLER_FACTS
from tests.daq.test_runner import Case

WIRE = Channel(
    name="stroke_1",
    quantity="stroke",
    unit="mm",
    calibration=Calibration(coefficients=(0.0, 0.01)),
    plausible=Plausibility(counts=(-5000, 60000), rate_per_s=1500.0),
)
FACTS = StreamFacts("controller", "device", (WIRE,), 1000.0, "test")


def block(counts: list[int], first: int = 0) -> SampleBlock:
    time_us = 1000 * (first + np.arange(len(counts), dtype=np.int64))
    return SampleBlock("controller", first, time_us, {"stroke_1": np.array(counts)}, 0, time_us[-1] / 1e6)


def looked(guard: PlausibilityGuard, counts: list[int], first: int = 0) -> list[Trip]:
    one = block(counts, first)
    return guard.look(one, scale(one, FACTS))


def test_a_broken_wire_stops_when_it_lasts_also_over_many_blocks() -> None:
    guard = PlausibilityGuard(FACTS)
    assert looked(guard, [-5000] * 15) == []
    trips = [trip for first in (15, 30, 45) for trip in looked(guard, [-5000] * 15, first)]
    (trip,) = trips
    assert trip.action is Action.EMERGENCY
    assert trip.device_fault
    assert (
        "stroke_1 reads -5000 counts (≤ -5000), an end of its converter: a draw wire at its end"
        in trip.reason
    )
    assert (trip.stream, trip.sequence) == ("controller", 45)


def test_one_bad_sample_is_none() -> None:
    guard = PlausibilityGuard(FACTS)
    for first in range(0, 300, 15):
        trips = looked(guard, [100] * 14 + [-5000], first)
        assert all(trip.action is Action.NOTE for trip in trips)


def test_a_jump_is_noted_once_a_second() -> None:
    guard = PlausibilityGuard(FACTS)
    trips = [trip for first in range(0, 2500, 10) for trip in looked(guard, [0] * 5 + [500] * 5, first)]
    assert 2 <= len(trips) <= 3
    assert all(trip.action is Action.NOTE and "jumps by" in trip.reason for trip in trips)


def test_a_draw_wire_that_breaks_stops_a_campaign(tmp_path: Path) -> None:
    case = Case(tmp_path)
    force, wire, *others = case.controller.facts.channels
    assert wire.name == "stroke_1"
    end = 12.0 / wire.calibration.coefficients[1]  # the step goes to 15 mm: there it “breaks”
    wire = wire.model_copy(update={"plausible": Plausibility(counts=(-1e9, end))})
    case.controller.facts = replace(CONTROLLER_FACTS, channels=(force, wire, *others))
    outcome = case.run()
    assert outcome.exit_status == 4
    assert "an end of its converter: a draw wire at its end, or its cable broken" in outcome.reason


def test_an_expired_calibration_is_said_at_the_start_and_in_every_run(tmp_path: Path) -> None:
    case = Case(tmp_path)
    first, *others = case.controller.facts.channels
    old = Calibration(
        id="GTM-1",
        certificate="D-K-1",
        coefficients=first.calibration.coefficients,
        valid_until=date(2020, 1, 31),
    )
    expired = first.model_copy(update={"calibration": old})
    case.controller.facts = replace(CONTROLLER_FACTS, channels=(expired, *others))
    outcome = case.run()
    text = (
        "the calibration “GTM-1” (D-K-1) of force expired on 2020-01-31: figures of this run cannot be "
        "traced; calibrate, or enter the new certificate"
    )
    assert f"WARNING: {text}" in case.shown.lines
    run = open_run(outcome.runs[0])
    assert [event.text for event in run.events if event.kind == "calibration"] == [text]
    assert expired_calibrations(case.stand, date(2020, 1, 31)) == []
    assert expired_calibrations(case.stand, date(2020, 2, 1)) == [text]


@pytest.mark.slow
@pytest.mark.parametrize("size", [1, 7, 100])
def test_guards_see_the_same_values_as_the_evaluation(size: int) -> None:
    """Raw counts and calibration in the run file give what the guards saw, to the bit."""
    force = Channel(
        name="force",
        quantity="force",
        unit="kN",
        calibration=Calibration(coefficients=(0.0, 0.01, 1e-9), falling=(0.5, 0.01, 1e-9), turn_counts=50),
    )
    wire = WIRE.model_copy(
        update={"calibration": Calibration(table=((0.0, 0.0), (500.0, 3.0), (1000.0, 12.0)))}
    )
    facts = replace(FACTS, channels=(force, wire))
    counts = np.rint(500 + 400 * np.sin(np.linspace(0.0, 20.0, 1000))).astype(np.int64)
    branches = {"force": Branch()}
    seen = [
        scale(
            SampleBlock(
                "controller", at, np.arange(at, at + size), {"force": part, "stroke_1": part}, 0, 0.0
            ),
            facts,
            branches,
        )
        for at in range(0, 1000, size)
        for part in (counts[at : at + size],)
    ]
    for channel in (force, wire):
        online = np.concatenate([one.values[channel.name] for one in seen])
        recorded = Channel.model_validate(channel.model_dump(mode="json"))
        assert np.array_equal(online, recorded.calibration.apply(counts))


@pytest.mark.slow
def test_the_tilt_that_the_stand_file_allows_is_the_guards(tmp_path: Path) -> None:
    case = Case(tmp_path)
    facts = replace(CAMPAIGN_FACTS, stand={"stand": {"id": "fake", "tilt_max_mm": 0.8}})
    outcome = run_campaign(
        case.plan, case.stand, case.clock, case.out, facts, progress=case.shown, stop_request=case.request
    )
    guards = open_run(outcome.runs[0]).metadata["limits"]["guards"]["channels"]
    (tilt,) = [guard for guard in guards if guard["signal"] == "tilt"]
    assert (tilt["lower"], tilt["upper"]) == (-0.8, 0.8)
