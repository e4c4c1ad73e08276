"""The sample stand is imperfect, and its books are right all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.settings import SimulationSettings, simulation_settings
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.errors import BadInput
from tests.clean_stand import IMPERFECTIONS, SAMPLE_STAND, clean_stand_text
from tests.drivers.simulated.standing import STAND, FrictionSpring, device, stand_file

IMPERFECT = {
    key: value
    for key, value in simulation_settings(load_stand(SAMPLE_STAND)).model_dump().items()
    if key in IMPERFECTIONS
}
DOCS = Path(__file__).parents[3] / "docs" / "simulated-stand.md"


def test_the_sample_stand_has_every_imperfection_and_the_clean_one_none(tmp_path: Path) -> None:
    clean = simulation_settings(stand_file(tmp_path, clean_stand_text())).model_dump()
    for key in IMPERFECTIONS:
        default = SimulationSettings.model_fields[key].default
        assert IMPERFECT[key] != default, key
        assert clean[key] == default, key
        assert f"`{key}`" in DOCS.read_text(encoding="utf-8"), key


def sine(stand: SimulatedDevice, amplitude_mm: float = 10.0, frequency_Hz: float = 2.0) -> None:
    """Go to 30 mm and move harmonically for five cycles."""
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=30.0, speed_mm_per_s=100.0))
    stand.controller.execute(1)
    while stand.controller.done_sequence != 1:
        stand.advance(100)
    stand.controller.arm(
        Command(
            2,
            CommandCode.HARMONIC,
            mean_mm=30.0,
            amplitude_mm=amplitude_mm,
            frequency_Hz=frequency_Hz,
            cycles=3,
        )
    )
    stand.controller.execute(2)
    while stand.controller.done_sequence != 2:
        stand.advance(100)


def test_the_ledger_of_work_is_the_area_under_the_true_curve(tmp_path: Path) -> None:
    stand = device(tmp_path, FrictionSpring(), **IMPERFECT)
    sine(stand)
    truth = stand.truth.arrays()  # type: ignore[union-attr]
    force, stroke = truth["force_kN"], truth["stroke_mm"]
    area_J = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke))))
    np.testing.assert_allclose(truth["work_J"], area_J, rtol=0.0, atol=1e-6)
    assert truth["work_J"].max() > 100.0


def test_the_truth_knows_the_piston_and_none_of_the_transducers_errors(tmp_path: Path) -> None:
    stand = device(tmp_path, FrictionSpring(), **IMPERFECT)
    sine(stand)
    truth = stand.truth.arrays()  # type: ignore[union-attr]
    frame = stand.settings.frame_stiffness_kN_per_mm
    loaded = truth["stroke_mm"] > 1.0
    series = truth["position_mm"] - IMPERFECT["gap_mm"] - truth["force_kN"] / frame
    assert np.abs(series - truth["stroke_mm"])[loaded].max() < 0.04  # one Newton step a sample
    moving = np.abs(np.diff(truth["command_mm"])) > 0.02
    behind = np.abs(truth["command_mm"] - truth["position_mm"])[1:][moving]
    assert behind.max() > 0.5
    rest = slice(0, 10)
    assert not truth["stroke_mm"][rest].any()
    assert not truth["force_kN"][rest].any()


def test_slices_of_any_length_give_the_same(tmp_path: Path) -> None:
    whole, pieces = (device(tmp_path, FrictionSpring(), **IMPERFECT) for _ in range(2))
    for stand in (whole, pieces):
        stand.controller.control(0x000F)
        stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=50.0))
        stand.controller.execute(1)
    whole.advance(700)
    for count in (1, 99, 250, 3, 347):
        pieces.advance(count)
    for name, column in whole.ring.window(0, 700)[1].items():
        np.testing.assert_array_equal(column, pieces.ring.window(0, 700)[1][name])


def test_the_zero_of_the_force_begins_where_it_is_said_and_drifts(tmp_path: Path) -> None:
    stand = device(tmp_path, force_zero_kN=0.4, force_drift_kN_per_h=7.2, force_noise_kN=0.0)
    stand.advance(60_000)
    force = next(c for c in stand_file(tmp_path).controller.channel if c.name == "force")
    read_kN = force.calibration.apply(stand.ring.window(0, 60_000)[1]["force"])
    assert read_kN[0] == pytest.approx(0.4, abs=1e-3)
    assert read_kN[-1] == pytest.approx(0.4 + 7.2 / 60.0, abs=1e-3)


def test_a_curve_that_is_none_is_refused(tmp_path: Path) -> None:
    text = STAND + "\nforce_speed = [[0.0, 100.0], [50.0, 200.0]]\n"
    with pytest.raises(BadInput, match="no more speed at more force"):
        simulation_settings(stand_file(tmp_path, text))
