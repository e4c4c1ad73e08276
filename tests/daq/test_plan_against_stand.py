"""The plan against the simulated stand, whose frame gives way as is stated, for uncompensated steps."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.protocols.prediction.machine_stroke import Sine
from tests.clean_stand import stiff_stand
from tests.daq.run_in_process import COARSE, facts_of, sample_plan

SAMPLES = Path(__file__).parents[2] / "sample_runs"
HEAD = f"""
[campaign]
id = "machine"
stand = "{SAMPLES / "stand.toml"}"
specimen = "{SAMPLES / "specimens/category-a-elastomer.toml"}"

[stroke]
compensate = false
"""
# Small loops sink for some cycles before they settle, and absorb more meanwhile: so 80 ± 5 has twenty.
STEPS = {
    "80 ± 15": "prestress_mm = 80.0\namplitude_mm = 15.0\npeak_speed_mm_per_s = 80.0\ncycles = 6",
    "80 ± 5": "prestress_mm = 80.0\namplitude_mm = 5.0\nfrequency_Hz = 1.0\ncycles = 20",
    "50 ± 30": "prestress_mm = 50.0\namplitude_mm = 30.0\npeak_speed_mm_per_s = 80.0\ncycles = 4",
    "40 ± 40": "prestress_mm = 40.0\namplitude_mm = 40.0\nfrequency_Hz = 0.16\ncycles = 3",
}
RIGID_EXCESS = {
    "80 ± 15": (0.09, 0.17),
    "80 ± 5": (0.06, 0.25),
    "50 ± 30": (0.05, 0.05),
    "40 ± 40": (0.05, 0.05),
}
"""By how much at least a plan for a rigid machine exceeds peak force and heat: what the stiffness is for."""


@pytest.mark.dose(2)
@pytest.mark.parametrize("name", STEPS)
def test_force_heat_and_stroke_come_as_planned(tmp_path: Path, name: str) -> None:
    campaign_file = tmp_path / "campaign.toml"
    head = HEAD.replace(str(SAMPLES / "stand.toml"), str(stiff_stand(tmp_path)))
    campaign_file.write_text(f'{head}\n[[step]]\nkind = "harmonic"\n{STEPS[name]}\n', encoding="utf-8")
    plan, stand_file = sample_plan(campaign_file)
    opened = open_in_process(stand_file)
    outcome = run_campaign(
        plan, opened.stand, opened.clock, tmp_path / "out", facts_of(stand_file), settings=COARSE
    )
    assert outcome.status == "complete", outcome.reason
    truth = opened.truth.arrays()
    (step,) = plan.steps
    assert step.expected_peak_force_kN == pytest.approx(truth["force_kN"].max(), rel=0.02)
    assert step.expected_heat_J == pytest.approx(truth["heat_J"][-1], rel=0.05)
    turns = step.turns
    assert turns is not None
    assert turns.upper_mm == pytest.approx(truth["stroke_mm"].max(), abs=0.25)
    asked = Sine(step.prestress_mm or 0.0, step.amplitude_mm or 0.0)
    assert (turns.piston_lower_mm, turns.piston_upper_mm) == pytest.approx(
        (asked.lower_mm, asked.upper_mm), abs=2e-3
    )


@pytest.mark.parametrize("name", STEPS)
def test_a_rigid_plan_would_promise_more_force_and_heat(tmp_path: Path, name: str) -> None:
    def planned(stand: Path) -> tuple[float, float]:
        text = HEAD.replace(str(SAMPLES / "stand.toml"), str(stand))
        limits = (
            "[limits]\nforce_max_kN = 599.9\n"
            if stand.parent == SAMPLES
            else "[limits]\nforce_max_kN = 650.0\n"
        )
        path = tmp_path / "campaign.toml"
        path.write_text(f'{text}{limits}\n[[step]]\nkind = "harmonic"\n{STEPS[name]}\n', encoding="utf-8")
        (step,) = sample_plan(path)[0].steps
        assert step.expected_peak_force_kN is not None
        return step.expected_peak_force_kN, step.expected_heat_J

    rigid = tmp_path / "stand.toml"
    lines = (
        (SAMPLES / "stand.toml").read_text("utf-8").replace("force_max_kN = 600.0", "force_max_kN = 630.0")
    )
    kept = [line for line in lines.splitlines() if not line.startswith("machine_stiffness")]
    rigid.write_text("\n".join(kept), encoding="utf-8")
    (force, heat), (rigid_force, rigid_heat) = planned(SAMPLES / "stand.toml"), planned(rigid)
    assert rigid_force / force - 1.0 > RIGID_EXCESS[name][0]
    assert rigid_heat / heat - 1.0 > RIGID_EXCESS[name][1]
