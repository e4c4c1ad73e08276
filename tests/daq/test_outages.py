"""Outages of the controller's wire, in virtual time: ridden out whole, or stopped; never half of either."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.acquisition.outage import OutageHandler
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.drivers.controllers.outage_limit import RESERVE_S, OutageLimit
from bufferstand.drivers.delivery_rate.blocks import FEED_S
from bufferstand.drivers.interfaces import ControllerStatus, EndReason, MotionState
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.register_wire import Lost
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.foundation.errors import ExitStatus
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run
from tests.daq.cases import HARMONIC, Lines
from tests.daq.fake_stand import Orders
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.daq.test_in_process import campaign
from tests.daq.test_runner import Case as RunnerCase

STEPS = """
[[step]]
kind = "harmonic"
prestress_mm = 15.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 3
[[step]]
kind = "hold"
stroke_mm = 5.0
duration_s = 2.0
record = true
"""
WATCHDOG_S = 2.0
TIMEOUT_S = 0.5
ENDS_S = 13.0
"""The campaign is over by then."""
SURE_S = OutageLimit(WATCHDOG_S, 2.0, ring=True).longest_s(TIMEOUT_S)


@dataclass
class Wire:
    """A wire that is dead for some spans of stand time: requests get lost on the way, or their replies."""

    spans: tuple[tuple[float, float], ...]
    what: Lost = "request"
    opened: InProcessStand | None = None
    asked: int = 0

    def lost(self, request: bytes) -> Lost:  # noqa: ARG002 - whatever is asked
        assert self.opened is not None
        now_s = self.opened.clock.now_s()
        dead = any(start_s <= now_s < start_s + for_s for start_s, for_s in self.spans)
        self.asked += dead
        return self.what if dead else ""


@dataclass
class Case:
    outcome: CampaignOutcome
    opened: InProcessStand
    lines: list[str]
    runs: list[Run]
    asked: int

    @property
    def notes(self) -> list[str]:
        return [line for line in self.lines if "without the controller" in line]

    def made_and_recorded(self) -> None:
        """Every sample between the first and the last of each run is in it, once, or counted as lost."""
        truth_us = self.opened.truth.arrays()["time_us"]
        for run in self.runs:
            time_us = np.asarray(run.stream_of("force").time)
            inside = truth_us[(truth_us >= time_us[0]) & (truth_us <= time_us[-1])]
            assert len(np.unique(time_us)) == len(time_us)
            assert len(inside) == len(time_us) + sum(gap.lost for gap in run.gaps("controller"))


def run_case(folder: Path, wire: Wire, steps: str = STEPS, faults: Sequence[ScheduledFault] = ()) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    plan, stand_file = sample_plan(campaign(folder, steps))
    assert stand_file.controller.watchdog_s == WATCHDOG_S
    opened = wire.opened = open_in_process(stand_file, faults=faults)
    stand = behind_a_wire(opened, stand_file, lambda: 0.001, lost=wire.lost)
    shown = Lines()
    outcome = run_campaign(plan, stand, opened.clock, folder / "out", facts_of(stand_file), progress=shown)
    opened.clock.sleep(8.0)
    return Case(outcome, opened, shown.lines, [open_run(path) for path in outcome.runs], wire.asked)


def test_an_outage_in_a_sine_costs_nothing_and_is_said(tmp_path: Path) -> None:
    case = run_case(tmp_path, Wire(((5.0, 0.9),)))
    assert (case.outcome.status, case.outcome.exit_status) == ("complete", ExitStatus.DONE), case.outcome
    case.made_and_recorded()
    assert all(run.gaps("controller") == [] for run in case.runs)
    (line,) = case.notes
    assert "samples were read later, none lost" in line
    (event,) = (event for event in case.runs[0].events if "without the controller" in event.text)
    assert event.kind == "note"
    assert 0.9 <= event.data["value"] < 1.3
    read = int(event.text.split(": ")[1].split()[0])
    assert read == pytest.approx(1000.0 * event.data["value"], abs=150), "1 kHz"
    assert case.opened.device.controller.watchdog.trips == 0


@pytest.mark.parametrize("what", ["request", pytest.param("reply", marks=pytest.mark.long)])
def test_outages_in_every_phase_are_ridden_out(tmp_path: Path, what: Lost) -> None:
    """In ramps, cycles, holds, between steps and in the release; at those that meet a command, in it."""
    spans = tuple((start_s, SURE_S) for start_s in np.arange(1.5, ENDS_S, 2.03))
    case = run_case(tmp_path, Wire(spans, what))
    assert (case.outcome.status, case.outcome.exit_status) == ("complete", ExitStatus.DONE), case.outcome
    case.made_and_recorded()
    assert all(run.gaps("controller") == [] for run in case.runs)
    assert len(case.notes) >= 5
    assert all("none lost" in line for line in case.notes)
    assert case.opened.device.controller.watchdog.trips == 0


@pytest.mark.parametrize(
    "start_s",
    [
        pytest.param(5.0, marks=pytest.mark.long),
        pytest.param(3.4, marks=pytest.mark.long),
        pytest.param(10.0, marks=pytest.mark.long),
    ],
)
def test_an_outage_beyond_the_watchdog_ends_as_before(tmp_path: Path, start_s: float) -> None:
    case = run_case(tmp_path, Wire(((start_s, 3.5),)))
    assert case.outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert "its watchdog (2 s) acts by itself" in case.outcome.reason
    assert [run.status for run in case.runs][-1] == "failed"
    assert not case.opened.device.controller.valve_on
    truth = case.opened.truth.arrays()
    loaded_us = truth["time_us"][np.abs(truth["force_kN"]) > 2.0]
    assert loaded_us[-1] / 1e6 < start_s + WATCHDOG_S + 3.0, "its own watchdog has unloaded it"
    case.made_and_recorded()


@pytest.mark.long
@pytest.mark.parametrize("seed", range(40))
def test_any_outage_is_ridden_out_whole_or_stopped(tmp_path: Path, seed: int) -> None:
    """0.05 to 3 s, at any moment from the first look to the end; twice in a row, too."""
    draw = np.random.default_rng(seed)
    start_s, for_s, pause_s, again_s = draw.uniform((0.1, 0.05, 0.01, 0.0), (ENDS_S, 3.0, 2.0, 1.5))
    wire = Wire(
        ((start_s, for_s), (start_s + for_s + pause_s, again_s)),
        "reply" if draw.integers(2) else "request",
    )
    case = run_case(tmp_path, wire)
    case.made_and_recorded()
    device = case.opened.device.controller
    assert not device.valve_on
    assert abs(case.opened.truth.arrays()["force_kN"][-1]) < 1.0
    if case.outcome.status == "complete":
        assert device.watchdog.trips == 0
        assert all(run.gaps("controller") == [] for run in case.runs)
    else:
        assert case.outcome.exit_status == ExitStatus.DEVICE_FAULT
        assert for_s > SURE_S or again_s > 0.3 or not case.runs, case.outcome.reason


# --- what happened meanwhile -------------------------------------------------------------------------


def test_an_excess_of_the_outage_trips_as_soon_as_it_is_over(tmp_path: Path) -> None:
    """A draw wire breaks in the middle of it: that very sample trips, and the stand unloads."""
    broken = ScheduledFault("stroke_1", "broken", 5.6, settings={"side": "high"})
    case = run_case(tmp_path, Wire(((5.0, SURE_S),)), faults=[broken])
    assert case.outcome.status == "stopped"
    (run,) = case.runs
    trip = next(event for event in run.events if event.kind == "trip")
    assert trip.data["guard"] in ("stroke", "tilt", "speed", "wiring of stroke_2")
    truth = case.opened.truth.arrays()
    assert truth["time_us"][np.searchsorted(truth["sequence"], 5600)] <= trip.data["time_us"]
    assert trip.data["time_us"] < truth["time_us"][np.searchsorted(truth["sequence"], 5700)]
    assert sum("samples were read later, none lost" in event.text for event in run.events) == 1
    stopped = next(event for event in run.events if event.kind == "safe stop")
    assert trip.time_s < stopped.time_s < trip.time_s + 5.0
    assert case.outcome.safe_stop is not None
    assert case.outcome.safe_stop.safe
    case.made_and_recorded()


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        pytest.param(
            ScheduledFault("controller", "overrun", 5.2, 5.3), "its ring lost", marks=pytest.mark.long
        ),
        pytest.param(
            ScheduledFault("controller", "trip", 5.5), "it reports fault 4 (actuator)", marks=pytest.mark.long
        ),
        (ScheduledFault("controller", "watchdog", 5.5), "its watchdog ran out"),
        pytest.param(
            ScheduledFault("controller", "clock-jump", 5.5), "cannot be true", marks=pytest.mark.long
        ),
    ],
    ids=["overrun", "trip", "watchdog", "clock-jump"],
)
def test_what_does_not_fit_behind_an_outage_stops(tmp_path: Path, fault: ScheduledFault, said: str) -> None:
    case = run_case(tmp_path, Wire(((5.0, 1.0),)), faults=[fault])
    assert case.outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert said in case.outcome.reason
    assert not case.opened.device.controller.valve_on
    assert [run.status for run in case.runs] == ["failed"]


STATUS = ControllerStatus(MotionState.WAVEFORM, 0, 4, EndReason.NONE, 1, 1, 0, 0.0, 0.0, 0.0, 0.0)


@dataclass
class Reached:
    """What is found when the controller is reached again."""

    after: ControllerStatus = STATUS
    seen: int = 0
    overwritten: int = 0
    calls: str = ""

    def feed_first(self) -> None:
        self.calls += "feed "

    def read_backlog(self, limit_s: float) -> bool:
        self.calls += f"read {limit_s:g} "
        self.seen += 900
        return True

    def look_anew(self) -> ControllerStatus:
        self.calls += "look "
        return self.after


def outage(
    before: ControllerStatus,
    after: ControllerStatus,
    *,
    writer: int | None = 0,
    commanding: bool = False,
    waits: bool = False,
    ask_anew: Callable[[], str] = lambda: "",
    for_s: float = 0.9,
) -> tuple[Trip, Reached, OutageHandler]:
    """Come back from an outage that began at 100 s of the wall."""
    rides = OutageHandler(OutageLimit(2.0, 2.0, ring=True), lambda: writer, ask_anew, lambda: 1.0e9)
    reached = Reached(after)
    with rides.while_waiting() if waits else nullcontext():
        rides.begin(100.0, 100.5, before, reached, commanding=commanding)
        assert rides.is_out
        trip = rides.come_back(reached, lambda: 100.0 + for_s, 7.0)
    assert not rides.is_out
    return trip, reached, rides


def test_it_is_fed_first_then_read_then_looked_at() -> None:
    trip, reached, _ = outage(STATUS, STATUS)
    assert reached.calls == "feed read 2 look "
    assert trip.action is Action.NOTE
    assert trip.reason.startswith("0.9 s without the controller at ")
    assert trip.reason.endswith(": 900 samples were read later, none lost")
    assert (trip.value, trip.unit) == (pytest.approx(0.9), "s")


HOLDS = replace(STATUS, state=MotionState.HOLDING)


@pytest.mark.parametrize(
    ("before", "after", "writer", "said"),
    [
        (STATUS, replace(STATUS, state=MotionState.OFF), 0, "its valve is off (state off)"),
        (replace(STATUS, state=MotionState.OFF), HOLDS, 0, "its valve is on (state holding)"),
        (HOLDS, STATUS, None, "a motion began that this program has not commanded (waveform)"),
        (STATUS, STATUS, 4711, "another program (number 4711) gives it commands now"),
    ],
)
def test_a_controller_that_does_something_else_stops(
    before: ControllerStatus, after: ControllerStatus, writer: int | None, said: str
) -> None:
    trip, _, _ = outage(before, after, writer=writer)
    assert (trip.guard, trip.action, trip.device_fault) == ("controller", Action.EMERGENCY, True)
    assert said in trip.reason


def test_a_motion_that_ended_meanwhile_or_that_was_being_commanded_fits() -> None:
    assert outage(STATUS, HOLDS)[0].action is Action.NOTE
    assert outage(HOLDS, STATUS, commanding=True)[0].action is Action.NOTE


@given(watchdog_s=st.floats(0.1, 65.0), silence_s=st.floats(0.1, 100.0), timeout_s=st.floats(0.01, 10.0))
def test_what_is_promised_is_within_watchdog_and_silence(
    watchdog_s: float, silence_s: float, timeout_s: float
) -> None:
    longest_s = OutageLimit(watchdog_s, silence_s, ring=True).longest_s(timeout_s)
    assert longest_s >= 0.0
    assert longest_s == 0.0 or longest_s <= min(watchdog_s - FEED_S, silence_s) - RESERVE_S
    assert OutageLimit(watchdog_s, silence_s, ring=False).longest_s(timeout_s) == 0.0


@pytest.mark.parametrize(
    ("fed_s", "wall_s", "ring", "said"),
    [
        (100.0, 101.7, True, ""),
        (100.0, 101.9, True, "not fed for 1.9 s, its watchdog (2 s) acts by itself"),
        (None, 101.7, True, ""),
        (None, 101.9, True, "controller_silence_s = 2 s"),
        (-math.inf, 100.5, True, "had not been fed yet"),
        (100.0, 100.5, False, "keeps no samples"),
    ],
)
def test_when_an_outage_is_given_up(fed_s: float | None, wall_s: float, ring: bool, said: str) -> None:
    rides = OutageHandler(OutageLimit(2.0, 2.0, ring=ring), lambda: 0, lambda: "", lambda: 0.0)
    rides.begin(100.0, 100.2, STATUS, Reached(), commanding=False)
    why = rides.over(100.0, fed_s, wall_s)
    assert said in why if said else why == ""
    assert rides.is_out is (said == "")


# --- waiting with the valve off ----------------------------------------------------------------------

WARM = HARMONIC.replace("cycles = 3", "cycles = 8")
WAITS = 'on_temperature_stop = "wait-and-continue"'


def slowly_cooled_C(at_s: float) -> float:  # noqa: N802 - the unit keeps its capital
    """Return 25 °C, 41 °C from 5 s on, and from there down at a rate that a spring in air has."""
    return 25.0 if at_s <= 5.0 else max(25.0, 41.0 - 0.035 * (at_s - 5.0))


def cooling(orders: Orders, folder: Path) -> tuple[CampaignOutcome, RunnerCase]:
    """Run a campaign that is too warm at 5 s, and cool enough some three minutes later."""
    case = RunnerCase(folder, WARM, orders, limits=WAITS, reading=slowly_cooled_C)
    return case.run(settings=COARSE), case


@pytest.mark.parametrize("counts_off", [pytest.param(False, marks=pytest.mark.long), True])
def test_minutes_without_a_controller_are_waited_for_while_the_specimen_cools(
    tmp_path: Path, counts_off: bool
) -> None:
    """Its watchdog has run out by then: it is asked as at a start, and the fault is reset when it goes on."""
    orders = Orders(lost=lambda t: 20.0 <= t < 150.0, watchdog_counts_off=counts_off)
    outcome, case = cooling(orders, tmp_path)
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    shown = case.shown.lines
    assert sum("130 s without the controller at" in line and "as at a start" in line for line in shown) == 1
    assert sum("it is asked on" in line for line in shown) == 2, "once a minute"
    assert any("watchdog had run out before" in line for line in shown) is counts_off
    assert 100 < case.controller.calls.count("connect") < 200, "about once a second"
    assert case.controller.calls.count("enable") == 2


def test_a_stand_that_somebody_else_uses_by_then_is_left_to_him(tmp_path: Path) -> None:
    orders = Orders(lost=lambda t: 20.0 <= t < 40.0)
    case = RunnerCase(tmp_path, WARM, orders, limits=WAITS, reading=lambda t: 41.0 if t > 5.0 else 25.0)
    seen = case.controller.seen_writer
    case.controller.seen_writer = (  # type: ignore[method-assign]
        lambda: (
            replace(seen(), number=4711, who="a program that this computer knows nothing of (number 4711)")
            if case.clock.now_s() > 40.0
            else seen()
        )
    )
    outcome = case.run(settings=COARSE)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert (
        "gives the controller commands: a program that this computer knows nothing of (number 4711)"
        in outcome.reason
    )
    assert case.clock.now_s() < 70.0, "one that gives no sign of life is waited for, as at a start"


def test_with_the_valve_off_a_quarter_of_an_hour_is_waited_and_no_longer() -> None:
    rides = OutageHandler(OutageLimit(2.0, 2.0, ring=False), lambda: 0, lambda: "", lambda: 0.0)
    off = replace(STATUS, state=MotionState.OFF)
    with rides.while_waiting():
        rides.begin(100.0, 101.0, off, Reached(), commanding=False)
        assert rides.over(100.0, 100.0, 999.0) == ""
        assert rides.is_out
        assert "900 s at most are waited for with the valve off" in rides.over(100.0, 100.0, 1001.0)
    assert not rides.is_out
    rides.begin(100.0, 101.0, off, Reached(), commanding=False)
    assert rides.over(100.0, 100.0, 110.0), "nothing waits any more"


@pytest.mark.parametrize("for_s", [pytest.param(0.3, marks=pytest.mark.long), 1.4])
def test_the_same_short_outage_is_ridden_out_while_it_waits(tmp_path: Path, for_s: float) -> None:
    outcome, case = cooling(Orders(lost=lambda t: 20.0 <= t < 20.0 + for_s), tmp_path)
    assert outcome.status == "complete", outcome.reason
    assert sum("samples were read later, none lost" in line for line in case.shown.lines) == 1
    assert case.controller.calls.count("connect") == 1
