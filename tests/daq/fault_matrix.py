"""Campaigns on the in-process stand with one fault each, injected in a chosen phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.drivers.simulated.faults.schedule import FAULTS, ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.recording.recorder import RunRecorder
from tests.daq.run_in_process import facts_of, sample_plan
from tests.daq.test_in_process import campaign

CHANNELS = ("force", "stroke_1", "stroke_2", "position")
"""Measured channels of the sample stand, each of which can fail."""
PHASES = ("before start", "ramp", "harmonic", "hold", "cool-down", "recording close")
_SEEN = {"ramp": "ramp", "harmonic": "motion", "hold": "hold", "cool-down": "cool-down"}

SHORT = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 1
"""
LONG = SHORT.replace("cycles = 1", "cycles = 7")
HOLD = '[[step]]\nkind = "hold"\nstroke_mm = 20.0\nduration_s = 8.0\nrecord = true\n'
COOL = '[[step]]\nkind = "cool-down"\ntemperature_C = 20.0\ntimeout_s = 8.0\n'
STEPS = {
    "before start": SHORT,
    "ramp": LONG,
    "harmonic": LONG,
    "hold": HOLD,
    "cool-down": SHORT + COOL,
    "recording close": SHORT + LONG,
}


def every_fault() -> list[tuple[str, str, Mapping[str, Any]]]:
    """Return every fault of the injector by target, kind and parameters; one sensor for all of its class."""
    found: list[tuple[str, str, Mapping[str, Any]]] = [
        ("controller", kind, {}) for kind in FAULTS["controller"]
    ]
    found += [("controller", "stuck", {"register": "force"}), ("controller", "trip", {"code": 2.0})]
    for name in CHANNELS:
        found += [(name, "broken", {"side": "low"}), (name, "broken", {"side": "high"}), (name, "stuck", {})]
    found += [("amplifier", kind, {}) for kind in FAULTS["amplifier"]]
    found += [("temperature_1", kind, {}) for kind in FAULTS["temperature"]]
    return found


@dataclass
class Appended:
    """What the acquisition handed over to a recorder, and what the recorder acknowledged."""

    run_id: str
    sequence: list[NDArray[np.int64]] = field(default_factory=list)
    force: list[NDArray[Any]] = field(default_factory=list)
    durable: int = 0


class Watcher:
    """Shows nothing, keeps every line, and injects the fault when its phase is seen."""

    def __init__(self, opened: InProcessStand, phase: str, fault: tuple[str, str, Mapping[str, Any]]) -> None:
        self._opened, self._phase, self._fault = opened, phase, fault
        self.lines: list[str] = []
        self.injected_s: float | None = None

    def inject(self) -> None:
        if self.injected_s is None:
            self.injected_s = self._opened.clock.now_s()
            target, kind, settings = self._fault
            self._opened.device.faults.add(
                ScheduledFault(target, kind, self.injected_s, settings=dict(settings))
            )

    def update(self, progress: CampaignProgress) -> None:
        if progress.phase == _SEEN.get(self._phase):
            self.inject()

    def message(self, text: str) -> None:
        self.lines.append(text)


@dataclass
class Cell:
    """One cell of the matrix: what happened."""

    outcome: CampaignOutcome
    opened: InProcessStand
    lines: list[str]
    injected_s: float | None
    appended: list[Appended]

    def unloaded_after_s(self, of_s: float) -> float:
        """Return how long after a stand time the true force was below 2 kN for good [s]."""
        truth = self.opened.truth.arrays()
        loaded = np.flatnonzero(np.abs(truth["force_kN"]) > 2.0)
        if not len(loaded):
            return 0.0
        at_s = float(truth["sequence"][loaded[-1]] + 1) * self.opened.device.period_s
        return max(0.0, at_s - of_s)


def run_cell(folder: Path, phase: str, fault: tuple[str, str, Mapping[str, Any]]) -> Cell:
    """Run one cell to its end, and 10 s further."""
    folder.mkdir(parents=True, exist_ok=True)
    plan, stand_file = sample_plan(campaign(folder, STEPS[phase]))
    opened = open_in_process(stand_file)
    watcher, appended = Watcher(opened, phase, fault), []
    if phase == "before start":
        watcher.inject()

    class Kept(RunRecorder):
        def __init__(self, directory: Path, run_id: str, metadata: Mapping[str, Any]) -> None:
            super().__init__(directory, run_id, metadata)
            self.kept = Appended(run_id)
            appended.append(self.kept)

        def append(
            self, stream: str, sequence: int, time_us: Any, counts: Mapping[str, Any], lost: int = 0
        ) -> None:
            super().append(stream, sequence, time_us, counts, lost)
            if stream == "controller":
                self.kept.sequence.append(np.arange(sequence, sequence + len(time_us)))
                self.kept.force.append(np.array(counts["force"]))

        def close(self, status: str, reason: str = "") -> Path:
            self.kept.durable = self.durable
            if phase == "recording close":
                watcher.inject()
            return super().close(status, reason)

    outcome = run_campaign(
        plan,
        opened.stand,
        opened.clock,
        folder / "out",
        facts_of(stand_file),
        progress=watcher,
        recorder=Kept,
    )
    opened.clock.sleep(10.0)
    return Cell(outcome, opened, watcher.lines, watcher.injected_s, appended)
