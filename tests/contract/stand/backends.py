"""Whole stands that one contract runs over: in process, on loopback wires of every kind, or a real one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import Controller, Sensor
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import Clock, WallClock
from tests.clean_stand import clean_stand_text

SAMPLES = Path(__file__).parents[3] / "sample_runs"
TCP = 'host = "127.0.0.1"\nport = 15020'
RTU = 'serial = "wires/controller"\nbaud = 115200'
GSV2 = 'protocol = "gsv2"\nport = "wires/amplifier"\nbaud = 38400\nrate_Hz = 250.0\n'
AED = 'protocol = "aed"\nport = "wires/amplifier"\nbaud = 38400\nrate_Hz = 100.0\naed = { output = 8 }\n'
REGISTERS = 'protocol = "modbus"\nrate_Hz = 100.0\nmodbus = { map = "dms-float", '
MODBUS_TCP = REGISTERS + 'host = "127.0.0.1" }\n'
MODBUS_RTU = REGISTERS + 'parity = "none" }\nport = "wires/amplifier"\nbaud = 115200\n'
W1 = 'kind = "w1"\nroot = "wires/w1/devices"\n'
ADAPTER = 'kind = "ds2480b"\nport = "wires/onewire"\n'
POLLING = ('profile = "ring"', 'profile = "polling"')

STANDS: dict[str, tuple[tuple[str, str], ...]] = {
    "TCP, GSV-2, 1-Wire folder": (),
    "RTU, AED, DS2480B": ((TCP, RTU), (GSV2, AED), (W1, ADAPTER)),
    "polled over TCP, Modbus TCP amplifier, bulk": (
        POLLING,
        (GSV2, MODBUS_TCP),
        (W1, W1 + 'access = "bulk"\n'),
    ),
    "polled over RTU, Modbus RTU amplifier, 1-Wire folder": (POLLING, (TCP, RTU), (GSV2, MODBUS_RTU)),
}
"""What each changes of the shipped stand file."""
BACKENDS = ("in process", *STANDS, "hardware")


@dataclass
class Bench:
    """A stand under test: nothing is connected or started yet."""

    name: str
    file: StandFile
    clock: Clock
    controller: Controller
    sensors: tuple[Sensor, ...]

    def close(self) -> None:
        """Let go of every wire."""
        for sensor in self.sensors:
            sensor.close()
        self.controller.close()


def write_stand(folder: Path, changes: tuple[tuple[str, str], ...]) -> Path:
    """Write the shipped stand file with changes."""
    text = clean_stand_text()
    for old, new in (('model = "', f'model = "{SAMPLES}/'), *changes):
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def bench_on(name: str, file: StandFile) -> Bench:
    """Return the drivers of a stand file, by the wall."""
    clock = WallClock()
    return Bench(name, file, clock, build_controller(file, clock), build_sensors(file, clock))


@contextmanager
def served(name: str, folder: Path) -> Iterator[StandFile]:
    """Serve a stand in another process; give the file by which it is reached."""
    path = write_stand(folder, STANDS[name])
    with start_process(path, directory=folder / "run") as process:
        yield with_endpoints(load_stand(path), process.served.endpoints())


def in_process(folder: Path) -> Bench:
    """Return the physics in virtual time."""
    file = load_stand(write_stand(folder, ()))
    made = open_in_process(file)
    return Bench("in process", file, made.clock, made.stand.controller, made.stand.sensors)
