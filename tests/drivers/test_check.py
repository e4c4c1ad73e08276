from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from pathlib import Path

import pytest

from bufferstand.drivers.check.devices import check_stand
from bufferstand.drivers.check.rows import CheckRow, difference_row
from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.connect import open_stand
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import Endpoints, StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import RawServer, raw_server
from tests.drivers.test_ds18b20 import scratchpad, w1_text
from tests.drivers.test_gsv2 import PtyAmplifier
from tests.drivers.test_gsv2_frames import stream
from tests.drivers.test_w1_folder import ROMS, put

TODAY = date(2026, 6, 1)


class Wires:
    """Controller, amplifier and 1-Wire folder of one stand, each of which a test can spoil."""

    def __init__(self, server: RawServer, far: PtyAmplifier, root: Path) -> None:
        self.device = server.device
        self.far = far
        self.root = root
        endpoints = Endpoints("127.0.0.1", server.port, {"amplifier": far.path, "thermometers": root})
        self.stand_file: StandFile = with_endpoints(load_stand(SAMPLE_STAND), endpoints)

    def check(self) -> list[CheckRow]:
        self.device.sample(200)
        return check_stand(self.stand_file, WallClock(), TODAY, watch_s=0.0)


@contextmanager
def streaming(far: PtyAmplifier) -> Iterator[None]:
    end = threading.Event()

    def send() -> None:
        while not end.wait(0.02):
            if far.sending.is_set():
                far.send(stream([-1390] * 4))

    thread = threading.Thread(target=send)
    thread.start()
    yield
    end.set()
    thread.join()


@pytest.fixture
def wires(profile: Profile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Wires]:
    monkeypatch.setattr("bufferstand.drivers.check.devices.ANSWER_WAIT_S", 0.5)
    monkeypatch.setattr("bufferstand.drivers.check.devices.SECOND_CHANCE_S", 0.2)
    for index, rom in enumerate(ROMS):
        put(tmp_path, rom, w1_text(scratchpad(336 + index)))
    device = RingDevice(profile)
    device.at_rest = True
    with raw_server(device) as server:
        far = PtyAmplifier()
        with streaming(far):
            yield Wires(server, far, tmp_path)
        far.close()


def row(rows: list[CheckRow], device: str, item: str) -> CheckRow:
    (found,) = [one for one in rows if (one.device, one.item) == (device, item)]
    return found


def faults(rows: list[CheckRow]) -> list[tuple[str, str]]:
    return [(one.device, one.item) for one in rows if one.verdict is Verdict.FAULT]


def test_a_sound_stand(wires: Wires) -> None:
    rows = wires.check()
    assert faults(rows) == []
    assert (
        "bufferstand-ring, serial 630001, 1000 Hz, at 127.0.0.1:" in row(rows, "controller", "identity").value
    )
    trip = row(rows, "controller", "round trip").value
    assert trip.startswith("p50 ")
    assert trip.endswith(" ms (50 reads)")
    assert row(rows, "controller", "heartbeat").value == "counts"
    assert row(rows, "controller", "state").value == "off"
    assert row(rows, "controller", "force").value.endswith(" kN (load cell behind the specimen)")
    assert row(rows, "amplifier", "force_2").value.startswith("-0.11 kN")
    assert row(rows, "amplifier", "force − force_2").verdict is Verdict.OK
    assert row(rows, "temperature_2", "temperature_2").value == "21.06 °C (spring plate 5)"
    age_s = row(rows, "temperature_2", "temperature_2").age_s
    assert age_s is not None
    assert 0.0 <= age_s < 8.0
    assert row(rows, "controller", "calibration force").value == "GTM-K-630-0001, valid until 2099-01-15"
    assert row(rows, "temperature_1", "calibration temperature_1").verdict is Verdict.NOTE  # no certificate
    assert wires.device.executed == []
    assert wires.device.control_words == []
    assert wires.device.fed == []


def test_nothing_answers(tmp_path: Path, profile: Profile) -> None:
    with raw_server(RingDevice(profile)) as server:
        port = server.port
    nowhere = {"amplifier": tmp_path / "no-port", "thermometers": tmp_path / "no-folder"}
    endpoints = Endpoints("127.0.0.1", port, nowhere)
    rows = check_stand(with_endpoints(load_stand(SAMPLE_STAND), endpoints), WallClock(), TODAY)
    assert faults(rows) == [
        ("controller", "connection"),
        ("amplifier", "connection"),
        ("temperature_1", "connection"),
        ("temperature_2", "connection"),
        ("temperature_3", "connection"),
    ]
    assert "cannot connect: Connection refused" in row(rows, "controller", "connection").remark
    assert "look whether the device is there" in row(rows, "amplifier", "connection").remark
    assert "there is no folder" in row(rows, "temperature_1", "connection").remark


def test_a_controller_that_stands_still(wires: Wires, monkeypatch: pytest.MonkeyPatch) -> None:
    true_set = wires.device.set
    monkeypatch.setattr(
        wires.device, "set", lambda name, value: None if name == "heartbeat" else true_set(name, value)
    )
    rows = wires.check()
    assert faults(rows) == [("controller", "heartbeat")]
    assert "its control loop stands still" in row(rows, "controller", "heartbeat").remark


def test_a_controller_in_fault_with_an_empty_ring(wires: Wires, monkeypatch: pytest.MonkeyPatch) -> None:
    wires.device.set("state", 6)
    wires.device.set("fault_code", 1)
    wires.device.set("watchdog_trips", 2)
    monkeypatch.setattr(wires.device, "sample", lambda _count: None)
    rows = wires.check()
    assert faults(rows) == [("controller", "state"), ("controller", "samples")]
    remark = row(rows, "controller", "state").remark
    assert remark.startswith("fault 1 (watchdog: no heartbeat from the computer): look why; the next start")
    assert row(rows, "controller", "watchdog trips").verdict is Verdict.NOTE
    assert "its ring stays empty" in row(rows, "controller", "samples").remark


def test_values_that_cannot_be(wires: Wires) -> None:
    wires.device.force_kN = 700.0
    wires.device.apart_mm = 5.0
    put(wires.root, ROMS[2], w1_text(scratchpad(100 * 16)))
    rows = wires.check()
    assert faults(rows) == [
        ("controller", "force"),
        ("controller", "stroke_1 − stroke_2"),
        ("temperature_3", "temperature_3"),
        ("amplifier", "force − force_2"),
    ]
    assert "outside -60 … 600 kN; look at transducer" in row(rows, "controller", "force").remark
    assert "look for tilt, a slack or a snagged wire" in row(rows, "controller", "stroke_1 − stroke_2").remark
    assert "the two amplifiers disagree" in row(rows, "amplifier", "force − force_2").remark


def test_sensors_that_give_no_reading(wires: Wires) -> None:
    put(wires.root, ROMS[0], "")
    (wires.root / ROMS[1] / "w1_slave").unlink()
    put(wires.root, "28-3c01d607a2f4", w1_text(scratchpad(300)))
    rows = wires.check()
    assert ("temperature_1", "reading") in faults(rows)
    remarks = {one.device: one.remark for one in rows if one.item == "reading"}
    assert "the kernel returned an empty read" in remarks["temperature_1"]
    assert "not on the bus" in remarks["temperature_2"]
    assert row(rows, "1-wire", "28-3c01d607a2f4").remark.startswith("on the bus but not in the stand file")
    assert row(rows, "temperature_3", "temperature_3").verdict is Verdict.OK


def test_calibrations_and_clones(wires: Wires) -> None:
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    for old, new in (
        (
            'certificate = "simulated", date = "2026-01-15", valid_until = "2099-01-15" }',
            'certificate = "c" }',
        ),
        ('valid_until = "2099-01-15"', 'valid_until = "2026-05-31"'),
        ('valid_until = "2099-01-15"', 'valid_until = "2026-06-20"'),
        ("28-00000a40117b", "28-3c01d607a2f4"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    path = wires.root / "stand.toml"
    path.write_text(text, encoding="utf-8")
    other = wires.stand_file
    places = {"amplifier": wires.far.path, "thermometers": wires.root}
    endpoints = Endpoints(other.controller.host, other.controller.port, places)
    wires.stand_file = with_endpoints(load_stand(path), endpoints)
    rows = wires.check()
    assert row(rows, "controller", "calibration force").remark == "its certificate has no “valid_until”"
    assert row(rows, "controller", "calibration stroke_1").verdict is Verdict.FAULT
    assert row(rows, "controller", "calibration stroke_1").remark.startswith("expired on 2026-05-31")
    assert row(rows, "controller", "calibration stroke_2").remark == "ends soon, on 2026-06-20"
    assert "a clone" in row(rows, "temperature_3", "rom").remark


@pytest.mark.slow
def test_an_opened_stand_reads_everything_and_can_be_closed_twice(wires: Wires) -> None:
    wires.device.sample(10)
    stand = open_stand(wires.stand_file, WallClock())
    try:
        assert [sensor.facts.name for sensor in stand.sensors] == [
            "amplifier", "temperature_1", "temperature_2", "temperature_3",
        ]  # fmt: skip
        assert stand.controller.read_block() is not None
        assert stand.controller.connect().serial == "630001"  # again, without harm
    finally:
        stand.close()
        stand.close()
    assert not [thread for thread in threading.enumerate() if thread.name in {"amplifier", "1-wire"}]


@pytest.mark.slow
def test_a_stand_that_does_not_open_leaves_nothing_open(wires: Wires) -> None:
    broken = with_endpoints(wires.stand_file, Endpoints(instruments={"thermometers": wires.root / "nowhere"}))
    with pytest.raises(DeviceFault, match="there is no folder"):
        open_stand(broken, WallClock())
    assert not [thread for thread in threading.enumerate() if thread.name in {"amplifier", "1-wire"}]
    for sensor in build_sensors(wires.stand_file, WallClock())[:1]:
        sensor.start()  # the port is free again
        sensor.close()


def test_the_stands_own_tilt_limit_judges_the_draw_wires() -> None:
    assert difference_row("stroke_1", "stroke_2", -0.9).verdict is Verdict.OK
    strict = difference_row("stroke_1", "stroke_2", -0.9, 0.5)
    assert strict.verdict is Verdict.FAULT
    assert strict.remark == "the draw wires disagree; look for tilt, a slack or a snagged wire"
