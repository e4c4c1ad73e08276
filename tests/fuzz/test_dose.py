"""A dose of every target: some inputs always, more in the slow lane, a million with ``--long``."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.catalogue import TARGETS
from tests.fuzz.running import run_in

SLOW, LONG = 15, 1_000_000
"""So many times the dose in the slow lane; so many inputs of all targets together."""


def found(name: str, folder: Path, seed: int, inputs: int) -> list[str]:
    """Return what failed of so many inputs; all of them were given."""
    done, failures = run_in(folder, TARGETS[name], seed, range(inputs))
    assert done == inputs
    return [str(one) for one in failures]


@pytest.mark.parametrize("name", TARGETS)
def test_a_few_inputs_end_well(name: str, tmp_path: Path) -> None:
    assert found(name, tmp_path, 0, TARGETS[name].dose) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_more_inputs_end_well(name: str, tmp_path: Path) -> None:
    assert found(name, tmp_path, 1, SLOW * TARGETS[name].dose) == []


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_a_million_inputs_end_well(name: str, tmp_path: Path) -> None:
    share = LONG * TARGETS[name].dose // sum(one.dose for one in TARGETS.values()) + 1
    assert found(name, tmp_path, 2, share) == []
