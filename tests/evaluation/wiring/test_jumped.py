"""A force that jumps in a record is named: the one that breaks while stroke and the other one do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.plausibility.signal_comparison.force_changes import jumped
from tests.evaluation.wiring.bench import SINE, SLOW, Recorded, evaluated, recorded

STEPS = {"slow": SLOW, "sine": SINE}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recorded]:
    """One right record of each kind of motion."""
    return {name: recorded(tmp_path_factory.mktemp(name), step) for name, step in STEPS.items()}


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("motion", "name", "by_kN", "at_s"),
    [
        ("slow", "force", 5.0, 3.0),
        ("sine", "force_2", -5.0, 6.0),
        ("sine", "force", -5.0, 6.5),
        *(
            pytest.param(motion, name, by_kN, at_s, marks=LONG)
            for motion in STEPS
            for name in ("force", "force_2")
            for by_kN in (4.0, -12.0)
            for at_s in (2.5, 3.5, 5.0, 6.0, 7.0)
        ),
    ],
)
def test_the_force_that_jumped_is_named_with_size_and_time(
    runs: dict[str, Recorded], tmp_path: Path, motion: str, name: str, by_kN: float, at_s: float
) -> None:
    run = evaluated(runs[motion].with_jump(name, by_kN, at_s).written(tmp_path))
    (finding,) = [one for one in run.findings if one.kind == "zero"]
    assert (finding.channel, finding.effect) == (name, "spoils" if name == "force" else "noted")
    assert finding.size == pytest.approx(by_kN, abs=1.5)
    assert f"{name} jumped by" in finding.text
    assert [one.channel for one in run.findings if one.channel not in (name, "stroke")] == []


# --- parts -------------------------------------------------------------------------------------------

TIME = np.arange(0.0, 8.0, 0.002)
STROKE = 30.0 - 30.0 * np.cos(2.0 * np.pi * 0.5 * TIME)
RIGHT = 20.0 + 5.0 * STROKE
OWN_S = np.arange(0.0, 8.1, 0.02)


def noise(seed: int, count: int = TIME.size) -> np.ndarray:
    return 0.15 * np.random.default_rng(seed).standard_normal(count)


def second(jumps_kN: float = 0.0, late_s: float = 0.0) -> np.ndarray:
    """Return a second force of 50 Hz that jumps at 3.3 s, at the instants of the first."""
    own = np.interp(OWN_S - late_s, TIME, RIGHT) + noise(2, OWN_S.size) + jumps_kN * (OWN_S >= 3.3)
    return np.asarray(np.interp(TIME, OWN_S, own))


def test_a_jump_of_either_force_is_told_apart_from_one_of_the_other() -> None:
    step = 4.0 * (TIME >= 3.3)
    for one, two, name in (
        (RIGHT + noise(1) + step, second(), "force"),
        (RIGHT + noise(1), second(4.0), "force_2"),
    ):
        found = jumped(TIME, one, two, STROKE)
        assert found is not None
        assert found.name == name
        assert found.size_kN == pytest.approx(4.0, abs=0.5)
        assert found.at_s == pytest.approx(3.3, abs=0.05)


def test_which_of_both_jumped_is_left_open_where_the_specimen_moved_too() -> None:
    found = jumped(TIME, RIGHT + noise(1), second(4.0), STROKE + 3.0 * (TIME >= 3.3))
    assert found is not None
    assert found.name == ""


@pytest.mark.parametrize("late_s", [0.0, 0.008, 0.02])
def test_a_force_that_both_show_or_one_shows_later_has_no_jump(late_s: float) -> None:
    triangle = np.abs((TIME * 100.0) % 120.0 - 60.0)
    hysteresis = np.where(np.gradient(triangle) > 0.0, 1.0, 0.8)
    sharp = 20.0 + 5.0 * triangle * hysteresis
    for right in (RIGHT, sharp):
        two = np.interp(TIME, OWN_S, np.interp(OWN_S - late_s, TIME, right) + noise(2, OWN_S.size))
        assert jumped(TIME, right + noise(1), two, STROKE) is None
