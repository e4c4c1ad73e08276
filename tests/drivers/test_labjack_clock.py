"""The clock of a LabJack, read beside its stream: it places the samples by the host's time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.acquisition.labjack.driver import CLOCK_FIRST, LabJackDriver
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.interfaces import ClockReading, OwnClock, SampleBlock
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import BadInput, WallClock
from bufferstand.recording.runfile import ClockLine, ClockReadings
from tests.peers.labjack.emulator import LabJackEmulator
from tests.two_clocks.stands import written

TURN_S = 0.5
"""Period of the signal: what it shows tells the true time to a tenth of a millisecond."""
DRIFT = 80e-6


def driver_of(far: LabJackEmulator, clock: WallClock) -> LabJackDriver:
    settings = LabJackSettings.model_validate(
        {
            "kind": "labjack",
            "model": "T7",
            "host": "127.0.0.1",
            "port": far.port,
            "stream_port": far.stream_port,
            "rate_Hz": 1000.0,
            "input": [
                {"terminal": "AIN0", "channel": {"name": "force_2", "quantity": "force", "unit": "kN"}}
            ],
        }
    )
    return LabJackDriver(settings, clock, "acquisition")


def listened(
    driver: LabJackDriver, lasts_s: float, *, ask: bool = True
) -> tuple[list[SampleBlock], list[ClockReading]]:
    blocks, readings = [], []
    end_s = time.monotonic() + lasts_s
    while time.monotonic() < end_s:
        blocks += [one for one in driver.drain() if isinstance(one, SampleBlock)]
        if ask:
            readings += driver.clock_readings()
        time.sleep(0.02)
    return blocks, readings


@pytest.mark.slow
def test_readings_place_the_samples_to_within_their_bound() -> None:
    clock = WallClock()
    with LabJackEmulator({0: lambda t: 5.0 * np.sin(2.0 * np.pi * t / TURN_S)}, drift=DRIFT) as far:
        offset_s = far.now_s() - clock.now_s()  # both run by the computer's clock
        driver = driver_of(far, clock)
        assert isinstance(driver, OwnClock)
        driver.start()
        try:
            blocks, readings = listened(driver, 3.0)
        finally:
            driver.close()
    assert len(readings) >= CLOCK_FIRST
    line = ClockLine(
        ClockReadings(
            np.array([one.device_us for one in readings]),
            np.array([one.host_s for one in readings]),
            np.array([one.half_trip_s for one in readings]),
        )
    )
    stamps_s = np.concatenate([one.time_us for one in blocks]) * 1e-6
    volts = np.concatenate([one.counts["force_2"] for one in blocks])
    true_s = line.to_host_s(stamps_s) + offset_s
    turn = 2.0 * np.pi * true_s / TURN_S
    # The sine that was felt against the one that is expected at the places found: its phase is what is left.
    phase = np.arctan2(np.mean(volts * np.cos(turn)), np.mean(volts * np.sin(turn)))
    left_s = float(phase) * TURN_S / (2.0 * np.pi)
    assert abs(left_s) < line.bound_s + 1e-3  # a scan's period: its inputs are sampled within it


def test_who_does_not_ask_puts_nothing_on_the_wire() -> None:
    clock = WallClock()
    with LabJackEmulator({0: lambda t: 0.0 * t}) as far:
        driver = driver_of(far, clock)
        driver.start()
        try:
            blocks, _ = listened(driver, 0.3, ask=False)
            assert blocks
            assert not driver.clock_readings()
        finally:
            driver.close()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('model = "T7"', 'model = "T8"', "record-only mode"),
        ('force = "force_2"', 'force = "force_9"', "there are force, force_2"),
        ('force = "force_2"', 'force = "force_2"\nstroke = ["stroke_1", "stroke_3"]', "of one device"),
        ('name = "force_2"', 'name = "force"', "cannot have this name beside a controller"),
        ('name = "stroke_3"', 'name = "stroke_2"', "have the name “stroke_2”"),
    ],
)
def test_what_a_stand_file_cannot_say(old: str, new: str, said: str, tmp_path: Path) -> None:
    written(tmp_path)
    path = tmp_path / "stand.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    ranged = text.replace('terminal = "AIN', 'range_V = 11.0\nterminal = "AIN') if "T8" in new else text
    path.write_text(ranged.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInput, match=said):
        load_stand(path)
