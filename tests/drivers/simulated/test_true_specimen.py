"""The specimen in the simulated stand, where it is not as its model says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.build import make_device
from bufferstand.foundation.errors import BadInput
from tests.drivers.simulated.standing import STAND, stand_file

MODEL = Path(__file__).parents[3] / "sample_runs/models/category-a-elastomer.toml"
PATH_MM = np.concatenate([np.arange(1.0, 81.0), np.arange(79.0, 29.0, -1.0), np.arange(31.0, 101.0)])
"""Up, into the loop, up again and beyond: loading, unloading and the transition between them."""


def walk(folder: Path, factor: float | None) -> tuple[list[float], float]:
    """Return the forces [kN] along a path of strokes, and the heat set free on it [J]."""
    key = "" if factor is None else f"specimen_force_factor = {factor}\n"
    text = STAND.replace("[simulation]\n", f"[simulation]\n{key}")
    # The one that the campaign's specimen names: run --simulate gives it, and the factor counts all the same.
    spring = make_device(stand_file(folder, text), lambda: 0.0, model=MODEL).spring
    return [spring.step(float(stroke_mm), 0.02) for stroke_mm in PATH_MM], spring.heat_J


@pytest.mark.parametrize("factor", [0.9, 1.12])
def test_force_and_heat_are_multiples_of_the_models(tmp_path: Path, factor: float) -> None:
    stated, stated_J = walk(tmp_path, None)
    true, true_J = walk(tmp_path, factor)
    # It warms by some 0.3 K of 1 % a kelvin, and by a tenth of that more or less with the factor.
    np.testing.assert_allclose(true, factor * np.array(stated), rtol=1e-3)
    assert true_J == pytest.approx(factor * stated_J, rel=1e-3)


def test_a_factor_that_no_spring_has_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"write a number from 0\.3 to 3\.0"):
        walk(tmp_path, 0.0)
