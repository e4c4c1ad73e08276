"""What is no number never reads as fine: not in a sample, a status, a reading at rest, or a safe stop."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.guards.kinds.controller import ControllerMemory, evaluate_status
from bufferstand.daq.guards.kinds.status_force import (
    APART_KN,
    LASTS_S,
    StatusForceMemory,
    evaluate_status_force,
)
from bufferstand.daq.guards.panel import GuardPanel
from bufferstand.daq.guards.trips import Action
from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopSettings
from bufferstand.daq.scaling import ScaledBlock, scale
from bufferstand.daq.stand.in_use import use_trouble
from bufferstand.daq.stand.start_checks import apart_trouble, stroke_trouble, zero_trouble
from bufferstand.drivers.interfaces import ControllerStatus, EndReason, MotionState, SampleBlock, Stand
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.foundation.errors import DeviceFault
from bufferstand.protocols.campaign_file.zero_table import ZeroTable
from bufferstand.recording.runfile.file import open_run
from tests.daq.fake_stand import CONTROLLER_FACTS, FakeClock, FakeController
from tests.daq.run_in_process import sample_plan
from tests.daq.test_guard_table import panel, reading
from tests.daq.test_in_process import GENTLE, campaign
from tests.daq.test_in_process import run as run_in_process
from tests.daq.test_stop_eyes import eyes_on

NO_NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf])
CHANNELS = [channel.name for channel in CONTROLLER_FACTS.channels]


def block_with(name: str, wrong: float, *, rows: int, first: int, last: int) -> ScaledBlock:
    """Samples of a slow ramp at 1 kHz, of which one channel is no number in some rows."""
    mm = np.linspace(1.0, 2.0, rows)
    counts = dict.fromkeys(CHANNELS, mm / 0.01) | {"force": 5.0 * mm / 0.001}
    counts[name][first:last] = wrong
    time_us = (1 + np.arange(rows, dtype=np.int64)) * 1000
    return scale(SampleBlock("controller", 1, time_us, counts, 0, 1.0), CONTROLLER_FACTS)


def status(
    *, state: MotionState = MotionState.OFF, force_kN: float = math.nan, fault_code: int = 0
) -> ControllerStatus:
    return ControllerStatus(state, fault_code, 1, EndReason.REACHED, 0, 7, 0, force_kN, 0.0, 0.0, 0.0)


@given(name=st.sampled_from(CHANNELS), wrong=NO_NUMBERS, first=st.integers(0, 300))
@pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")  # inf − inf is nan
def test_a_channel_without_numbers_stops_whatever_guard_says_it(name: str, wrong: float, first: int) -> None:
    watched = panel()
    watched.observe(block_with(name, wrong, rows=700, first=first, last=700), 1.0)
    assert watched.action >= Action.STOP
    assert watched.trip is not None


@given(name=st.sampled_from(["force", "stroke_1", "stroke_2"]), wrong=NO_NUMBERS, row=st.integers(0, 199))
@pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")
def test_one_such_sample_of_force_or_stroke_is_an_emergency(name: str, wrong: float, row: int) -> None:
    watched = panel()
    watched.observe(block_with(name, wrong, rows=200, first=row, last=row + 1), 1.0)
    assert watched.action is Action.EMERGENCY


@given(wrong=NO_NUMBERS)
def test_a_temperature_without_numbers_is_silence(wrong: float) -> None:
    watched = panel()
    watched.observe(reading(21.0, 0), 0.5)
    for number in range(1, 30):
        at_s = 0.5 + number
        watched.observe(reading(wrong, number, at_s=at_s), at_s)
        watched.listen(at_s, at_s)
    assert watched.latest_temperatures()["temperature_1"] == 21.0
    assert any(trip.guard == "temperature_1" and trip.action is Action.STOP for trip in watched.said())
    assert watched.warmer_than() == "", "the last true reading counts until its silence trips"


def agreement_of(force_2_kN: float) -> GuardPanel:
    watched = panel()
    for second in range(40):
        time_us = np.array([second * 1_000_000])
        for stream, name, value in (("controller", "force", 0.0), ("amplifier", "force_2", force_2_kN)):
            watched.observe(
                ScaledBlock(stream, second, time_us, {name: np.array([value])}, 0, float(second)), 0.0
            )
    return watched


@given(wrong=NO_NUMBERS)
def test_a_second_force_without_numbers_does_not_agree(wrong: float) -> None:
    assert any(trip.guard == "agreement" for trip in agreement_of(wrong).said())
    assert not any(trip.guard == "agreement" for trip in agreement_of(0.0).said())


@given(wrong=NO_NUMBERS)
def test_nothing_at_rest_is_fine_that_is_no_number(wrong: float) -> None:
    why, refused = zero_trouble(wrong, 5.0, tared=True)
    assert refused
    assert "more than zero_force_max_kN" in why
    wires = {"stroke_1": wrong, "stroke_2": 0.0}
    assert stroke_trouble(wires, None, ZeroTable(), touched=False).startswith("stroke_1 reads")
    assert apart_trouble(wires, 5.0)
    clock = FakeClock()
    controller = FakeController(clock)
    controller.status = lambda: status(state=MotionState.HOLDING, force_kN=wrong)  # type: ignore[method-assign]
    assert use_trouble(controller, clock, 5.0).startswith("it holds under more than 5 kN")


@given(wrong=NO_NUMBERS, code=st.integers(2, 4))
def test_no_fault_from_before_is_forgiven_over_a_force_without_number(wrong: float, code: int) -> None:
    shown = status(state=MotionState.FAULT, force_kN=wrong, fault_code=code)
    memory, trip = evaluate_status(ControllerMemory(0.0, 0.0), shown, 0.0, 0.0)
    assert memory.forgiven is None
    assert trip is not None
    assert trip.action is Action.EMERGENCY


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("sampled", [False, True])
def test_a_safe_stop_is_never_safe_by_a_force_without_number(wrong: float, sampled: bool) -> None:
    clock = FakeClock()
    controller = FakeController(clock)
    controller.status = lambda: status(force_kN=wrong)  # type: ignore[method-assign]
    eyes, _ = eyes_on(clock, stand=_stand_of(controller))
    if sampled:  # the samples' force is broken, too
        eyes.take(block_with("force", wrong, rows=40, first=0, last=40))
    report = SafeStop(controller, clock, SafeStopSettings(20.0, 2.0), eyes=eyes).run()
    assert not report.safe
    assert "NOT SAFE" in report.line


def _stand_of(controller: FakeController) -> Stand:
    return Stand(controller, ())


# --- the controller's own reading --------------------------------------------------------------------


def looked(shown_kN: float, sampled_kN: float, *, for_s: float = 3.0) -> list[tuple[float, str]]:
    memory, said = StatusForceMemory(), []
    for at_s in np.arange(0.0, for_s, 0.2):
        memory, trip = evaluate_status_force(memory, shown_kN, sampled_kN, at_s=at_s, wall_s=at_s)
        if trip is not None:
            assert trip.action is Action.NOTE
            said.append((float(at_s), trip.reason))
    return said


@given(wrong=NO_NUMBERS, sampled_kN=st.floats(-20.0, 620.0))
def test_a_reading_without_number_is_said_once_after_a_second(wrong: float, sampled_kN: float) -> None:
    ((at_s, text),) = looked(wrong, sampled_kN)
    assert LASTS_S <= at_s < LASTS_S + 0.3
    assert "reading of the force is no number for" in text


@given(sampled_kN=st.floats(-20.0, 620.0), share=st.floats(-0.08, 0.08), off_kN=st.floats(-9.0, 9.0))
def test_one_that_fits_is_not_said(sampled_kN: float, share: float, off_kN: float) -> None:
    share_kN, most_kN = share * abs(sampled_kN), max(APART_KN, 0.1 * abs(sampled_kN)) - 1e-9
    shown_kN = sampled_kN + max(-most_kN, min(most_kN, share_kN + off_kN * (abs(share_kN) < 1.0)))
    assert looked(shown_kN, sampled_kN) == []


def test_a_tenth_is_seen_in_cycles_that_pass_through_zero() -> None:
    memory, said = StatusForceMemory(), []
    for at_s in np.arange(0.0, 5.0, 0.2):
        sampled_kN = 150.0 * abs(math.sin(math.pi * at_s))
        memory, trip = evaluate_status_force(memory, 0.1 * sampled_kN, sampled_kN, at_s=at_s, wall_s=at_s)
        said += [] if trip is None else [at_s]
    assert len(said) == 1
    assert said[0] < 2.5


@pytest.mark.slow
def test_22_s_without_a_reading_are_noted_in_the_run_and_shown(tmp_path: Path) -> None:
    fault = ScheduledFault("controller", "nan", 5.0, 27.0, settings={"register": "force"})
    outcome, _, shown = run_in_process(tmp_path, GENTLE, faults=[fault])
    assert outcome.status == "complete", outcome.reason
    run = open_run(outcome.runs[0])
    (event,) = (event for event in run.events if event.data.get("guard") == "status force")
    assert event.kind == "note"
    assert "is no number for 1." in event.text
    assert sum("own reading of the force is no number" in line for line in shown.lines) == 1
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe
    assert outcome.safe_stop.force_source.startswith("channel force")


@pytest.mark.slow
def test_nothing_is_switched_on_whose_own_force_is_no_number(tmp_path: Path) -> None:
    fault = ScheduledFault("controller", "nan", 0.0, settings={"register": "force"})
    outcome, opened, _ = run_in_process(tmp_path, GENTLE, faults=[fault])
    assert (outcome.status, outcome.exit_status) == ("refused", 4)
    assert "not switched on: its own force reads nan" in outcome.reason
    assert not opened.device.controller.valve_on
    assert opened.device.controller.echo_sequence == 0


@pytest.mark.slow
def test_the_simulated_controller_itself_refuses(tmp_path: Path) -> None:
    _, stand_file = sample_plan(campaign(tmp_path, GENTLE))
    opened = open_in_process(
        stand_file, faults=[ScheduledFault("controller", "nan", 0.0, settings={"register": "force"})]
    )
    with pytest.raises(DeviceFault, match="own force reads nan"):
        opened.stand.controller.enable(force_limit_kN=100.0, stroke_limit_mm=100.0, watchdog_ms=2000)
