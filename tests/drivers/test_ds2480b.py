"""DS2480B: byte transcripts, searches, and each fault of a bus behind a real serial line."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.serial_line.line import SerialLine
from bufferstand.drivers.simulated.wires.serial_pty import AnsweringPty
from bufferstand.drivers.thermometers.ds18b20 import (
    FAULT_TEXTS,
    ReadingFault,
    TemperatureReading,
    crc8,
    decode_scratchpad,
)
from bufferstand.drivers.thermometers.ds18b20_settings import OneWireSettings
from bufferstand.drivers.thermometers.ds2480b.adapter import Ds2480b, Presence, rom_bytes, rom_name
from bufferstand.drivers.thermometers.ds2480b.simulated import Ds2480bDevice
from bufferstand.drivers.thermometers.ds2480b.simulated_bus import OneWireBus, OneWireSensor
from bufferstand.drivers.thermometers.ds2480b.thermometer import Ds2480bBus, Ds2480bReader
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.amplifiers import Collector, until
from tests.drivers.pump import Pump

ROMS = (
    "28-00000a3f91c2",
    "28-00000a3f92d7",
    "28-00e3e3a40117",
)  # the last has 0xE3 in it, which must be doubled

# Recorded from a DS2480B with one DS18B20, flexible speed; published with a driver (“DS2480B UART to 1Wire
# bus master”, sequence 1, steps 4–11). Each line: sent, came back.
RECORDED_SEARCH = (
    ("C5", "CD"),
    ("E1 F0", "F0"),
    ("E3 B1", ""),
    ("E1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00", "80 08 AA AA A0 AA 00 A2 00 00 2A 02 0A 00 A8 88"),
    ("E3 A1", ""),
)
RECORDED_POWER = (("C5", "CD"), ("E1 CC B4", "CC B4"), ("E3 95", "97"))
RECORDED_SCRATCHPAD = (
    ("C5", "CD"),
    (
        "E1 55 28 FF FC D0 00 17 03 AE BE",
        "55 28 FF FC D0 00 17 03 AE BE",
    ),
    ("FF FF FF FF FF FF FF FF FF", "9C 01 4B 46 7F FF 0C 10 0C"),
)
# Configuration by the Dallas public domain kit (docs/facts/devices.md): each byte comes back with bit 0
# cleared, the baud rate reads 0 (9600), and a single bit is answered with its state twice.
BEGIN = (("E3", ""), ("C1", ""), ("17 45 5B 0F 91", "16 44 5A 00 93"))
# Strong pull-up: 1.05 s, armed (which pulses at once, ended by F1), byte, disarmed. From memory of AN192.
STRONG_PULL_UP = (
    ("C5", "CD"),
    ("E1 CC", "CC"),
    ("E3 3B", "3A"),
    ("EF F1", "EC"),
    ("E1 44", "44"),
    ("E3 ED F1", "EC"),
)

Transcript = tuple[tuple[str, str], ...]


class Tape:
    """A port that plays a recording: it refuses every byte that was not sent then."""

    def __init__(self, *parts: Transcript) -> None:
        self._lines = [(bytes.fromhex(a), bytes.fromhex(b)) for part in parts for a, b in part]
        self._answer = b""
        self.at = 0

    @property
    def in_waiting(self) -> int:
        return len(self._answer)

    def write(self, data: bytes, /) -> int:
        sent, answer = self._lines[self.at]
        assert data == sent, f"line {self.at}: sent {data.hex(' ')}, recorded {sent.hex(' ')}"
        self.at += 1
        self._answer += answer
        return len(data)

    def read(self, size: int = 1, /) -> bytes:
        piece, self._answer = self._answer[:size], self._answer[size:]
        return piece

    def close(self) -> None:
        pass

    @property
    def played(self) -> bool:
        return self.at == len(self._lines) and not self._answer


def on_tape(*parts: Transcript) -> tuple[Ds2480b, Tape]:
    tape = Tape(*parts)
    return Ds2480b(SerialLine(tape, WallClock(), "adapter"), lambda: None), tape


def test_the_recorded_search_finds_the_recorded_rom() -> None:
    adapter, tape = on_tape(RECORDED_SEARCH)
    (rom,) = adapter.search()
    assert rom == bytes.fromhex("28 FF FC D0 00 17 03 AE")
    assert rom_name(rom) == "28-031700d0fcff"
    assert rom_bytes("28-031700d0fcff") == rom
    assert tape.played


def test_the_recorded_scratchpad_is_a_temperature() -> None:
    adapter, tape = on_tape(RECORDED_SCRATCHPAD)
    assert adapter.reset() is Presence.PRESENT
    adapter.write(bytes.fromhex("55 28 FF FC D0 00 17 03 AE BE"))
    assert decode_scratchpad(adapter.read(9)) == TemperatureReading(0x019C, 12)  # 25.75 °C
    assert tape.played


def test_the_recorded_power_supply_is_external() -> None:
    adapter, tape = on_tape(RECORDED_POWER)
    adapter.reset()
    adapter.write(b"\xcc\xb4")
    assert adapter.bit() == 1
    assert tape.played


def test_the_beginning_is_that_of_the_kit() -> None:
    adapter, tape = on_tape(BEGIN)
    adapter.begin()
    assert tape.played


def test_the_strong_pull_up_is_armed_and_disarmed() -> None:
    adapter, tape = on_tape(STRONG_PULL_UP)
    adapter.reset()
    adapter.write(b"\xcc")
    adapter.power_while(0x44)
    adapter.end_power()
    assert tape.played


def sensor(rom: str, count: int = 336, **more: bool | float) -> OneWireSensor:
    return OneWireSensor(rom_bytes(rom), lambda: count, time.monotonic, conversion_s=0.02, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "transcript",
    [BEGIN[1:] + RECORDED_SEARCH, BEGIN[1:] + RECORDED_POWER, BEGIN[1:] + STRONG_PULL_UP],
    ids=["search", "power", "pull-up"],
)
def test_the_simulated_adapter_answers_like_the_real_one(transcript: Transcript) -> None:
    device = Ds2480bDevice(OneWireBus([sensor("28-031700d0fcff")]))
    for sent, answer in transcript:
        assert device.obey(bytes.fromhex(sent)) == bytes.fromhex(answer), sent


class Straight:
    """A port that ends in a simulated adapter, without a wire."""

    def __init__(self, device: Ds2480bDevice) -> None:
        self._device = device
        self._answer = b""

    @property
    def in_waiting(self) -> int:
        return len(self._answer)

    def write(self, data: bytes, /) -> int:
        self._answer += self._device.obey(data)
        return len(data)

    def read(self, size: int = 1, /) -> bytes:
        piece, self._answer = self._answer[:size], self._answer[size:]
        return piece

    def close(self) -> None:
        pass


def straight(*sensors: OneWireSensor) -> tuple[Ds2480b, OneWireBus]:
    bus = OneWireBus(sensors)
    adapter = Ds2480b(SerialLine(Straight(Ds2480bDevice(bus)), WallClock(), "adapter"), lambda: None)
    adapter.begin()
    return adapter, bus


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(0, 2**48 - 1), min_size=1, max_size=9), st.booleans())
def test_a_search_finds_every_sensor_once(numbers: set[int], accelerated: bool) -> None:
    names = {f"28-{number:012x}" for number in numbers}
    adapter, _ = straight(*(sensor(name) for name in names))
    found = [rom_name(rom) for rom in adapter.search(accelerated=accelerated)]
    assert sorted(found) == sorted(names)


def test_a_search_on_an_empty_or_shorted_bus_finds_nobody() -> None:
    adapter, bus = straight()
    assert adapter.search() == []
    assert adapter.reset() is Presence.NOBODY
    bus.shorted = True
    assert adapter.reset() is Presence.SHORTED
    assert adapter.search(accelerated=False) == []


@given(st.integers(0, 2**48 - 1))
def test_names_and_bytes_of_roms(number: int) -> None:
    name = f"28-{number:012x}"
    rom = rom_bytes(name)
    assert rom_name(rom) == name
    assert crc8(rom) == 0


def temperature_settings(**more: object) -> OneWireSettings:
    sensors = [
        {"rom": rom, "name": f"temperature_{i}", "place": f"plate {i}"} for i, rom in enumerate(ROMS, 1)
    ]
    return OneWireSettings.model_validate(
        {"kind": "ds2480b", "port": "adapter", "period_s": 0.05, "sensor": sensors, **more}
    )


class Wired:
    """Three simulated sensors behind a simulated adapter on a pty."""

    def __init__(self, folder: Path) -> None:
        self.sensors = [sensor(rom, 336 + 16 * i) for i, rom in enumerate(ROMS)]
        self.bus = OneWireBus(self.sensors)
        self.device = Ds2480bDevice(self.bus)
        self.path = folder / "adapter"
        self._pty = AnsweringPty(self.path, self.device)
        self._pump = Pump(self._pty.pump, 0.0005)

    def close(self) -> None:
        self._pump.close()
        self._pty.close()


@pytest.fixture
def wired(tmp_path: Path) -> Iterator[Wired]:
    one = Wired(tmp_path)
    yield one
    one.close()


@pytest.fixture
def reader(wired: Wired) -> Iterator[Ds2480bReader]:
    one = Ds2480bReader(wired.path, WallClock())
    yield one
    one.close()


def test_every_sensor_is_read_by_its_rom(reader: Ds2480bReader) -> None:
    assert dict(reader.read(ROMS)) == {
        rom: TemperatureReading(336 + 16 * i, 12) for i, rom in enumerate(ROMS)
    }
    assert reader.roms() == tuple(sorted(ROMS))
    assert reader.notes() == []


@pytest.mark.parametrize(
    ("state", "fault"),
    [
        ("absent", ReadingFault.ABSENT),
        ("power-on", ReadingFault.POWER_ON),
        ("no-power", ReadingFault.NO_POWER),
        ("all-zero", ReadingFault.ALL_ZERO),
        ("crc", ReadingFault.CRC_MISMATCH),
    ],
)
def test_one_bad_sensor_is_named_and_the_others_are_read(
    wired: Wired, reader: Ds2480bReader, state: str, fault: ReadingFault
) -> None:
    wired.sensors[1].state = state  # type: ignore[assignment]
    assert dict(reader.read(ROMS)) == {
        ROMS[0]: TemperatureReading(336, 12),
        ROMS[1]: fault,
        ROMS[2]: TemperatureReading(368, 12),
    }


def test_a_bus_that_fails_as_a_whole_is_told_for_each_sensor(wired: Wired, reader: Ds2480bReader) -> None:
    wired.bus.shorted = True
    assert set(dict(reader.read(ROMS)).values()) == {ReadingFault.SHORTED}
    wired.bus.shorted = False
    for one in wired.sensors:
        one.state = "absent"
    assert set(dict(reader.read(ROMS)).values()) == {ReadingFault.ABSENT}
    for one in wired.sensors:
        one.state = "ok"
    wired.sensors[2].external_power = False
    assert set(dict(reader.read(ROMS)).values()) == {ReadingFault.UNPOWERED}
    wired.sensors[2].external_power = True
    wired.sensors[0].state = "hangs"
    assert set(dict(reader.read(ROMS)).values()) == {ReadingFault.UNFINISHED}


def test_sensors_without_a_supply_wire_convert_under_the_strong_pull_up(wired: Wired) -> None:
    for one in wired.sensors:
        one.external_power = False
    reader = Ds2480bReader(wired.path, WallClock(), parasite=True, sleep=lambda _: None)
    try:
        assert set(dict(reader.read(ROMS)).values()) == {
            TemperatureReading(336 + 16 * i, 12) for i in range(3)
        }
    finally:
        reader.close()


def test_a_stranger_on_the_bus_is_named(wired: Wired) -> None:
    reader = Ds2480bReader(wired.path, WallClock())
    try:
        list(reader.read(ROMS[:2]))
        (note,) = reader.notes()
        assert note == (
            f"also on the bus, and not in the stand file: {ROMS[2]}; a sensor that was exchanged?"
        )
    finally:
        reader.close()


def test_something_else_on_the_port_is_named(wired: Wired, reader: Ds2480bReader) -> None:
    wired.device.mute = True
    with pytest.raises(DeviceFault, match="no answer like that of a DS2480B adapter; look at adapter, cable"):
        reader.check()


@pytest.mark.slow
def test_an_echo_on_the_port_is_no_adapter(tmp_path: Path) -> None:
    class Echo(Ds2480bDevice):
        def obey(self, data: bytes) -> bytes:
            return data

    wire = Straight(Echo(OneWireBus([])))
    adapter = Ds2480b(SerialLine(wire, WallClock(), "adapter"), lambda: None)
    with pytest.raises(DeviceFault, match="it answers 17 45 5b 0f 91 to 17 45 5b 0f 91: this is no DS2480B"):
        adapter.begin()


@pytest.mark.slow
def test_no_port(tmp_path: Path) -> None:
    with pytest.raises(DeviceFault, match=r"nothing: cannot be opened .*; look whether the device is there"):
        Ds2480bReader(tmp_path / "nothing", WallClock()).check()


@pytest.mark.slow
def test_an_adapter_that_is_unplugged_and_plugged_in_again(wired: Wired) -> None:
    bus = Ds2480bBus(wired.path, temperature_settings(), WallClock())
    sensor_1 = bus.sensors[0]
    got = Collector(sensor_1)
    sensor_1.start()
    try:
        until(lambda: len(got.take().blocks) >= 2)
        wired.device.mute = True
        until(lambda: bool(got.take().said))
        assert got.said[0].startswith(f"temperature_1 (plate 1, {ROMS[0]}): 1-Wire adapter at ")
        assert "look at adapter, cable, and whether temperature.port is the right device" in got.said[0]
        wired.device.mute = False
        before = len(got.blocks)
        until(lambda: len(got.take().blocks) >= before + 2)
    finally:
        sensor_1.close()


@pytest.mark.slow
def test_each_sensor_is_its_own_stream_with_name_and_place(wired: Wired) -> None:
    wired.sensors[1].state = "power-on"
    bus = Ds2480bBus(wired.path, temperature_settings(), WallClock())
    collectors = [Collector(one) for one in bus.sensors]
    for one in bus.sensors:
        one.start()
    try:
        until(lambda: all(c.take().blocks or c.said for c in collectors))
        first = collectors[0].blocks[0]
        assert isinstance(first, SampleBlock)
        assert first.counts["temperature_1"].tolist() == [336]
        assert collectors[1].said[0] == (
            f"temperature_2 (plate 2, {ROMS[1]}): {FAULT_TEXTS[ReadingFault.POWER_ON]}"
        )
        assert bus.sensors[2].facts.device == f"DS18B20 (clone) {ROMS[2]}"
    finally:
        for one in bus.sensors:
            one.close()
