"""A dose of seeded worlds: some few always, two hundred with ``--long``, more by the command."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.worlds.apart import live
from tests.worlds.table import line, table
from tests.worlds.world import draw

ALWAYS = (5, 25, 97, 99, 100, 170)
"""Short ones: no trouble, a wire and memory that fail, a full disk, a transducer that stands still, an
actuator that gives up; stops and resumes."""
LONG = 200


def seeds() -> list[object]:
    return [pytest.param(seed, marks=() if seed in ALWAYS else pytest.mark.long) for seed in range(LONG)]


@pytest.mark.parametrize("seed", seeds())
def test_a_world_keeps_every_law(seed: int) -> None:
    result = live(draw(seed))
    assert not result.broken, line(result)


def test_a_seed_is_lived_alike_every_time() -> None:
    first, again = (live(draw(97)) for _ in range(2))
    assert first.digest == again.digest
    assert first.starts == again.starts
    assert "| seeds | 2 (97 to 97) |" in table([first, again])


def test_the_command_says_what_a_world_is_without_living_it() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "tests.worlds", "--words", "--first", "8", "--seeds", "1"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    assert said.stdout.strip() == draw(8).words()


def test_the_command_refuses_what_is_no_number_of_worlds() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "tests.worlds", "--seeds", "0"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 2
    assert "--seeds and --jobs are 1 or more" in said.stderr
