"""A seed is one world, every world can be planned, and every trouble has its say."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from bufferstand.drivers.simulated.faults.schedule import FAULTS as INJECTED
from tests.daq.fault_matrix import every_fault
from tests.worlds.causes import OTHERS, allowed, explains
from tests.worlds.death import STEPS
from tests.worlds.laws import LAWS
from tests.worlds.life import plan_world
from tests.worlds.troubles import PHASES, SHARES, WHATS, Trouble
from tests.worlds.world import AMPLIFIERS, MOST_TROUBLES, SPECIMENS, THERMOMETERS, draw

MANY = 400


def test_a_seed_is_one_world() -> None:
    for seed in range(20):
        assert draw(seed) == draw(seed)
        assert draw(seed).words() == draw(seed).words()
    assert len({draw(seed).words().partition(":")[2] for seed in range(MANY)}) == MANY


def test_worlds_have_everything_that_can_be_drawn() -> None:
    worlds = [draw(seed) for seed in range(MANY)]
    troubles = [trouble for world in worlds for trouble in world.troubles]
    assert {len(world.troubles) for world in worlds} == set(range(MOST_TROUBLES + 1))
    assert {world.amplifier for world in worlds} == set(AMPLIFIERS)
    assert {world.thermometer for world in worlds} == set(THERMOMETERS)
    assert {world.specimen for world in worlds} == set(SPECIMENS)
    assert {trouble.kind for trouble in troubles} == set(SHARES)
    assert {one.what for one in troubles if one.kind == "kill"} == {"anywhere", *STEPS}
    assert {one.phase for one in troubles} <= {"", *PHASES}
    for kind, whats in WHATS.items():
        assert {one.what for one in troubles if one.kind == kind} == set(whats)
    struck = Counter(one.what.partition("=")[0] for one in troubles if one.kind == "device")
    assert set(struck) == {target for target, _, _ in every_fault()}


def test_starts_with_troubles_come_before_the_one_without() -> None:
    for seed in range(MANY):
        world = draw(seed)
        starts = {one.start for one in world.troubles}
        assert starts == set(range(len(starts)))
        assert world.starts == len(starts) + 1


@pytest.mark.parametrize("seed", range(6))
def test_a_world_can_be_planned(tmp_path: Path, seed: int) -> None:
    plan, stand_file, _ = plan_world(draw(seed), tmp_path)
    assert len(plan.steps) == len(draw(seed).steps)
    assert len(stand_file.instruments) == 1


def test_every_fault_of_the_injector_says_what_it_may_lead_to() -> None:
    assert INJECTED
    for target, kind, settings in every_fault():
        allowed(Trouble("device", f"{target}={kind}", 0, "", 0.0, settings=settings))
    known = {f"{kind}: {what}" for kind, whats in WHATS.items() for what in whats}
    assert set(OTHERS) <= known


def test_a_stop_is_explained_by_what_struck_and_by_nothing_else() -> None:
    full = Trouble("disk", "full", 0, "", 0.0)
    note = Trouble("operator", "note", 0, "", 0.0)
    said = "the disk is nearly full: no 4 MiB could be reserved"
    assert explains([note, full], 4, said, unsafe=False, tight=False)
    assert not explains([full], 3, said, unsafe=False, tight=False)
    assert not explains([note], 4, said, unsafe=False, tight=False)
    assert not explains([full], 4, "tilt 6.0 mm is above 5 mm", unsafe=False, tight=False)
    assert not explains([], 4, said, unsafe=True, tight=True)


def test_the_page_has_every_law_and_no_other() -> None:
    page = (Path(__file__).parents[2] / "docs" / "worlds.md").read_text(encoding="utf-8")
    laws = page.partition("## Laws")[2]
    assert re.findall(r"^\| `(\w+)` \|", laws, re.MULTILINE) == [law.__name__ for law in LAWS]
    assert f"one of {len(STEPS)} steps" in page
