"""A simulated stand that is wired wrong: what is read is wrong as said, what happened is as before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.miswiring.settings import (
    Miswired,
    MiswiredForce,
    MiswiredSignal,
    MiswiredStroke,
    MiswiredThermometer,
)
from bufferstand.drivers.simulated.miswiring.signal import WrongForce, WrongSignal
from bufferstand.drivers.simulated.settings import simulation_settings
from bufferstand.foundation.errors import BadInput
from tests.drivers.simulated.standing import STAND, HandClock, LinearSpring, device, stand_file

QUIET: dict[str, Any] = {
    "force_noise_kN": 0.0,
    "stroke_noise_mm": 0.0,
    "wire_linearity_mm": 0.0,
    "wire_tilt": 0.0,
}
COUNTS_PER_KN = 2**20 / 100.0


def moved(folder: Path, miswired: Miswired, *, count: int = 1500) -> SimulatedDevice:
    """Return a stand that has moved to 40 mm at 50 mm/s."""
    stand = device(folder, LinearSpring(), miswired=miswired, **QUIET)
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=50.0))
    stand.controller.execute(1)
    stand.advance(count)
    return stand


def read(stand: SimulatedDevice, folder: Path) -> dict[str, np.ndarray]:
    channels = {channel.name: channel for channel in stand_file(folder).controller.channel}
    _, counts = stand.ring.window(0, stand.ring.total)
    return {
        name: channels[name].calibration.apply(column.astype(float))
        for name, column in counts.items()
        if name != "tick"
    }


def truth(stand: SimulatedDevice) -> dict[str, np.ndarray]:
    assert stand.truth is not None
    return stand.truth.arrays()


def second_force(stand: SimulatedDevice) -> tuple[np.ndarray, np.ndarray]:
    frames = list(stand.instruments[0].frames)
    counts = np.concatenate([frame.counts for frame in frames])
    return np.concatenate([frame.time_s for frame in frames]), counts * 7.885695443832332e-05


def test_scale_sign_and_zero_of_each_channel_are_as_said_and_the_truth_is_what_happened(
    tmp_path: Path,
) -> None:
    right = moved(tmp_path, Miswired())
    stand = moved(
        tmp_path,
        Miswired(
            force=MiswiredForce(scale=-0.1, zero=3.0),
            amplifier=MiswiredSignal(scale=2.5, zero=-1.0),
            stroke_1=MiswiredStroke(scale=0.5, zero=15.0),
            stroke_2=MiswiredStroke(scale=-1.0),
            position=MiswiredStroke(zero=-7.0),
        ),
    )
    for name, column in truth(right).items():
        np.testing.assert_array_equal(truth(stand)[name], column, err_msg=name)
    was, got = read(right, tmp_path), read(stand, tmp_path)
    assert np.max(was["force"]) > 150.0
    np.testing.assert_allclose(got["force"], -0.1 * was["force"] + 3.0, atol=1e-4)
    np.testing.assert_allclose(got["stroke_1"], 0.5 * was["stroke_1"] + 15.0, atol=0.01)
    np.testing.assert_allclose(got["stroke_2"], -was["stroke_2"], atol=0.01)
    np.testing.assert_allclose(got["position"], was["position"] - 7.0, atol=0.01)
    np.testing.assert_array_equal(got["command"], was["command"])
    np.testing.assert_allclose(second_force(stand)[1], 2.5 * second_force(right)[1] - 1.0, atol=1e-3)
    assert stand.measured_force_kN == pytest.approx(-0.1 * right.measured_force_kN + 3.0)
    assert stand.measured_stroke_mm == pytest.approx(0.5 * (got["stroke_1"][-1] + got["stroke_2"][-1]))


def test_a_force_that_only_the_computer_scales_wrong_is_right_for_the_controller(tmp_path: Path) -> None:
    stand = moved(tmp_path, Miswired(force=MiswiredForce(scale=0.1, controller_too=False)))
    assert stand.measured_force_kN == pytest.approx(truth(stand)["force_kN"][-1], rel=1e-3)
    np.testing.assert_allclose(read(stand, tmp_path)["force"][-1], 0.1 * stand.measured_force_kN, atol=1e-3)


def test_a_controller_whose_force_has_the_wrong_sign_does_not_see_its_own_limit(tmp_path: Path) -> None:
    for scale, tripped in ((1.0, True), (-1.0, False)):
        stand = device(tmp_path, LinearSpring(), miswired=Miswired(force=MiswiredForce(scale=scale)), **QUIET)
        stand.controller.set_force_limit(50.0)
        stand.controller.control(0x000F)
        stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=40.0, speed_mm_per_s=50.0))
        stand.controller.execute(1)
        stand.advance(1500)
        assert (stand.controller.fault != 0) is tripped, scale
        assert (np.max(truth(stand)["force_kN"]) > 150.0) is not tripped


@pytest.mark.parametrize("pieces", [(1500,), (1, 499, 37, 963)])
def test_a_delay_and_a_low_pass_are_those_of_the_closed_form(tmp_path: Path, pieces: tuple[int, ...]) -> None:
    stand = device(
        tmp_path,
        LinearSpring(),
        miswired=Miswired(
            force=MiswiredForce(delay_s=0.2503, controller_too=False),
            amplifier=MiswiredSignal(delay_s=0.5),
            stroke_1=MiswiredStroke(low_pass_Hz=2.0),
        ),
        **QUIET,
    )
    stand.controller.control(0x000F)
    stand.controller.arm(Command(1, CommandCode.RAMP, target_mm=60.0, speed_mm_per_s=20.0))
    stand.controller.execute(1)
    for count in pieces:
        stand.advance(count)
    got, true = read(stand, tmp_path), truth(stand)
    time_s = (true["sequence"] + 1) * stand.period_s
    late = np.interp(time_s - 0.2503 - 0.0008, time_s, true["force_kN"])
    np.testing.assert_allclose(got["force"][400:], late[400:], atol=0.02)
    due_s, second = second_force(stand)
    some = due_s > 0.6
    np.testing.assert_allclose(
        second[some], np.interp(due_s[some] - 0.502, time_s, true["force_kN"]), atol=0.05
    )
    # Behind an even motion of v a low pass stays by v/ω; frame (150) and spring (5 kN/mm) share the piston's.
    lag_mm = 20.0 * 150.0 / 155.0 / (2.0 * np.pi * 2.0)
    assert true["stroke_mm"][-1] - got["stroke_1"][-1] == pytest.approx(lag_mm, rel=0.01)


def test_what_happens_at_a_time_happens_at_its_sample(tmp_path: Path) -> None:
    stand = moved(
        tmp_path,
        Miswired(
            force=MiswiredForce(from_s=0.5, scale=0.1, controller_too=False),
            stroke_1=MiswiredStroke(slip_mm=-3.0, slip_at_s=0.4),
            stroke_2=MiswiredStroke(frozen_at_s=0.3),
        ),
    )
    right = read(moved(tmp_path, Miswired()), tmp_path)
    got, time_s = read(stand, tmp_path), (truth(stand)["sequence"] + 1) * stand.period_s
    for name, at_s, after in (
        ("force", 0.5, 0.1 * right["force"]),
        ("stroke_1", 0.4, right["stroke_1"] - 3.0),
        ("stroke_2", 0.3, np.full(time_s.size, right["stroke_2"][time_s < 0.3][-1])),
    ):
        np.testing.assert_allclose(got[name], np.where(time_s < at_s, right[name], after), atol=0.01)


def test_channels_that_are_exchanged_show_each_others_values(tmp_path: Path) -> None:
    stand = moved(
        tmp_path,
        Miswired(
            force=MiswiredForce(reads="position"),
            stroke_1=MiswiredStroke(reads="position"),
            position=MiswiredStroke(reads="stroke_1"),
            stroke_2=MiswiredStroke(reads="force"),
        ),
    )
    right, got = read(moved(tmp_path, Miswired()), tmp_path), read(stand, tmp_path)
    np.testing.assert_allclose(got["stroke_1"], right["position"], atol=0.01)
    np.testing.assert_allclose(got["position"], right["stroke_1"], atol=0.01)
    np.testing.assert_allclose(got["stroke_2"], right["force"], atol=0.01)
    np.testing.assert_allclose(got["force"], right["position"], atol=0.01)
    assert stand.measured_force_kN == pytest.approx(stand.actuator.position_mm)


def test_the_controller_and_the_computer_take_one_force_for_the_same() -> None:
    """Sample by sample and in slices: one law in two forms."""
    facts = MiswiredForce(delay_s=0.0405, low_pass_Hz=3.0, scale=-0.5, zero=2.0, from_s=0.3, frozen_at_s=0.9)
    one, other = WrongForce(facts, 0.001), WrongSignal(facts)
    time_s = np.arange(1, 1201) * 0.001
    force = 50.0 * (1.0 - np.cos(6.0 * time_s))
    single = np.array([one.feel(at, now) for at, now in zip(time_s.tolist(), force.tolist(), strict=True)])
    pieces = np.split(np.arange(1200), [5, 6, 300, 777])
    sliced = np.concatenate([other.arrive(time_s[rows], force[rows]) for rows in pieces])
    np.testing.assert_allclose(single, sliced, atol=1e-4)


def test_a_delayed_force_reaches_a_controller_that_stands_still(tmp_path: Path) -> None:
    stand = moved(tmp_path, Miswired(force=MiswiredForce(delay_s=0.8)), count=1000)
    assert abs(stand.measured_force_kN - truth(stand)["force_kN"][-1]) > 50.0
    stand.advance(1000)  # the piston has stood for long
    assert stand.measured_force_kN == pytest.approx(truth(stand)["force_kN"][-1], abs=0.1)


def test_thermometers_feel_what_is_said(tmp_path: Path) -> None:
    spring = LinearSpring()
    spring.sensor_temperature_C = 35.0
    sensors = {
        "temperature_1": MiswiredThermometer(falls_off_at_s=20.0, falls_s=10.0),
        "temperature_2": MiswiredThermometer(feels="specimen", frozen_at_s=40.0),
    }
    stand = device(tmp_path, spring, miswired=Miswired(thermometer=sensors), temperature_noise_C=0.0)
    for second in range(1, 61):
        spring.sensor_temperature_C = 35.0 + 0.1 * second
        stand.advance_to(float(second))
    felt = {
        one.settings.name: {round(at_s, 2): counts / 16.0 for at_s, counts in one.readings}
        for one in stand.thermometers
    }
    first, second = felt["temperature_1"], felt["temperature_2"]
    assert first[19.5] == pytest.approx(36.9, abs=0.2)
    for after_s in (10.0, 25.0, 40.0):
        at_s = min(first, key=lambda known: abs(known - 20.0 - after_s))
        assert first[at_s] == pytest.approx(21.0 + 15.9 * np.exp(-(at_s - 20.0) / 10.0), abs=0.3)
    assert second[30.0] == pytest.approx(38.0, abs=0.2)
    assert second[58.5] == second[45.0] == pytest.approx(39.0, abs=0.2)
    assert stand.truth is not None


def test_a_thermometer_that_was_never_attached_feels_the_air(tmp_path: Path) -> None:
    spring = LinearSpring()
    spring.sensor_temperature_C = 35.0
    never = Miswired(
        thermometer={"temperature_1": MiswiredThermometer(feels="ambient", scale=1.8, zero=32.0)}
    )
    stand = device(tmp_path, spring, miswired=never, temperature_noise_C=0.0)
    stand.advance_to(2.0)
    assert stand.thermometers[0].readings[-1][1] / 16.0 == pytest.approx(21.0 * 1.8 + 32.0, abs=0.05)


def test_a_stand_file_says_it_and_the_stand_in_process_reads_wrong(tmp_path: Path) -> None:
    text = STAND + "\n[simulation.miswired.force]\nscale = -1.0\nzero = 5.0\n"
    text += '[simulation.miswired.thermometer.temperature_2]\nfeels = "specimen"\n'
    spring = LinearSpring()
    spring.sensor_temperature_C = 50.0
    opened = open_in_process(stand_file(tmp_path, text), spring=spring)
    opened.stand.controller.connect()
    opened.stand.controller.connect()
    for sensor in opened.stand.sensors:
        sensor.start()
    opened.clock.sleep(3.0)
    assert opened.stand.controller.status().force_kN == pytest.approx(5.0)
    block = opened.stand.controller.read_block()
    assert block is not None
    assert float(np.mean(block.counts["force"])) / COUNTS_PER_KN == pytest.approx(5.0, abs=0.2)
    room = opened.device.thermometers[1].readings[-1][1] / 16.0
    assert room == pytest.approx(50.0, abs=0.2)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("force]\nscale = 0.0", "a scale of 0 is no signal"),
        ("force]\nscal = 0.1", "scale"),
        ('thermometer.temperature_7]\nfeels = "ambient"', "the stand has no thermometer “temperature_7”"),
        ('stroke_1]\nreads = "stroke_7"', "reads"),
    ],
)
def test_what_cannot_be_wired_so_is_refused(tmp_path: Path, table: str, said: str) -> None:
    file = stand_file(tmp_path, f"{STAND}\n[simulation.miswired.{table}\n")
    with pytest.raises(BadInput) as refused:
        make_device(file, HandClock(), spring=LinearSpring())
    assert said in str(refused.value)


@pytest.mark.slow
def test_an_amplifier_that_is_not_there_cannot_be_wired_wrong(tmp_path: Path) -> None:
    file = stand_file(tmp_path, f"{STAND}\n[simulation.miswired.amplifier]\nscale = 0.1\n")
    settings = simulation_settings(file)
    bare = file.model_copy(update={"amplifier": None})
    with pytest.raises(BadInput, match="no amplifier"):
        SimulatedDevice(bare, settings, LinearSpring(), HandClock())
