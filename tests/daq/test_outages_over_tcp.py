"""Campaigns over a TCP connection that breaks at random: ridden out whole, or stopped and safe."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign_folder.run_metadata import CampaignMetadata
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import MotionState, Stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import ExitStatus
from bufferstand.recording.runfile.file import open_run
from tests.contract.stand.backends import write_stand
from tests.daq.broken_wire import HOWS, BrokenWire, How, broken_wire
from tests.daq.cases import Lines
from tests.daq.killing import HEAD, STEP
from tests.daq.run_in_process import sample_plan

WATCHDOG_S = 4.0
SHORT_S = 1.2
"""Ridden out whatever a busy computer does besides: the watchdog of 4 s allows 3 s."""
BUSY = ("behind the stand for", "the ring was read too late", "stood still", "its own watchdog")


class Breaking(Lines):
    """Breaks the wire in a thread of its own, a moment after the first motion has begun."""

    def __init__(self, wire: BrokenWire, breaks: list[tuple[float, How, float]]) -> None:
        super().__init__()
        self._wire, self._breaks = wire, breaks
        self._began = threading.Event()
        self.thread = threading.Thread(target=self._break)
        self.thread.start()

    def update(self, progress: CampaignProgress) -> None:
        if progress.phase in ("ramp", "motion"):
            self._began.set()

    def _break(self) -> None:
        self._began.wait(120.0)
        for pause_s, how, for_s in self._breaks:
            time.sleep(pause_s)
            self._wire.breaks(how, for_s)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StandFile]:
    folder = tmp_path_factory.mktemp("stand") / "bench"
    folder.mkdir()
    path = write_stand(folder, (("watchdog_s = 2.0", f"watchdog_s = {WATCHDOG_S}"),))
    with start_process(path, directory=folder / "stand") as process:
        yield with_endpoints(load_stand(path), process.served.endpoints())


def run_over(
    served: StandFile, folder: Path, breaks: list[tuple[float, How, float]], steps: int = 2
) -> tuple[CampaignOutcome, list[str], StandFile]:
    folder.mkdir(parents=True, exist_ok=True)
    stand_path = write_stand(folder, (("watchdog_s = 2.0", f"watchdog_s = {WATCHDOG_S}"),))
    text = HEAD.format(stand=stand_path) + f"controller_silence_s = {WATCHDOG_S}\n[zero]\ntouch = false\n"
    text += "".join(STEP.format(prestress=10.0 + i, amplitude=5.0, cycles=3) for i in range(steps))
    (folder / "campaign.toml").write_text(text)
    plan, file = sample_plan(folder / "campaign.toml")
    with broken_wire(served.controller.port) as wire:
        controller = served.controller.model_copy(update={"port": wire.own_port})
        wired, clock = served.model_copy(update={"controller": controller}), WallClock()
        stand = Stand(build_controller(wired, clock), build_sensors(wired, clock))
        shown = Breaking(wire, breaks)
        try:
            outcome = run_campaign(
                plan,
                stand,
                clock,
                folder / "out",
                CampaignMetadata(file.model_dump(mode="json"), WATCHDOG_S),
                progress=shown,
            )
        finally:
            shown._began.set()
            shown.thread.join()
            stand.close()
    return outcome, shown.lines, served


def whole(outcome: CampaignOutcome) -> None:
    """Every sample is in its run, or counted as lost; a run that is complete has lost none."""
    for path in outcome.runs:
        run = open_run(path)
        time_us = np.asarray(run.stream_of("force").time)
        made = round((time_us[-1] - time_us[0]) / 1000.0) + 1
        lost = sum(gap.lost for gap in run.gaps("controller"))
        assert len(time_us) + lost == made
        assert np.all(np.diff(time_us) > 0)


def comes_to_rest(served: StandFile) -> None:
    """See, on a wire of its own, that the stand unloads within the watchdog's time and a release."""
    onlooker = build_controller(served, WallClock())
    onlooker.connect()
    end_s = time.monotonic() + WATCHDOG_S + 60.0  # a busy computer
    try:
        while True:
            status = onlooker.status()
            if status.state in (MotionState.OFF, MotionState.READY, MotionState.FAULT):
                assert abs(status.force_kN) < 2.0
                return
            assert time.monotonic() < end_s, status
            time.sleep(0.05)
    finally:
        onlooker.close()


@pytest.mark.slow
def test_a_wire_that_is_silent_then_reset_is_ridden_out(served: StandFile, tmp_path: Path) -> None:
    outcome, lines, _ = run_over(served, tmp_path, [(0.7, "drop", 0.9), (1.5, "reset", 0.5)], steps=1)
    whole(outcome)
    comes_to_rest(served)
    if any(text in outcome.reason for text in BUSY):
        pytest.skip(f"a computer too busy to follow the stand: {outcome.reason}")
    assert (outcome.status, outcome.exit_status) == ("complete", ExitStatus.DONE), outcome.reason
    assert any("samples were read later, none lost" in line for line in lines), lines


@pytest.mark.long
@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("seed", range(6))
def test_every_kind_of_outage_at_any_moment(served: StandFile, tmp_path: Path, how: How, seed: int) -> None:
    """0.2 to 6 s: short ones cost nothing, long ones stop as before, and the samples always add up."""
    draw = np.random.default_rng((seed, HOWS.index(how)))
    for_s = float(draw.uniform(0.2, SHORT_S) if seed % 2 else draw.uniform(0.2, 6.0))
    outcome, lines, _ = run_over(served, tmp_path, [(float(draw.uniform(0.0, 6.0)), how, for_s)])
    whole(outcome)
    comes_to_rest(served)
    if outcome.status == "complete":
        assert outcome.exit_status == ExitStatus.DONE
        assert all(open_run(path).gaps("controller") == [] for path in outcome.runs)
        return
    assert outcome.exit_status == ExitStatus.DEVICE_FAULT, outcome.reason
    busy = any(text in outcome.reason for text in BUSY)
    assert for_s > SHORT_S or busy, (how, for_s, outcome.reason, lines[-8:])
    time.sleep(11.0)  # the controller keeps its lock for a program that fell silent
