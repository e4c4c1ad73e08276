"""The simulated stand's sensors on their wires, and each fault as the drivers tell it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.wires.sensors import SensorWires
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.drivers.thermometers.ds18b20 import FAULT_TEXTS, ReadingFault, TemperatureReading
from bufferstand.drivers.thermometers.ds18b20_sensor import SHOWN_AS
from bufferstand.drivers.thermometers.w1.simulated import W1Tree
from bufferstand.drivers.thermometers.w1.thermometer import FolderReader, read_sensor
from bufferstand.foundation.clock import WallClock
from tests.drivers.amplifiers import Collector, until
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.pump import Pump
from tests.drivers.simulated.standing import device

GSV2 = 'protocol = "gsv2"\nport = "wires/amplifier"\nbaud = 38400\nrate_Hz = 250.0\n'
W1 = 'kind = "w1"\nroot = "wires/w1/devices"\nperiod_s = 1.0\n'
ROM = "28-00000a3f91c2"


class Served:
    """A simulated stand whose sensors are served by a thread, in wall time."""

    def __init__(self, folder: Path, *changes: tuple[str, str]) -> None:
        text = SAMPLE_STAND.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = folder / "stand.toml"
        path.write_text(text, encoding="utf-8")
        self.file: StandFile = load_stand(path)
        self._clock = WallClock()
        model = SAMPLE_STAND.parent / "models" / "category-a-elastomer.toml"
        self.device: SimulatedDevice = make_device(self.file, self._clock.wall_s, model=model)
        self.wires = SensorWires(self.file, self.device, folder / "wires")
        self._pump = Pump(self._step)

    def close(self) -> None:
        self._pump.close()
        self.wires.close()

    def _step(self) -> None:
        self.device.advance_to(self._clock.now_s())
        self.wires.serve(self.device.time_s)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[list[Served]]:
    made: list[Served] = []
    yield made
    for one in made:
        one.close()


@pytest.mark.parametrize(
    "changes",
    [
        (),
        ((GSV2, GSV2.replace("gsv2", "aed").replace("250.0", "100.0") + "aed = { output = 9 }\n"),),
        ((W1, 'kind = "ds2480b"\nport = "wires/onewire"\nperiod_s = 0.5\n'),),
        ((W1, W1 + 'access = "bulk"\n'),),
    ],
    ids=["gsv2-w1", "aed", "ds2480b", "bulk"],
)
def test_the_drivers_read_the_stand_that_the_file_describes(
    tmp_path: Path, served: list[Served], changes: tuple[tuple[str, str], ...]
) -> None:
    stand = Served(tmp_path, *changes)
    served.append(stand)
    reached = with_endpoints(stand.file, stand.wires.endpoints())
    sensors = build_sensors(reached, WallClock())
    got = [Collector(sensor) for sensor in sensors]
    try:
        for sensor in sensors:
            sensor.start()
        until(lambda: all(c.take().blocks for c in got))
        amplifier, *thermometers = got
        (channel,) = amplifier.sensor.facts.channels
        assert abs(channel.calibration.apply(amplifier.counts[0])) < 2.0  # nothing on the transducer
        assert all(abs(collector.counts[0] / 16 - 21.0) < 1.0 for collector in thermometers)
        assert [said for collector in got for said in collector.said] == []
    finally:
        for sensor in sensors:
            sensor.close()


@pytest.mark.parametrize(
    "kind",
    [
        "silent",
        "crc",
        "crc-mismatch",
        "all-zero",
        "power-on",
        "no-power",
        "out-of-range",
        "garbled",
        "missing",
    ],
)
def test_each_fault_of_the_folder_is_read_as_what_it_is(tmp_path: Path, kind: str) -> None:
    class Schedule:
        def at(self, target: str, time_s: float) -> str | None:
            return kind if target == "temperature_1" and 1.0 <= time_s < 2.0 else None

    stand = device(tmp_path)
    tree = W1Tree(tmp_path / "devices", stand.thermometers, Schedule())  # type: ignore[arg-type]
    tree.update(0.5)
    assert isinstance(read_sensor(tree.root, ROM), TemperatureReading)
    tree.update(1.5)
    found = read_sensor(tree.root, ROM)
    assert found is SHOWN_AS[kind]
    assert isinstance(found, ReadingFault)
    assert "look" in FAULT_TEXTS[found]
    tree.update(2.5)
    assert isinstance(read_sensor(tree.root, ROM), TemperatureReading)
    tree.close()


def test_a_frozen_sensor_shows_what_it_showed(tmp_path: Path) -> None:
    class Schedule:
        def at(self, target: str, time_s: float) -> str | None:
            return "frozen" if target and time_s >= 1.0 else None

    stand = device(tmp_path)
    tree = W1Tree(tmp_path / "devices", stand.thermometers, Schedule())  # type: ignore[arg-type]
    before = (tree.root / ROM / "w1_slave").read_text(encoding="ascii")
    stand.spring.temperature = 30.5  # type: ignore[attr-defined]
    stand.advance_to(5.0)
    tree.update(5.0)
    assert (tree.root / ROM / "w1_slave").read_text(encoding="ascii") == before
    tree.close()


def test_the_tree_converts_all_at_once_when_it_is_told(tmp_path: Path) -> None:
    stand = device(tmp_path)
    tree = W1Tree(tmp_path / "devices", stand.thermometers, stand.faults)
    now = [0.0]

    def sleep(duration_s: float) -> None:
        now[0] += duration_s
        stand.advance_to(now[0])
        tree.update(now[0])

    reader = FolderReader(tree.root, "bulk", wall_s=lambda: now[0], sleep=sleep)
    ((_, got),) = reader.read((ROM,))
    assert isinstance(got, TemperatureReading)
    assert reader.notes() == []
    assert 0.7 <= now[0] <= 0.9
    tree.close()
    assert not tree.root.exists()
