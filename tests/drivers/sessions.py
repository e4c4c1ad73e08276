"""What the drivers do in the sessions that are kept as transcripts: the same calls in the same order."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.controllers.register_controller import RegisterController
from bufferstand.drivers.instruments.wire_address import SerialAddress
from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.coding import decode_value
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.drivers.thermometers.ds18b20 import TemperatureReading
from bufferstand.drivers.thermometers.ds2480b.thermometer import Ds2480bReader
from bufferstand.foundation.clock import WallClock
from tests.drivers.conftest import SAMPLE_STAND

W1 = 'kind = "w1"\nroot = "wires/w1/devices"\n'
GSV2 = 'protocol = "gsv2"\nport = "wires/amplifier"\nbaud = 38400\nrate_Hz = 250.0\n'
LINES = """protocol = "ascii-line"
port = "wires/amplifier"
baud = 38400
rate_Hz = 50.0
line = { description = "tecsis-eze30-sends", answers = { address = 1, decimals = 2 } }
"""
CHANGES: dict[str, tuple[tuple[str, str], ...]] = {
    "ring": (),
    "polling": (('profile = "ring"', 'profile = "polling"'),),
    "gsv2": (),
    "aed": ((GSV2, GSV2.replace("gsv2", "aed").replace("250.0", "100.0") + "aed = { output = 9 }\n"),),
    "ascii-line": ((GSV2, LINES), ("7.885695443832332e-05", "0.01")),
    "ds2480b": ((W1, 'kind = "ds2480b"\nport = "wires/onewire"\n'),),
}
WIRES = {
    "ring": "controller",
    "polling": "controller",
    "gsv2": "amplifier",
    "aed": "amplifier",
    "ascii-line": "amplifier",
    "ds2480b": "onewire",
}
VALUES = 40


def write_stand(folder: Path, name: str) -> Path:
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace("models/", f"{SAMPLE_STAND.parent}/models/", 1)
    for old, new in CHANGES[name]:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def ring(file: StandFile) -> dict[str, Any]:
    controller = build_controller(file, WallClock())
    try:
        identity = controller.connect()
        status = controller.status()
        blocks = [block for block in (controller.read_block() for _ in range(12)) if block is not None]
        return {
            "serial": identity.serial,
            "rate_Hz": identity.sample_rate_Hz,
            "state": status.state.name,
            "first": blocks[0].first_sequence,
            "samples": sum(len(block.time_us) for block in blocks),
            "lost": sum(block.lost for block in blocks),
            "span_us": int(blocks[-1].time_us[-1] - blocks[0].time_us[0]),
            "force": [int(count) for count in blocks[0].counts["force"]],
            "events": list(controller.events()),
        }
    finally:
        controller.close()


def polling(file: StandFile) -> dict[str, Any]:
    """Identity, status and momentary values, one after the other."""
    profile, settings = file.profile(), file.controller
    link = ModbusLink(TcpWire(settings.host, settings.port), device_id=settings.device_id)
    try:
        controller = RegisterController(link, profile)
        identity = controller.identify()
        status = controller.status()
        values: dict[str, Any] = {"serial": identity.serial, "state": status.state.name}
        for name in ("raw_force", "raw_stroke_1", "raw_stroke_2", "raw_position", "raw_command"):
            register = profile.find(name)
            words = link.read(register.address, register.words, name, table=register.table)
            values[name] = decode_value(words, register.type, profile.word_order)
        return values
    finally:
        controller.close()


def amplifier(file: StandFile) -> dict[str, Any]:
    sensor = build_sensors(file, WallClock())[0]
    counts: list[int] = []
    said: list[str] = []

    def enough() -> bool:
        for item in sensor.drain():
            if isinstance(item, SampleBlock):
                counts.extend(int(count) for count in item.counts["force_2"])
            else:
                assert isinstance(item, SensorFault)
                said.append(item.what)
        return len(counts) >= VALUES

    try:
        sensor.start()
        until(enough)
    finally:
        sensor.close()
    return {"counts": counts[:VALUES], "said": said}


def ds2480b(file: StandFile) -> dict[str, Any]:
    (adapter,) = file.thermometers
    wire = adapter.wire()
    assert isinstance(wire, SerialAddress)
    reader = Ds2480bReader(wire.path, WallClock(), sleep=lambda _: time.sleep(0.3))
    try:
        roms = reader.roms()
        readings = dict(reader.read(tuple(sensor.address for sensor in adapter.sensors)))
        return {
            "roms": list(roms),
            "counts": {
                rom: got.count if isinstance(got, TemperatureReading) else got.value
                for rom, got in readings.items()
            },
        }
    finally:
        reader.close()


SESSIONS: dict[str, Callable[[StandFile], dict[str, Any]]] = {
    "ring": ring,
    "polling": polling,
    "gsv2": amplifier,
    "aed": amplifier,
    "ascii-line": amplifier,
    "ds2480b": ds2480b,
}


def until(done: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 60.0
    while not done():
        assert time.monotonic() < end_s
        time.sleep(0.005)


def load(folder: Path, name: str) -> StandFile:
    return load_stand(write_stand(folder, name))
