"""Clock drift as a check shows it, and the hints about a device that does not answer."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.check.clock import drift_row, fit_drift
from bufferstand.drivers.check.devices import check_devices, check_stand
from bufferstand.drivers.check.hints import controller_hint, port_hint
from bufferstand.drivers.check.rows import CheckRow, rate_row
from bufferstand.drivers.check.samples import WatchedSamples, sample_rate_row
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.modbus.wires import RtuWire
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import Endpoints, StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import raw_server


def readings(
    ppm: float, jitter_s: float, count: int = 400, seed: int = 1, start_us: int = (1 << 32) - 700_000
) -> tuple[list[float], list[float], list[int]]:
    """Read a clock that wraps, over a wire whose trips are uneven."""
    draw = random.Random(seed)
    host, trips, ticks = [], [], []
    for number in range(count):
        out_s, back_s = draw.expovariate(1.0 / jitter_s), draw.expovariate(1.0 / jitter_s)
        asked_s = number * 0.0125
        host.append(asked_s + 0.5 * (out_s + back_s))
        trips.append(out_s + back_s)
        ticks.append((start_us + round((asked_s + out_s) * (1e6 + ppm))) % (1 << 32))
    return host, trips, ticks


@pytest.mark.parametrize("ppm", [-150.0, 0.0, 20.0, 900.0])
def test_the_slope_of_a_clean_clock_is_its_drift(ppm: float) -> None:
    drift = fit_drift(*readings(ppm, 1e-9))
    assert drift is not None
    assert drift.ppm == pytest.approx(ppm, abs=0.2)  # of µs in 5 s
    assert drift.expanded_ppm < 0.8  # two microseconds at both ends
    assert abs(drift.ppm - ppm) <= drift.expanded_ppm
    assert drift.span_s == pytest.approx(399 * 0.0125)


def test_too_few_readings_are_no_line() -> None:
    host, trips, ticks = readings(20.0, 1e-6, count=2)
    assert fit_drift(host, trips, ticks) is None
    assert drift_row(None).verdict is Verdict.OK


def test_a_drift_is_judged_by_what_is_sure_of_it() -> None:
    def judged(ppm: float, jitter_s: float = 1e-9) -> CheckRow:
        return drift_row(fit_drift(*readings(ppm, jitter_s)))

    assert judged(20.0).verdict is Verdict.OK
    assert judged(400.0).verdict is Verdict.NOTE
    assert judged(9e6).verdict is Verdict.FAULT
    assert "10 times as fast as this computer's: look at the unit of register tick" in judged(9e6).remark
    assert "ppm" in judged(20.0).value
    assert judged(20.0).figures["drift_ppm"] == pytest.approx(20.0, abs=0.2)


def test_rates_and_losses_are_judged() -> None:
    assert rate_row("c", "r", 1000.0, 1000.0, 0, tolerance=0.02).verdict is Verdict.OK
    slow = rate_row("c", "r", 900.0, 1000.0, 0, tolerance=0.02)
    assert (slow.verdict, slow.value) == (Verdict.FAULT, "900 Hz of 1000")
    lost = rate_row("c", "r", 1000.0, 1000.0, 3, tolerance=0.02)
    assert "3 lost" in lost.value
    assert "second program reads" in lost.remark


def test_the_stand_in_process_is_sound_and_its_clock_runs_as_it_was_set() -> None:
    file = load_stand(SAMPLE_STAND)
    opened = open_in_process(file)
    rows = check_devices(file, opened.stand.controller, opened.stand.sensors, opened.clock, watch_s=5.0)
    assert [row for row in rows if row.verdict is Verdict.FAULT] == []
    found = {(row.device, row.item): row for row in rows}
    drift = found["controller", "clock drift"].figures
    assert abs(drift["drift_ppm"] - 20.0) <= drift["drift_expanded_uncertainty_ppm"] < 100.0
    assert found["controller", "sample rate"].figures["rate_Hz"] == pytest.approx(1000.0, rel=0.02)
    assert ("temperature_3", "temperature_3") in found


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("cannot be opened ([Errno 13] Permission denied: '/dev/ttyUSB0')", "group dialout (sudo usermod"),
        ("cannot be opened (No such file or directory)", "serial ports of this computer:"),
        ("cannot be opened (Could not exclusively lock port)", "another program holds this port"),
        ("no reply within 0.5 s", ""),
    ],
)
def test_a_port_that_does_not_open(text: str, hint: str) -> None:
    assert hint in port_hint(text)
    assert bool(port_hint(text)) == bool(hint)


def at(port: int, **changes: object) -> StandFile:
    file = with_endpoints(load_stand(SAMPLE_STAND), Endpoints("127.0.0.1", port))
    controller = file.controller.model_copy(update={"timeout_s": 0.2, **changes})
    return file.model_copy(update={"controller": controller, "amplifier": (), "temperature": ()})


def connection(file: StandFile) -> str:
    rows = check_stand(file, WallClock(), watch_s=0.0)
    (remark,) = [row.remark for row in rows if row.item == "connection"]
    return remark


def test_a_wrong_unit_id_is_found(tmp_path: Path) -> None:
    path = tmp_path / "stand.toml"
    models = f"{SAMPLE_STAND.parent}/models/"
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace("models/", models, 1)
    path.write_text(text.replace("device_id = 1", "device_id = 3"), encoding="utf-8")
    with start_process(path, directory=tmp_path / "run") as process:
        remark = connection(at(process.served.port))
    assert "refused with Modbus exception 11 (gateway target does not respond)" in remark
    assert "it answers with device_id = 3, by this profile: write that into the stand file" in remark


@pytest.mark.slow
def test_words_in_the_other_order_are_told(profile: Profile) -> None:
    device = RingDevice(profile)
    read = device.read

    def swapped(address: int, count: int) -> list[int]:
        words = read(address, count)
        if address == 0:
            words[2:4], words[4:6], words[6:8] = words[3:1:-1], words[5:3:-1], words[7:5:-1]
            words[8:10] = words[9:7:-1]
        return words

    device.read = swapped  # type: ignore[method-assign]
    with raw_server(device) as server:
        remark = connection(at(server.port))
    assert "its 32-bit values come with the other word first: the profile says word_order" in remark


@pytest.mark.slow
def test_nobody_listens_at_the_port(profile: Profile) -> None:
    with raw_server(RingDevice(profile)) as server:
        port = server.port
    remark = connection(at(port))
    assert "cannot connect: Connection refused" in remark
    assert "host and port of the stand file right" in remark


@pytest.mark.slow
def test_a_refusal_that_is_no_gateways_asks_nobody_else() -> None:
    fault = DeviceFault("controller at x: register device_type holds 0x1 instead of 0x4253")
    assert controller_hint(fault, at(1)) == (  # at port 1 nobody would answer, and no unit is named
        "bufferstand instruments --probe 127.0.0.1:1 --unit 1 "
        "says which description would fit what it answers"
    )


@pytest.mark.slow
@pytest.mark.parametrize(("lost", "verdict"), [(0, Verdict.OK), (4, Verdict.NOTE), (40, Verdict.FAULT)])
@pytest.mark.parametrize("counted", [True, False])
def test_polls_left_out_are_a_note_until_they_are_many(lost: int, verdict: Verdict, counted: bool) -> None:
    """Whether they are counted as lost (a gap) or not (late polls): up to 10 % of the periods."""
    block = SampleBlock("controller", 0, np.zeros(1, dtype=np.int64), {}, 0, 12.0)
    late = WatchedSamples(block, samples=200 - lost, since_s=10.0)
    seen = WatchedSamples(block, samples=200, lost=lost, since_s=10.0)
    row = sample_rate_row(seen if counted else late, 100.0, polled=True)
    if counted or lost != 4:  # 2 % of late polls are no more than the rate's own tolerance
        assert row.verdict is verdict
    assert sample_rate_row(seen, 100.0, polled=False).verdict is (Verdict.FAULT if lost else Verdict.OK)


@pytest.mark.slow
@pytest.mark.parametrize(("late_s", "verdict"), [((0.0, 0.0), Verdict.FAULT), ((0.01, 0.07), Verdict.OK)])
def test_samples_that_a_busy_computer_receives_late_make_no_wrong_rate(
    late_s: tuple[float, float], verdict: Verdict
) -> None:
    """1.93 s of samples in 2 s: the last block may have been made 70 ms before it came."""
    block = SampleBlock("controller", 0, np.zeros(1, dtype=np.int64), {}, 0, 12.0)
    seen = WatchedSamples(block, samples=1930, since_s=10.0, late_s=late_s)
    assert sample_rate_row(seen, 1000.0, polled=False).verdict is verdict
    slower = WatchedSamples(block, samples=1800, since_s=10.0, late_s=late_s)
    assert sample_rate_row(slower, 1000.0, polled=False).verdict is Verdict.FAULT


@pytest.mark.slow
def test_a_wrong_baud_rate_is_found(monkeypatch: pytest.MonkeyPatch, profile: Profile) -> None:
    """A pseudo-terminal has no rate, so the line is played: only at 9600 baud somebody answers."""

    class PlayedLink:
        def __init__(self, wire: RtuWire, *, device_id: int, timeout_s: float) -> None:
            del timeout_s
            self._right = wire._baud == 9600 and device_id == 1

        def read(self, address: int, count: int, what: str, *, table: str) -> list[int]:
            del what, table
            if not self._right:
                raise DeviceFault("no reply within 0.25 s")
            return RingDevice(profile).read(address, count)

        def close(self) -> None:
            pass

    monkeypatch.setattr("bufferstand.drivers.check.hints.ModbusLink", PlayedLink)
    file = load_stand(SAMPLE_STAND)
    line = file.controller.model_copy(update={"host": "", "serial": "/dev/ttyUSB0"})
    fault = DeviceFault("controller at /dev/ttyUSB0: reading (FC3): no reply within 0.5 s, twice")
    hint = controller_hint(fault, file.model_copy(update={"controller": line}))
    assert hint == "it answers with baud = 9600, by this profile: write that into the stand file"
    other = line.model_copy(update={"device_id": 9})
    hint = controller_hint(fault, file.model_copy(update={"controller": other}))
    assert "are the wires A and B swapped?" in hint
