"""The stand as a whole: samples, clock, slices, thermometers, truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.machine.truth import COLUMNS, read_truth
from bufferstand.drivers.simulated.settings import simulation_settings
from bufferstand.foundation.errors import BadInput
from tests.drivers.simulated.standing import STAND, FrictionSpring, LinearSpring, device, stand_file


def move(stand: SimulatedDevice) -> None:
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=50.0))
    stand.controller.execute(1)


def test_samples_follow_device_time_and_nothing_is_dropped(tmp_path: Path) -> None:
    stand = device(tmp_path, clock_drift_ppm=1000.0)
    for time_s in (0.1, 0.1004, 0.5, 3.0):
        stand.advance_to(time_s)
    assert stand.ring.total == 3003
    assert stand.tick_us(3.0) == 3_003_000
    first, columns = stand.ring.window(0, 5000)
    assert first == 0
    assert set(np.diff(columns["tick"].astype(np.int64))) == {1000}


def test_a_starved_stand_catches_up_in_steps(tmp_path: Path) -> None:
    stand = device(tmp_path)
    left = [stand.advance_to(2.0, 400)]
    while left[-1]:
        left.append(stand.advance_to(2.0, 400))
    assert left == [1600, 1200, 800, 400, 0]
    assert stand.ring.total == 2000


def test_ticks_wrap_at_32_bits_and_the_truth_does_not(tmp_path: Path) -> None:
    stand = device(tmp_path, tick_start_us=2**32 - 500_000)
    stand.advance(1000)
    _, columns = stand.ring.window(0, 1000)
    ticks = columns["tick"]
    assert ticks[0] == 2**32 - 499_000
    assert ticks[-1] == 500_000
    assert set(np.diff(ticks)) == {1000}  # modulo 2**32
    assert np.all(np.diff(stand.truth.arrays()["time_us"]) == 1000)  # type: ignore[union-attr]


def test_slices_of_any_length_give_the_same_motion_and_noise(tmp_path: Path) -> None:
    whole, pieces = device(tmp_path, FrictionSpring()), device(tmp_path, FrictionSpring())
    move(whole)
    move(pieces)
    whole.advance(700)
    for count in (1, 99, 250, 3, 347):
        pieces.advance(count)
    _, one = whole.ring.window(0, 700)
    _, other = pieces.ring.window(0, 700)
    for name, column in one.items():
        assert np.array_equal(column, other[name]), name


def test_while_nothing_moves_few_steps_are_made_and_the_samples_are_whole(tmp_path: Path) -> None:
    spring = LinearSpring()
    stand = device(tmp_path, spring)
    move(stand)
    stand.advance(2000)
    before = spring.steps
    stand.advance(10_000)
    assert spring.steps - before < 300
    assert stand.ring.total == 12_000
    log = stand.truth.arrays()  # type: ignore[union-attr]
    assert np.ptp(log["stroke_mm"][-9000:]) < 1e-5


def test_channels_measure_the_truth_within_their_errors(tmp_path: Path) -> None:
    file = stand_file(tmp_path)
    stand = device(tmp_path, FrictionSpring())
    move(stand)
    stand.advance(3000)
    _, counts = stand.ring.window(0, 3000)
    log = stand.truth.arrays()  # type: ignore[union-attr]
    values = {c.name: c.calibration.apply(counts[c.name]) for c in file.controller.channel}
    # force: 0.8 ms late, 0.15 kN of noise
    late = np.interp(log["time_us"] - 800.0, log["time_us"], log["force_kN"])
    assert np.std(values["force"][1:] - late[1:]) == pytest.approx(0.15, rel=0.15)
    assert abs(np.mean(values["force"][1:] - late[1:])) < 0.02
    mean_stroke = 0.5 * (values["stroke_1"] + values["stroke_2"])
    assert np.abs(mean_stroke - log["stroke_mm"]).max() < 0.12
    frame = 150.0 * (values["position"] - log["stroke_mm"])
    assert np.abs(frame - log["force_kN"])[1000:].max() < 10.0
    assert np.abs(values["command"] - values["position"]).max() < 1.2


def test_thermometers_convert_every_three_quarters_of_a_second(tmp_path: Path) -> None:
    stand = device(tmp_path, temperature_noise_C=0.0)
    stand.spring.sensor_temperature_C = 37.03  # type: ignore[misc]
    stand.advance_to(3.001)
    specimen, ambient = stand.thermometers
    assert [time_s for time_s, _ in specimen.readings] == [0.0, 0.75, 1.5, 2.25, 3.0]
    assert [counts for _, counts in specimen.readings][1:] == [round(37.03 * 16)] * 4
    assert {counts for _, counts in ambient.readings} == {21 * 16}


def test_amplifier_frames_come_at_their_rate(tmp_path: Path) -> None:
    file = stand_file(tmp_path)
    stand = device(tmp_path, force_noise_kN=0.0)
    move(stand)
    stand.advance_to(2.0)
    time_s = np.concatenate([frames.time_s for frames in stand.instruments[0].frames])
    counts = np.concatenate([frames.counts for frames in stand.instruments[0].frames])
    assert time_s.size == pytest.approx(500, abs=8)
    log = stand.truth.arrays()  # type: ignore[union-attr]
    value = file.instruments[0].channel.calibration.apply(counts)
    expected = np.interp(time_s - 0.002, log["time_us"] / 1e6 / (1 + 20e-6), log["force_kN"])
    assert value == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize("name", ["truth.npz", "truth.csv"])
def test_truth_file_gives_back_what_was_logged(tmp_path: Path, name: str) -> None:
    stand = device(tmp_path, FrictionSpring())
    move(stand)
    stand.advance(1234)
    assert stand.truth is not None
    stand.truth.write(tmp_path / "sub" / name)
    back, log = read_truth(tmp_path / "sub" / name), stand.truth.arrays()
    assert tuple(back) == COLUMNS
    assert back["sequence"].tolist() == list(range(1234))
    for column in COLUMNS:
        assert back[column] == pytest.approx(log[column], abs=1e-4), column
    integral = np.sum(0.5 * (back["force_kN"][1:] + back["force_kN"][:-1]) * np.diff(back["stroke_mm"]))
    assert back["work_J"][-1] == pytest.approx(integral, rel=1e-4)


def test_truth_of_a_long_run_is_merged_without_loss(tmp_path: Path) -> None:
    stand = device(tmp_path)
    for _ in range(2100):
        stand.advance(1)
    assert stand.truth is not None
    assert stand.truth.arrays()["sequence"].tolist() == list(range(2100))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("", "no table"),
        ("[simulation]\nframe_stiffness_kN_per_mm = 5.0\n", "frame_stiffness_kN_per_mm"),
        ("[simulation]\nspeed = 5.0\n", "unknown key “speed”"),
        ("[simulation]\ncolour = 5.0\n", "known here: .*actuator_bandwidth_Hz"),
    ],
)
def test_what_is_wrong_in_the_table_is_said(tmp_path: Path, table: str, says: str) -> None:
    file = stand_file(tmp_path, STAND.split("[simulation]")[0] + table)
    with pytest.raises(BadInput, match=says) as caught:
        simulation_settings(file)
    assert str(file.path) in str(caught.value)
