"""Right stands with specimens up to 40 % softer or stiffer than their models: nothing is said of them."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.evaluation.wiring.bench import a_step, evaluated, recorded

ALWAYS, STUDY = 2, 200


@pytest.mark.parametrize(
    "seed",
    [*range(ALWAYS), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(ALWAYS, STUDY))],
)
def test_no_doubt_about_a_right_stand(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    made = recorded(
        tmp_path,
        a_step(draw),
        specimen_force_factor=(0.6, 1.4)[seed] if seed < 2 else draw.uniform(0.6, 1.4),
        frame_stiffness_kN_per_mm=draw.uniform(100.0, 250.0),
        initial_C=draw.uniform(10.0, 35.0),
        seed=seed,
    )
    run = evaluated(made.written(tmp_path))
    assert [one.text for one in run.findings] == []
    assert run.cycles
