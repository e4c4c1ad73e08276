"""kill -9, or a cut wire, while first contact is touched, a specimen warmed up or cycled between forces.

Whatever the program was doing, the controller's own watchdog takes the force away and closes the valve.
"""

from __future__ import annotations

import random
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.drivers.interfaces import ControllerStatus, MotionState
from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.foundation.errors import ExitStatus
from tests.daq import killing
from tests.daq.killing import (
    LOCK_S,
    TOO_BUSY,
    TRIES,
    WATCHDOG,
    Bench,
    Tally,
    bench,
    fallen_back,
    lived,
    start,
)
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.daq.test_in_process import campaign

GAP_MM = 1.0
PATIENCE_S = 240.0
"""For a program to come to its motion, on a busy machine [s of the wall]."""
STEPS = {
    "touching": """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
force_limit_kN = 100.0
cycles = 1
""",
    "warming": """
[[step]]
kind = "warm-up"
temperature_C = 25.0
band_K = 2.0
prestress_mm = 20.0
amplitude_mm = 10.0
frequency_Hz = 1.0
""",
    "cycling": """
[[step]]
kind = "force-cycles"
force_min_kN = 20.0
force_max_kN = 100.0
speed_mm_per_s = 20.0
cycles = 50
""",
}
FORCE_KN = {"warming": 30.0, "cycling": 50.0}
"""The force at which it is killed: the specimen is compressed then."""


def write(folder: Path, moment: str, stand: Path) -> Path:
    folder.mkdir(parents=True)
    path = folder / "campaign.toml"
    path.write_text(killing.HEAD.format(stand=stand) + STEPS[moment], encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    changes = {**WATCHDOG, "seed = 1\n": f"seed = 1\ngap_mm = {GAP_MM}\n"}
    with bench(tmp_path_factory.mktemp("under force") / "bench", changes) as made:
        yield made


def kill_at_force(stand: Bench, folder: Path, moment: str) -> ControllerStatus:
    """Start a campaign and kill its process as soon as the force is there; return what was seen then.

    One that a busy computer kept from following the stand ends by itself: it is made again.
    """
    for number in range(TRIES):
        tried = folder / f"{number}"
        child = start(stand, tried, write(tried, moment, stand.stand_file))
        try:
            if (status := force_seen(stand, tried, moment, child)) is not None:
                return status
        finally:
            child.kill()
            child.wait()
        said = (tried / "log").read_text()
        assert any(text in said for text in (*TOO_BUSY, "this program stood still")), said[-3000:]
        time.sleep(LOCK_S)
    pytest.skip("the computer is too busy to follow the stand")


def force_seen(
    stand: Bench, folder: Path, moment: str, child: subprocess.Popen[str]
) -> ControllerStatus | None:
    """Return the state as soon as the force is there; None where the program has ended before."""
    end_s = time.monotonic() + PATIENCE_S
    stage = folder / "stage"
    while time.monotonic() < end_s and child.poll() is None:
        if stage.exists() and stage.read_text().strip() == moment:
            status = stand.status()
            if status.force_kN >= FORCE_KN[moment]:
                return status
        time.sleep(0.005)
    return None


def taken_away(stand: Bench) -> Tally:
    """See the watchdog take the force away; wait until another program may use the controller."""
    tally, died_s = Tally(), time.monotonic()
    fallen_back(stand, tally)
    status = stand.status()
    assert abs(status.force_kN) < 1.0
    assert status.state in (MotionState.FAULT, MotionState.OFF)
    time.sleep(max(0.0, LOCK_S - (time.monotonic() - died_s)))
    return tally


@pytest.mark.parametrize("moment", [pytest.param("warming", marks=pytest.mark.long), "cycling"])
def test_a_program_killed_under_force_leaves_none(stand: Bench, tmp_path: Path, moment: str) -> None:
    at_kill = kill_at_force(stand, tmp_path / "killed", moment)
    assert at_kill.force_kN >= FORCE_KN[moment]
    assert taken_away(stand).fell_back == 1, "it was the watchdog"


def test_a_program_killed_as_it_touches_leaves_no_force(stand: Bench, tmp_path: Path) -> None:
    """It creeps at 0.5 mm/s: contact is after 2 s; the controller turns by itself, the valve is left open."""
    at_s = GAP_MM / 0.5
    folder = tmp_path / "killed"
    path = write(folder, "touching", stand.stand_file)
    assert lived(stand, folder, path, "touching", at_s) == -9, (folder / "log").read_text()[-3000:]
    assert (folder / "stage").read_text().strip() == "touching"
    assert taken_away(stand).fell_back == 1


@pytest.mark.long
@pytest.mark.parametrize("number", range(20))
@pytest.mark.parametrize("moment", STEPS)
def test_so_it_is_at_any_moment(stand: Bench, tmp_path: Path, moment: str, number: int) -> None:
    folder = tmp_path / "killed"
    path = write(folder, moment, stand.stand_file)
    after_s = random.Random(f"{moment} {number}").uniform(0.0, 4.0)
    assert lived(stand, folder, path, moment, after_s) == -9, (folder / "log").read_text()[-3000:]
    taken_away(stand)


# --- the wire is cut, in virtual time ---------------------------------------------------------------


def run(folder: Path, moment: str, lost_at_s: float) -> tuple[CampaignOutcome, InProcessStand]:
    """Run a campaign; from an instant on the wire to the controller is cut."""
    folder.mkdir()
    path = campaign(folder, STEPS[moment], zero="")
    text = (folder / "stand.toml").read_text(encoding="utf-8")
    (folder / "stand.toml").write_text(text + f"gap_mm = {GAP_MM}\n", encoding="utf-8")
    plan, stand_file = sample_plan(path)
    opened = open_in_process(stand_file, faults=[parse_fault(f"controller=lost@{lost_at_s:.3f}")])
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file), settings=COARSE
    )
    opened.stand.close()
    return outcome, opened


LATER_S = 60.0
"""By then each of them is under force [s of stand time]."""
LOSE_AT_KN = {"touching": 0.3, "warming": 60.0, "cycling": 90.0}


@pytest.mark.parametrize("moment", STEPS)
def test_a_wire_that_is_cut_under_force_leaves_none(tmp_path: Path, moment: str) -> None:
    _, later = run(tmp_path / "later", moment, LATER_S)
    truth = later.truth.arrays()
    first = int(np.flatnonzero(truth["force_kN"] > LOSE_AT_KN[moment])[0])
    lost_at_s = float(truth["time_us"][first]) / 1e6
    outcome, opened = run(tmp_path / "cut", moment, lost_at_s)
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT
    assert outcome.safe_stop is not None
    assert "its own watchdog (2 s) has to ramp to zero force" in outcome.safe_stop.line
    opened.clock.sleep(10.0)
    cut = opened.truth.arrays()
    at_loss = np.interp(lost_at_s * 1e6, cut["time_us"], cut["force_kN"])
    assert at_loss > 0.5 * LOSE_AT_KN[moment], "it was cut under force"
    assert abs(cut["force_kN"][-1]) < 0.5
    assert not opened.device.controller.valve_on
