"""The shipped campaigns: they plan on the shipped model, and the plan agrees with a full simulation."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bufferstand.foundation.motions import Harmonic, StaticCycles
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.model.simulation import simulate
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.protocols.prediction.sine_start import peak_force
from bufferstand.protocols.steps.planned import PlannedStep

SAMPLES = Path(__file__).parents[2] / "sample_runs"
CAMPAIGNS = ("demo.toml", "paper.toml", "fig9.toml", "en15551.toml")


def plan_of(name: str) -> Plan:
    campaign = load_campaign(SAMPLES / name)
    specimen = load_specimen(campaign.specimen_path).specimen
    assert specimen.model is not None
    model = load_model(campaign.specimen_path.parent / specimen.model)
    stand = tomllib.loads(campaign.stand_path.read_text("utf-8"))["limits"]
    return make_plan(campaign, StandLimits(**stand), ModelPredictor(model), specimen)


@pytest.fixture(scope="module")
def demo() -> Plan:
    return plan_of("demo.toml")


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CAMPAIGNS, pytest.param("paper-full.toml", marks=pytest.mark.long)])
def test_shipped_campaigns_keep_every_limit(name: str) -> None:
    made = plan_of(name)
    for step in made.steps:
        assert step.duration_s >= 0.0
        if step.expected_peak_force_kN is not None:
            assert 0.0 < step.expected_peak_force_kN <= 600.0 * (1 + 1e-6)
        if step.frequency_Hz is not None and step.prestress_mm is not None and step.amplitude_mm is not None:
            assert step.frequency_Hz <= 2.55
            assert step.prestress_mm >= step.amplitude_mm
            assert step.prestress_mm + step.amplitude_mm <= 105.0


@pytest.mark.parametrize("path", sorted((SAMPLES / "specimens").glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_specimens_name_a_model_that_loads(path: Path) -> None:
    specimen = load_specimen(path).specimen
    assert specimen.model is not None
    model = load_model(path.parent / specimen.model)
    assert specimen.max_stroke_mm is not None
    assert model.curves.end_mm >= 0.9 * specimen.max_stroke_mm
    assert specimen.assembled is not None


def test_the_demo_is_the_papers_campaign_in_eight_minutes(demo: Plan) -> None:
    assert 7 * 60 < demo.expected_duration_s < 9.5 * 60
    first, *between, last = demo.steps
    assert (first.kind, first.cycles, first.start_temperature_C) == ("static", 3, 21.0)
    assert first.end_temperature_C < 25.0  # EN 15551 wants 15 to 25 °C throughout
    assert [bool(step.stops) for step in between] == [False] * len(between)
    assert (last.prestress_mm, last.amplitude_mm, last.peak_speed_mm_per_s) == (78.0, 15.0, 80.0)
    assert last.stops
    assert 10 < last.stops[0].cycles_done < 200
    frequencies = [round(step.frequency_Hz, 2) for step in between if step.frequency_Hz is not None]
    assert frequencies == [0.08, 0.32, 0.64, 1.27, 0.42, 0.85, 1.27, 2.55, 0.04, 0.16, 0.32]


def test_the_static_test_keeps_the_conditions_of_the_standard() -> None:
    step = plan_of("en15551.toml").steps[-1]
    motion = step.motions[0]
    assert isinstance(motion, StaticCycles)
    assert motion.cycles == 3
    assert motion.speed_mm_per_s <= 50.0
    assert motion.pause_s <= 600.0
    assert 15.0 <= step.start_temperature_C < step.max_temperature_C <= 25.0


def stroke_history(
    step: PlannedStep, rate_Hz: float = 400.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return time and required stroke of a step's motions, written down independently of the planner."""
    times, strokes, now_s, at_mm = [np.zeros(1)], [np.zeros(1)], 0.0, 0.0
    for motion, estimate in zip(step.motions, step.estimates, strict=True):
        if estimate.duration_s == 0.0:
            continue
        u = np.linspace(0.0, estimate.duration_s, max(2, round(estimate.duration_s * rate_Hz)))[1:]
        if isinstance(motion, Harmonic):
            phase = u * motion.frequency_Hz
            fade = np.minimum(1.0, np.minimum(phase, motion.cycles + 2 - phase))
            stroke = motion.mean_mm + motion.amplitude_mm * fade * np.sin(2.0 * np.pi * phase)
        elif isinstance(motion, StaticCycles):
            cycle_s = (estimate.duration_s - (motion.cycles - 1) * motion.pause_s) / motion.cycles
            within = np.mod(u, cycle_s + motion.pause_s)
            assert estimate.turns is not None
            per_s = 2.0 * estimate.turns.upper_mm / cycle_s  # the piston, whose speed it is, goes further
            stroke = np.maximum(0.0, np.minimum(within, cycle_s - within)) * per_s
        else:
            stroke = at_mm + (motion.end_mm(at_mm) - at_mm) * u / estimate.duration_s
        times.append(now_s + u)
        strokes.append(stroke)
        now_s, at_mm = now_s + estimate.duration_s, motion.end_mm(at_mm)
    return np.concatenate(times), np.concatenate(strokes)


def test_the_plan_agrees_with_a_full_simulation(demo: Plan) -> None:
    """Heat within 3 %, temperature within 0.1 K, force never above the expected and within 3 % of it."""
    assert demo.specimen.model is not None
    model = load_model(demo.campaign.specimen_path.parent / demo.specimen.model)
    for step in demo.steps:
        time_s, stroke_mm = stroke_history(step)
        found = simulate(model, time_s, stroke_mm, temperature_C=step.start_temperature_C, ambient_C=21.0)
        assert step.expected_peak_force_kN is not None
        share = found.force_kN.max() / step.expected_peak_force_kN
        assert 0.97 < share < 1.003, step.name
        if step.stops:
            hot = int(np.argmax(found.sensor_temperature_C >= 40.0))
            assert time_s[hot] == pytest.approx(step.stops[0].at_s, abs=1.5)
            assert found.heat_J[hot] == pytest.approx(step.expected_heat_J, rel=0.03)
            assert found.temperature_C[hot] == pytest.approx(step.end_temperature_C, abs=0.1)
        else:
            assert found.heat_J[-1] == pytest.approx(step.expected_heat_J, rel=0.03), step.name
            assert found.temperature_C[-1] == pytest.approx(step.end_temperature_C, abs=0.1), step.name
            assert found.sensor_temperature_C[-1] == pytest.approx(step.sensor_end_temperature_C, abs=0.6)


@pytest.mark.parametrize(
    ("prestress_mm", "amplitude_mm"), [(94.0, 1.0), (90.0, 2.0), (60.0, 2.0), (80.0, 5.0)]
)
def test_the_first_loading_counts_for_the_peak_force(
    demo: Plan, prestress_mm: float, amplitude_mm: float
) -> None:
    """At small amplitudes the settled loop lies far below the branch on which the ramp arrives."""
    assert demo.specimen.model is not None
    model = load_model(demo.campaign.specimen_path.parent / demo.specimen.model)
    rise = np.linspace(0.0, prestress_mm, 2000)
    phase = np.linspace(0.0, 6.0, 6000)[1:]
    sine = amplitude_mm * np.minimum(1.0, phase) * np.sin(2.0 * np.pi * phase)
    time_s = np.concatenate([rise / 20.0, prestress_mm / 20.0 + phase / 2.5])
    found = simulate(model, time_s, np.concatenate([rise, prestress_mm + sine]), temperature_C=21.0)
    settled = ModelPredictor(model).harmonic(prestress_mm, amplitude_mm, 2.5, 21.0).peak_force_kN
    bound = peak_force(ModelPredictor(model), prestress_mm, amplitude_mm, 2.5, 20.0, 21.0)
    assert settled < found.force_kN.max() <= bound < 1.06 * found.force_kN.max()
