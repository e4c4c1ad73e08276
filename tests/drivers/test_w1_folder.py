from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.thermometers.ds18b20 import FAULT_TEXTS, ReadingFault, TemperatureReading
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings
from bufferstand.drivers.thermometers.w1.thermometer import W1Bus, W1Sensor, read_sensor, roms_on_bus
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.clocks import HandClock
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.test_ds18b20 import scratchpad, w1_text

PATIENCE_S = 120.0
ROMS = ("28-00000a3f91c2", "28-00000a3f92d7", "28-00000a40117b")


def settings() -> OneWireSettings:
    (settings,) = load_stand(SAMPLE_STAND).temperature
    assert isinstance(settings, OneWireSettings)
    return settings


def put(root: Path, rom: str, text: str, name: str = "w1_slave") -> None:
    """Show a text as the kernel does: who reads sees the old one or the new one, never a part."""
    folder = root / rom
    folder.mkdir(exist_ok=True)
    fresh = folder / "fresh"
    fresh.write_text(text, encoding="ascii")
    fresh.rename(folder / name)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for index, rom in enumerate(ROMS):
        put(tmp_path, rom, w1_text(scratchpad(336 + index)))
    (tmp_path / "w1_bus_master1").mkdir()
    return tmp_path


def until(done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def first_items(sensor: W1Sensor, count: int = 1) -> list[SampleBlock | SensorFault]:
    items: list[SampleBlock | SensorFault] = []

    def enough() -> bool:
        items.extend(sensor.drain())
        return len(items) >= count

    until(enough)
    return items


class TestOneRead:
    def test_a_reading(self, root: Path) -> None:
        assert read_sensor(root, ROMS[1]) == TemperatureReading(337, 12)

    @pytest.mark.parametrize(
        ("text", "fault"),
        [
            ("", ReadingFault.EMPTY),
            (w1_text(scratchpad(336), "NO"), ReadingFault.CRC_REFUSED),
            (w1_text(bytes(9)), ReadingFault.ALL_ZERO),
            (w1_text(scratchpad(0x0550, byte_6=0x0C)), ReadingFault.POWER_ON),
            (w1_text(scratchpad(0x07FF)), ReadingFault.NO_POWER),
        ],
    )
    def test_each_fault_of_the_text(self, root: Path, text: str, fault: ReadingFault) -> None:
        put(root, ROMS[0], text)
        assert read_sensor(root, ROMS[0]) is fault

    def test_a_sensor_that_is_not_there(self, root: Path) -> None:
        assert read_sensor(root, "28-000000000000") is ReadingFault.ABSENT

    def test_bytes_that_are_no_text(self, root: Path) -> None:
        (root / ROMS[0] / "w1_slave").write_bytes(b"\xff\xfe")
        assert read_sensor(root, ROMS[0]) is ReadingFault.GARBLED

    @pytest.mark.parametrize(
        ("number", "fault"),
        [("ENODEV", ReadingFault.ABSENT), ("EIO", ReadingFault.EMPTY), ("EACCES", ReadingFault.UNREADABLE)],
    )
    def test_errors_of_the_kernel(
        self, root: Path, monkeypatch: pytest.MonkeyPatch, number: str, fault: ReadingFault
    ) -> None:
        import errno

        def fail(self: Path, **_: object) -> str:
            raise OSError(getattr(errno, number), "no")

        monkeypatch.setattr(Path, "read_text", fail)
        assert read_sensor(root, ROMS[0]) is fault

    def test_roms_on_the_bus(self, root: Path) -> None:
        assert roms_on_bus(root) == ROMS
        assert roms_on_bus(root / "nowhere") == ()


class TestThread:
    def test_each_sensor_is_its_own_stream(self, root: Path) -> None:
        bus = W1Bus(root, settings(), WallClock())
        try:
            for sensor in bus.sensors:
                sensor.start()
                sensor.start()
            for index, sensor in enumerate(bus.sensors):
                (block,) = first_items(sensor)
                assert isinstance(block, SampleBlock)
                name = f"temperature_{index + 1}"
                assert block.stream == sensor.facts.name == name
                assert block.counts[name].tolist() == [336 + index]
                channel = sensor.facts.channels[0]
                assert channel.calibration.apply(block.counts[name])[0] == 21.0 + index / 16
            assert [sensor.facts.channels[0].place for sensor in bus.sensors] == [
                "spring plate 3", "spring plate 5", "air beside the stand",
            ]  # fmt: skip
        finally:
            for sensor in bus.sensors:
                sensor.close()
                sensor.close()

    def test_period_and_stamps_are_of_stand_time(self, root: Path) -> None:
        clock = HandClock()
        clock.advance(100.0)
        bus = W1Bus(root, settings(), clock)
        sensor = bus.sensors[0]
        sensor.start()
        try:
            got = first_items(sensor)
            for _ in range(3):
                time.sleep(0.05)
                assert sensor.drain() == []  # no reading before stand time moves on
                clock.advance(1.0)
                got += first_items(sensor)
            blocks = [item for item in got if isinstance(item, SampleBlock)]
            assert [int(block.time_us[0]) for block in blocks] == [
                100_000_000 + i * 1_000_000 for i in range(4)
            ]
            assert [block.first_sequence for block in blocks] == [0, 1, 2, 3]
        finally:
            sensor.close()

    def test_a_fault_names_sensor_place_and_rom_and_the_others_go_on(self, root: Path) -> None:
        put(root, ROMS[1], w1_text(scratchpad(0x0550, byte_6=0x0C)))
        bus = W1Bus(root, settings(), WallClock(speed=50.0))
        for sensor in bus.sensors:
            sensor.start()
        try:
            fault = first_items(bus.sensors[1])[0]
            assert isinstance(fault, SensorFault)
            assert fault.stream == "temperature_2"
            assert fault.what == (
                f"temperature_2 (spring plate 5, {ROMS[1]}): " + FAULT_TEXTS[ReadingFault.POWER_ON]
            )
            assert isinstance(first_items(bus.sensors[0])[0], SampleBlock)
            put(root, ROMS[1], w1_text(scratchpad(400)))
            until(lambda: any(isinstance(item, SampleBlock) for item in bus.sensors[1].drain()))
        finally:
            for sensor in bus.sensors:
                sensor.close()

    def test_a_read_that_hangs_is_reported_once_and_stalls_nobody(self, root: Path) -> None:
        pipe = root / ROMS[0] / "w1_slave"
        pipe.unlink()
        os.mkfifo(pipe)  # opening it for reading blocks, as a stuck kernel read does
        clock = HandClock()
        bus = W1Bus(root, settings(), clock)
        sensor = bus.sensors[0]
        sensor.start()
        try:
            assert sensor.drain() == []
            until(lambda: any(thread.name == "1-wire" for thread in threading.enumerate()))
            time.sleep(0.1)
            clock.advance(30.0)
            (fault,) = sensor.drain()
            assert isinstance(fault, SensorFault)
            assert (
                "a read of the 1-Wire bus hangs for 30 s; look at the bus and the kernel's log" in fault.what
            )
            assert sensor.drain() == []
        finally:
            with pipe.open("w", encoding="ascii") as far_end:
                put(root, ROMS[0], w1_text(scratchpad(336)))  # the next read shall not hang
                far_end.write(w1_text(scratchpad(336)))
            sensor.close()

    def test_no_folder(self, tmp_path: Path) -> None:
        bus = W1Bus(tmp_path / "nowhere", settings(), WallClock())
        with pytest.raises(
            DeviceFault, match=r"there is no folder .*nowhere; look whether the kernel's w1 driver"
        ):
            bus.sensors[0].start()
        bus.sensors[0].close()
