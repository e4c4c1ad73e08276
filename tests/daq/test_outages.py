"""Outages of the controller's wire, in virtual time: ridden out whole, or stopped; never half of either."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from daq.runner import CampaignOutcome, run_campaign
from drivers.leeway import Leeway
from drivers.simulated.inprocess import InProcessStand, open_in_process
from drivers.simulated.virtual_link import Lost, behind_a_wire
from foundation.errors import ExitStatus
from recording.run import Run
from recording.runfile import open_run
from tests.daq.cases import Lines
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

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
SURE_S = Leeway(WATCHDOG_S, 2.0, ring=True).longest_s(TIMEOUT_S)


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


def run_case(folder: Path, wire: Wire, steps: str = STEPS) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    plan, stand_file = sample_plan(campaign(folder, steps))
    assert stand_file.controller.watchdog_s == WATCHDOG_S
    opened = wire.opened = open_in_process(stand_file)
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
    "start_s", [5.0, pytest.param(3.4, marks=pytest.mark.long), pytest.param(10.0, marks=pytest.mark.long)]
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
