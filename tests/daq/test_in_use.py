"""A stand that moves, or that another program commands, is said to be so before anything else is judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.drivers.interfaces import Controller, MotionState
from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.drivers.simulated.wires.modbus_requests import EXCHANGE, READ_HOLDING, READ_INPUT
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.errors import ExitStatus
from bufferstand.foundation.motions import Harmonic, RampTo
from tests.daq.fake_stand import Orders
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign
from tests.daq.test_round_trips import SHORT
from tests.daq.test_runner import Case

MEAN_MM, AMPLITUDE_MM = 20.0, 5.0
PROFILES = {
    "ring": load_profile("ring"),
    "without function 23": replace(load_profile("ring"), read_write=False),
    "polled": load_profile("polling"),
}


@pytest.mark.parametrize(
    ("state", "mm", "fault", "told"),
    [
        (MotionState.RAMPING, 10.75, 0, "a motion is under way that this start has not commanded (ramping,"),
        (MotionState.WAVEFORM, 0.0, 0, "a motion is under way that this start has not commanded (waveform,"),
        (MotionState.RELEASING, 3.0, 0, "a motion is under way that this start has not commanded (releasing"),
        (MotionState.HOLDING, 10.75, 0, "it holds under more than 5 kN, which this start has not commanded"),
        (MotionState.RELEASING, 10.75, 1, "takes the force away by itself, fault 1 (watchdog) (releasing"),
    ],
)
def test_a_motion_under_way_is_said_before_any_channel_is_judged(
    tmp_path: Path, state: MotionState, mm: float, fault: int, told: str
) -> None:
    case = Case(tmp_path)
    case.controller.state, case.controller.mm, case.controller.fault_code = state, mm, fault
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert told in outcome.reason
    assert "valve is off" in outcome.reason, "what to wait for"
    assert "at rest" not in outcome.reason
    assert set(case.controller.calls) <= {"connect", "seen_writer", "status", "close"}


def test_who_gives_commands_is_named(tmp_path: Path) -> None:
    case = Case(tmp_path, orders=Orders(writer=4711))
    outcome = case.run()
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert (
        "another program gives the controller commands: a program that this computer knows nothing of "
        "(number 4711) (ready, force 0.0 kN" in outcome.reason
    )
    assert "If it was killed, wait, 10 s at most: the controller's watchdog" in outcome.reason
    assert "10 s after that program's last heartbeat" in outcome.reason
    assert set(case.controller.calls) <= {"connect", "seen_writer", "status", "close"}


@pytest.mark.slow
@pytest.mark.parametrize("writer", [None, 0])
def test_a_hold_without_force_that_nobody_commands_is_no_obstacle(tmp_path: Path, writer: int | None) -> None:
    case = Case(tmp_path, orders=Orders(writer=writer))
    case.controller.state = MotionState.HOLDING
    assert case.run().status == "complete"


def sine_left_running(opened: InProcessStand) -> None:
    """Let a sine run that nobody looks after any more, with the valve's watchdog far off."""
    controller: Controller = opened.stand.controller
    controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=60_000)
    sequence = controller.start(RampTo(target_mm=MEAN_MM, speed_mm_per_s=100.0))
    while controller.status().done_sequence != sequence:
        opened.clock.sleep(0.01)
    controller.start(Harmonic(mean_mm=MEAN_MM, amplitude_mm=AMPLITUDE_MM, frequency_Hz=1.0, cycles=100))
    opened.clock.sleep(2.1)


def written_by(request: bytes, profile: Profile) -> bool:
    """Return whether a request writes anything but the number that a snapshot repeats."""
    if request[0] in (READ_HOLDING, READ_INPUT):
        return False
    number = profile.registers.get("request_number")
    at = int.from_bytes(request[5:7]) if request[0] == EXCHANGE else int.from_bytes(request[1:3])
    return number is None or at != number.address


def start_over(
    folder: Path, opened: InProcessStand, stand_file: StandFile, name: str, written: list[bytes]
) -> CampaignOutcome:
    """Start a campaign on a stand that is open already; collect what it writes."""
    profile = PROFILES[name]

    def seen(request: bytes) -> str:
        if written_by(request, profile):
            written.append(request)
        return ""

    plan, _ = sample_plan(folder / "campaign.toml")
    stand = behind_a_wire(opened, stand_file, lambda: 0.001, profile, seen)
    return run_campaign(plan, stand, opened.clock, folder / "out", facts_of(stand_file))


@pytest.mark.slow
@pytest.mark.parametrize("name", PROFILES)
def test_the_sine_of_a_program_that_was_killed_runs_on_untouched(tmp_path: Path, name: str) -> None:
    _, stand_file = sample_plan(campaign(tmp_path, SHORT))
    opened = open_in_process(stand_file, log_truth=False)
    sine_left_running(opened)
    written: list[bytes] = []
    outcome = start_over(tmp_path, opened, stand_file, name, written)
    assert (outcome.status, outcome.exit_status) == ("refused", ExitStatus.DEVICE_FAULT)
    assert "a motion is under way that this start has not commanded (waveform, force" in outcome.reason
    assert "hook the wire in anew" not in outcome.reason
    assert written == []
    assert opened.device.controller.state is MotionState.WAVEFORM
