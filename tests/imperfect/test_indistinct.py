"""Which faults nobody could tell is a narrow class: one change of the circumstances, and it is left."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from . import study, world
from .applied import Applied
from .chain import Scene
from .indistinct import is_indistinct


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Return the first sound static record of three whole strokes."""
    scenes = (world.make(number, "clean") for number in range(200))
    return next(
        s
        for s in scenes
        if s.motion.kind == "static" and len(s.cycles) == 3 and all(c.whole for c in s.cycles)
    )


def _gain(factor: float, at_s: float) -> Applied:
    return Applied("gain-jump", "", channel="force", figures="named", start_s=at_s, plain=True, factor=factor)


def test_a_gain_that_falls_in_the_first_pause_is_taken_for_softening(scene: Scene) -> None:
    one, two, three = scene.cycles
    first_s, second_s = 0.5 * (one.end_s + two.start_s), 0.5 * (two.end_s + three.start_s)
    assert is_indistinct(scene, _gain(0.9, first_s))
    assert not is_indistinct(scene, _gain(0.9, second_s))  # softening dies away
    assert not is_indistinct(scene, _gain(1.1, first_s))  # no spring hardens
    assert not is_indistinct(scene, _gain(0.78, first_s))  # none softens so much
    assert not is_indistinct(scene, _gain(0.9, one.top_s))  # it steps
    assert not is_indistinct(
        scene, replace(_gain(0.9, first_s), name="offset-jump")
    )  # the zero is seen at rest


def test_without_a_load_before_or_after_it_there_is_one_gain(scene: Scene) -> None:
    begins_s, ends_s = scene.cycles[0].start_s - 0.2, scene.cycles[-1].end_s + 0.2
    assert is_indistinct(scene, _gain(1.2, begins_s))
    assert is_indistinct(scene, _gain(1.2, ends_s))


def test_a_held_channel_of_which_each_value_is_kept_once_repeats_none(scene: Scene) -> None:
    fault = Applied("held", "", channel="force", figures="named", plain=True)
    held, kept = copy(scene), copy(scene)
    held.force_read_kN = scene.force_read_kN[np.arange(scene.time_s.size) // 3 * 3]
    kept.force_read_kN = np.where(np.arange(scene.time_s.size) % 4 == 0, held.force_read_kN, np.nan)
    assert not is_indistinct(held, fault)
    assert is_indistinct(kept, fault)


def test_it_is_counted_apart_and_its_false_verdict_stays() -> None:
    judgement = study.one(610040, "gain-jump")  # x 0.894 in the pause after stroke 1
    said = {category for category, _, _ in judgement.findings}
    assert "not distinguishable" in said
    assert "unnamed" not in said
    assert "false fail" in {category for category, _, _ in judgement.falsehoods}
