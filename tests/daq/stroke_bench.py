"""A campaign on a stand whose machine, actuator and spring are not what its files say, and its truth."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from bufferstand.daq.acquisition.pace import LoopPace
from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.drivers.register_maps.profile import SHIPPED
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.model.stepper import SpringStepper
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.recording.runfile.file import open_run
from tests.daq.cases import SAMPLES, Lines
from tests.daq.run_in_process import facts_of

MODEL = SAMPLES / "models" / "category-a-elastomer.toml"
STATED_KN_PER_MM, TRUE_KN_PER_MM = 150.0, 105.0
"""The frame is 30 % softer than the stand file states."""


class SoftSpring:
    """The spring of the model with its forces by a factor: one that has softened."""

    def __init__(self, spring: SpringStepper, factor: float) -> None:
        self._spring, self._factor = spring, factor

    @property
    def force_kN(self) -> float:  # noqa: N802
        return self._factor * self._spring.force_kN

    @property
    def temperature_C(self) -> float:  # noqa: N802
        return self._spring.temperature_C

    @property
    def sensor_temperature_C(self) -> float:  # noqa: N802
        return self._spring.sensor_temperature_C

    @property
    def heat_J(self) -> float:  # noqa: N802
        return self._spring.heat_J

    def step(self, stroke_mm: float, dt_s: float) -> float:
        return self._factor * self._spring.step(stroke_mm, dt_s)

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802
        return self._factor * self._spring.tangent_kN_per_mm(loading)


@dataclass(frozen=True)
class Case:
    """What is not as the files say."""

    true_kN_per_mm: float = TRUE_KN_PER_MM
    stated_kN_per_mm: float | None = STATED_KN_PER_MM
    bandwidth_Hz: float = 8.0
    softening: float = 0.9
    edition: int = 3
    reversal_s: float = 0.01
    simulation: tuple[tuple[str, float], ...] = ()
    """More keys of ``[simulation]``."""
    more: str = ""
    tick_s: float = 0.05
    """From pass to pass of the loop: five times a campaign's, for a third of the processor time."""


@dataclass(frozen=True)
class Reached:
    """Of one step, by the stand's own truth: mean and amplitude of each full cycle [mm], shape (n,)."""

    mean_mm: np.ndarray
    amplitude_mm: np.ndarray
    peak_force_kN: float
    peak_stroke_mm: float


def with_key(text: str, key: str, value: object) -> str:
    """Return a stand file with the first of its keys of a name changed; without it for None."""
    line = "" if value is None else f"{key} = {value}"
    changed, count = re.subn(rf"^{key} = .*$", line, text, count=1, flags=re.MULTILINE)
    assert count == 1, key
    return changed


def campaign(folder: Path, steps: str, case: Case) -> Path:
    """Write a campaign for the stand of a case."""
    folder.mkdir(parents=True, exist_ok=True)
    stand = (SAMPLES / "stand.toml").read_text(encoding="utf-8")
    stand = with_key(stand, "machine_stiffness_kN_per_mm", case.stated_kN_per_mm)
    for key, value in {
        "model": f'"{MODEL}"',
        "frame_stiffness_kN_per_mm": case.true_kN_per_mm,
        "actuator_bandwidth_Hz": case.bandwidth_Hz,
        "reversal_s": case.reversal_s,
        **dict(case.simulation),
    }.items():
        stand = with_key(stand, key, value)
    if case.edition == 2:
        ring = (SHIPPED / "ring.toml").read_text(encoding="utf-8")
        for old, new in {"expect = 3\naccept = [2]": "expect = 2", "adjust_from = 3\n": ""}.items():
            assert old in ring
            ring = ring.replace(old, new)
        (folder / "ring-2.toml").write_text(ring, encoding="utf-8")
        stand = with_key(stand, "profile", '"ring-2.toml"')
    (folder / "stand.toml").write_text(stand, encoding="utf-8")
    specimen = SAMPLES / "specimens" / "category-a-elastomer.toml"
    path = folder / "campaign.toml"
    head = f'[campaign]\nid = "test"\nstand = "stand.toml"\nspecimen = "{specimen}"\n{case.more}'
    path.write_text(head + steps, encoding="utf-8")
    return path


def planned(folder: Path, steps: str, case: Case) -> tuple[Plan, StandFile]:
    """Plan a campaign for the stand of a case."""
    file = load_campaign(campaign(folder, steps, case))
    stand_file = load_stand(file.stand_path)
    specimen = load_specimen(file.specimen_path).specimen
    limits = StandLimits(**stand_file.limits.model_dump())
    return make_plan(file, limits, ModelPredictor(load_model(MODEL)), specimen), stand_file


def run(
    folder: Path, steps: str, case: Case | None = None
) -> tuple[CampaignOutcome, InProcessStand, Lines, Plan]:
    """Run a campaign on the stand of a case, in virtual time."""
    case = case or Case()
    plan, stand_file = planned(folder, steps, case)
    model = load_model(MODEL)
    spring = SoftSpring(SpringStepper(model, 21.0, 21.0), case.softening)
    opened = open_in_process(stand_file, spring=spring)
    shown = Lines()
    outcome = run_campaign(
        plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file),
        progress=shown, predictor=ModelPredictor(model),
        settings=RunSettings(pace=LoopPace(tick_s=case.tick_s)),
    )  # fmt: skip
    opened.stand.close()
    return outcome, opened, shown, plan


def reached(opened: InProcessStand, outcome: CampaignOutcome) -> list[Reached]:
    """Return what each harmonic run's full cycles did, by the stand's own truth, not by its sensors."""
    truth = opened.truth.arrays()
    found = []
    for path in outcome.runs:
        record = open_run(path)
        time_us = record.stream_of("stroke_1").time
        inside = (truth["time_us"] >= time_us[0]) & (truth["time_us"] <= time_us[-1])
        stroke, force = truth["stroke_mm"][inside], truth["force_kN"][inside]
        step = record.step
        amplitude_mm, period = step["amplitude_mm"], 1000.0 / step["frequency_Hz"]
        tops, _ = find_peaks(stroke, prominence=0.6 * amplitude_mm, distance=0.6 * period)
        assert len(tops) == step["cycles"] + 2, "one of the cycle in, one of the cycle out"
        highs = stroke[tops[1:-1]]
        lows = np.array([stroke[at:after].min() for at, after in pairwise(tops[1:])])
        found.append(
            Reached(0.5 * (highs + lows), 0.5 * (highs - lows), float(force.max()), float(stroke.max()))
        )
    return found
