"""Amplifiers by register map: values, status bits, rate, and what the engineer hears."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.amplifiers.modbus.amplifier import ModbusAmplifier
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.amplifier_map import SHIPPED_MAPS, AmplifierMap, load_amplifier_map
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.transcripts.recorder import record_wires
from bufferstand.drivers.transcripts.transcript import read_transcript
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.drivers.amplifiers import Collector, RegisterAmplifier, amplifier_settings, until

MAP = load_amplifier_map("dms-float", Path())
TABLE = (
    'protocol = "modbus"\nrate_Hz = {rate}\nrange_kN = 630.0\n'
    'modbus = {{ map = "dms-float", host = "127.0.0.1", tcp_port = {port} }}\n'
)


def stand_settings(folder: Path, port: int, rate: float = 100.0, extra: str = "") -> Any:
    return amplifier_settings(folder, TABLE.format(port=port, rate=rate), extra=extra)


@pytest.fixture
def server() -> Iterator[RegisterAmplifier]:
    one = RegisterAmplifier(MAP, 1000.0)
    yield one
    one.close()


def opened(
    folder: Path,
    server: RegisterAmplifier,
    registers: AmplifierMap = MAP,
    rate: float = 100.0,
    extra: str = "",
) -> ModbusAmplifier:
    link = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=0.1, name="amplifier")
    return ModbusAmplifier(link, registers, stand_settings(folder, server.port, rate, extra), WallClock())


@contextmanager
def measuring(folder: Path, server: RegisterAmplifier) -> Iterator[Collector]:
    """What an amplifier delivers, from its first value on."""
    amplifier = opened(folder, server)
    got = Collector(amplifier)
    try:
        amplifier.start()
        until(lambda: len(got.take().blocks) == 1)
        yield got
    finally:
        amplifier.close()


@contextmanager
def after_a_silence(folder: Path, server: RegisterAmplifier) -> Iterator[Collector]:
    """The same, when it answers again after a silence that was told."""
    with measuring(folder, server) as got:
        server.silent = True
        until(lambda: any("no reply within 0.1 s, twice" in text for text in got.take().said))
        server.silent = False
        yield got


def test_values_come_in_order_with_stamps_and_each_measurement_once(
    tmp_path: Path, server: RegisterAmplifier
) -> None:
    with measuring(tmp_path, server) as got:
        for value in (1.5, -2.25, 1e6):
            server.measure(value)
            until(lambda value=value: float(got.take().blocks[-1].counts["force_2"][0]) == value)  # type: ignore[misc]
        values = [float(block.counts["force_2"][0]) for block in got.blocks]
        assert values == [0.0, 1.5, -2.25, 1e6]
        assert got.blocks[0].counts["force_2"].dtype == np.float32
        stamps = [int(block.time_us[0]) for block in got.blocks]
        assert stamps == sorted(set(stamps))
        sequence = [block.first_sequence for block in got.blocks]
        assert all(
            b - a == 1 + block.lost
            for a, b, block in zip(sequence, sequence[1:], got.blocks[1:], strict=False)
        )
        assert got.said == []


@pytest.mark.parametrize(
    ("bit", "message"),
    [
        (0, "its input is overloaded; look at load, transducer cable and range"),
        (1, "its converter is saturated; look at its range"),
        (2, "the bridge is broken; look at transducer cable and plug"),
    ],
)
def test_status_bits_speak_in_the_maps_words(
    tmp_path: Path, server: RegisterAmplifier, bit: int, message: str
) -> None:
    amplifier = opened(tmp_path, server)
    got = Collector(amplifier)
    try:
        server.measure(1.0, 1 << bit)
        amplifier.start()
        until(lambda: bool(got.take().said))
        assert got.said[0] == f"amplifier at 127.0.0.1:{server.port} unit 1: {message}"
        server.measure(1.0)
        server.measure(2.0, 1 << bit)
        until(lambda: len(got.take().blocks) >= 2)
    finally:
        amplifier.close()


def test_a_value_that_is_no_number_is_not_recorded(tmp_path: Path, server: RegisterAmplifier) -> None:
    amplifier = opened(tmp_path, server)
    got = Collector(amplifier)
    try:
        server.measure(float("nan"))
        amplifier.start()
        until(lambda: bool(got.take().said))
        assert got.said[0].endswith("its value is nan; look at its transducer and settings")
        assert got.blocks == []
    finally:
        amplifier.close()


def test_a_counter_that_stands_still_is_told_from_a_steady_force(
    tmp_path: Path, server: RegisterAmplifier
) -> None:
    amplifier = opened(tmp_path, server)
    got = Collector(amplifier)
    try:
        server.stick()
        amplifier.start()
        until(lambda: bool(got.take().said))
        assert "it answers, but its counter stands at 1 for 2." in got.said[0]
        assert "it measures no more; look at the amplifier itself" in got.said[0]
        assert len(got.blocks) == 1
    finally:
        amplifier.close()


def test_silence_is_told_and_ends(tmp_path: Path, server: RegisterAmplifier) -> None:
    with after_a_silence(tmp_path, server) as got:
        server.measure(7.0)
        until(lambda: len(got.take().blocks) == 2)
        assert got.blocks[-1].lost > 0


def test_what_a_silence_cost_is_told_though_the_first_answer_is_old(
    tmp_path: Path, server: RegisterAmplifier
) -> None:
    with after_a_silence(tmp_path, server) as got:
        before = server.requests
        until(lambda: server.requests > before + 5)  # answers with what it had measured before
        server.measure(7.0)
        until(lambda: len(got.take().blocks) == 2)
        assert got.blocks[-1].lost > 0
        assert got.blocks[-1].first_sequence == got.blocks[0].first_sequence + 1 + got.blocks[-1].lost


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"word_order": "little"}, "the words are swapped; set word_order = “big” in the map"),
        (
            {"identity": {"address": 4, "type": "u32", "expect": 1}, "rate": None},
            r"register 4 does not identify it: it holds 0x447A0000; look at device id, address",
        ),
        ({"table": "holding"}, "refused with Modbus exception 1"),
        ({"identity": {"address": 99, "type": "u16", "expect": 1}}, "refused with Modbus exception 2"),
    ],
)
def test_a_map_that_does_not_fit_is_named(
    tmp_path: Path, server: RegisterAmplifier, change: dict[str, object], message: str
) -> None:
    other = AmplifierMap.model_validate({**MAP.model_dump(), **change})
    amplifier = opened(tmp_path, server, other)
    with pytest.raises(DeviceFault, match=message):
        amplifier.start()
    amplifier.close()


def test_a_slow_amplifier_is_not_asked_faster_than_it_measures(
    tmp_path: Path, server: RegisterAmplifier
) -> None:
    assert MAP.rate is not None
    server.put(MAP.rate, 50.0)
    amplifier = opened(tmp_path, server)
    with pytest.raises(
        DeviceFault,
        match="it makes 50 measurements a second, the stand file asks for 100; values would come twice",
    ):
        amplifier.start()
    amplifier.close()


def test_nobody_there(tmp_path: Path, server: RegisterAmplifier) -> None:
    server.close()
    amplifier = opened(tmp_path, server)
    with pytest.raises(DeviceFault, match=r"amplifier at 127\.0\.0\.1:.* cannot connect"):
        amplifier.start()
    amplifier.close()


def test_overload_by_the_channels_own_limit(tmp_path: Path, server: RegisterAmplifier) -> None:
    amplifier = opened(tmp_path, server, extra="plausible = { overload = 600.0 }")
    got = Collector(amplifier)
    try:
        server.measure(8e6)
        amplifier.start()
        until(lambda: bool(got.take().said))
        assert "force_2 is overloaded: 630.9 kN, the transducer bears 600" in got.said[0]
    finally:
        amplifier.close()


@pytest.mark.parametrize("path", sorted(SHIPPED_MAPS.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_map_loads(path: Path) -> None:
    assert load_amplifier_map(path.stem, Path()).id == path.stem


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("address = 2", "address = 1", "status and value overlap at address 1"),
        ('0 = "its input', 'x = "its input', "“x” is no number of a bit"),
        ("address = 3", "address = 300", "one read carries 125"),
        ('id = "dms-float"', 'id = "dms-float"\nspeed = 3', "unknown key “speed”"),
    ],
)
def test_what_cannot_be_a_map_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = (SHIPPED_MAPS / "dms-float.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "mine.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BadInput, match=message):
        load_amplifier_map("mine.toml", tmp_path)


def test_a_missing_map_lists_those_there_are(tmp_path: Path, server: RegisterAmplifier) -> None:
    table = TABLE.format(port=server.port, rate=100.0)
    with pytest.raises(
        BadInput, match=r"amplifier.modbus.map: there is no register map “dms-flat” .*; shipped: dms-float"
    ):
        amplifier_settings(tmp_path, table.replace("dms-float", "dms-flat"))


def test_the_stand_file_leads_to_it(tmp_path: Path, server: RegisterAmplifier) -> None:
    stand_settings(tmp_path, server.port)
    amplifier = build_sensors(load_stand(tmp_path / "stand.toml"), WallClock())[0]
    assert isinstance(amplifier, ModbusAmplifier)
    amplifier.start()
    amplifier.close()


def test_its_wire_is_recorded_byte_by_byte(tmp_path: Path, server: RegisterAmplifier) -> None:
    stand_settings(tmp_path, server.port)
    record = tmp_path / "session.txt"
    with record_wires(load_stand(tmp_path / "stand.toml"), record) as tapped:
        amplifier = build_sensors(tapped, WallClock())[0]
        amplifier.start()
        got = Collector(amplifier)
        until(lambda: bool(got.take().blocks))
        amplifier.close()
    assert "# amplifier: modbus, TCP" in record.read_text(encoding="utf-8")
    pieces = [piece for piece in read_transcript(record) if piece.wire == "amplifier"]
    asked = b"".join(piece.data for piece in pieces if piece.sign == ">")
    answered = b"".join(piece.data for piece in pieces if piece.sign == "<")
    assert asked[7:12] == bytes((4, 0, 6, 0, 2))  # FC4: the two registers of its identity
    assert answered[7:13] == bytes((4, 4, 0x44, 0x4D, 0x53, 0x31))
