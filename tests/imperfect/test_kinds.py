"""Every kind of imperfection does to a record what it says, and nothing to the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from . import world
from .chain import Scene
from .imperfections import KINDS
from .kinds import rows


def _made(name: str) -> Scene:
    for number in range(60):
        scene = world.make(number, name)
        if scene.applied:
            return scene
    raise AssertionError(f"no record takes {name}")


@pytest.mark.dose(10)
@pytest.mark.parametrize("name", [kind.name for kind in KINDS])
def test_a_kind_changes_the_record_and_not_the_truth(name: str) -> None:
    scene = _made(name)
    clean = world.make(scene.number, "clean")
    assert [a.name for a in scene.applied] == [name]
    assert [c.figures for c in scene.cycles] == [c.figures for c in clean.cycles]
    same = (
        np.array_equal(scene.time_s, clean.time_s)
        and np.array_equal(scene.force_read_kN, clean.force_read_kN, equal_nan=True)
        and all(map(np.array_equal, scene.strokes_mm, clean.strokes_mm))
        and len(scene.temperatures_C) == len(clean.temperatures_C)
        and all(
            np.array_equal(a, b, equal_nan=True)
            for a, b in zip(scene.temperatures_C, clean.temperatures_C, strict=True)
        )
        and not scene.factor
    )
    assert not same
    assert all(
        len(x) == len(scene.time_s) for x in (*scene.strokes_mm, *scene.temperatures_C, *scene.faulty_C)
    )


@pytest.mark.parametrize("name", ["clipped-force", "frozen", "offset-jump", "spikes", "lost-turn"])
def test_a_fault_acts_when_it_says(name: str) -> None:
    scene = _made(name)
    clean = world.make(scene.number, "clean")
    if name == "lost-turn":
        touched = np.setdiff1d(clean.true_time_s, scene.true_time_s)
    else:
        differs = scene.force_read_kN != clean.force_read_kN
        for x, y in zip(scene.strokes_mm, clean.strokes_mm, strict=True):
            differs = differs | (x != y)
        touched = scene.true_time_s[differs]
    fault = scene.applied[0]
    assert fault.start_s - 1e-9 <= touched.min()
    assert touched.max() <= fault.end_s + 1e-9


def test_rows_that_are_lost_at_the_end_leave_no_gap_to_be_named() -> None:
    scene = world.make(1, "clean")
    keep = np.ones(len(scene.time_s), dtype=bool)
    keep[-40:] = False
    assert rows._lost(scene, "lost-turn", "40 rows", keep).words is None
    keep = np.ones(len(scene.time_s), dtype=bool)
    keep[40:80] = False
    assert rows._lost(scene, "lost-burst", "40 rows", keep).words == rows.GAP


def test_what_a_channel_does_not_go_into_is_not_falsified() -> None:
    clipped = _made("clipped-force").applied[0]
    assert clipped.touches("force_max_kN")
    assert clipped.touches("stored-energy")
    assert not clipped.touches("stroke_max_mm")
    assert not clipped.touches("full-release")
    late = _made("force-late-beyond").applied[0]
    assert late.touches("damping")
    assert not late.touches("force_max_kN")


def test_a_code_is_written_as_a_logger_writes_it(tmp_path: Path) -> None:
    scene = _made("sentinel")
    scene.force_read_kN = scene.force_read_kN.copy()
    scene.force_read_kN[5] = 9.91e37
    text = world.write(scene, tmp_path).record.read_text()
    assert "9.91E+37" in text.replace(",", ".")
    assert max(map(len, text.splitlines())) < 200


def test_a_late_force_has_noise_of_its_own_before_its_first_reading() -> None:
    scenes = (world.make(number, "force-late-beyond") for number in range(60))
    late = next(s for s in scenes if s.applied and not s.applied[0].size.startswith("-"))
    rows = late.time_s < late.time_s[0] + 1e-3 * float(late.applied[0].size.split()[0])
    assert np.count_nonzero(rows) > 2
    assert np.unique(late.force_read_kN[rows]).size == np.count_nonzero(rows)
