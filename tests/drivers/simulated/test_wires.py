"""Serial line and 1-Wire folder: bytes as the real devices send them."""

from __future__ import annotations

import fcntl
import os
import select
import struct
import termios
import time
import tty
from collections import deque
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.gsv2.frames import FrameDecoder
from bufferstand.drivers.amplifiers.gsv2.simulated import Gsv2Device, encode_frames
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault, parse_fault
from bufferstand.drivers.simulated.machine.instruments import InstrumentValues
from bufferstand.drivers.simulated.wires.serial_pty import BUFFER, InstrumentPty
from bufferstand.drivers.thermometers.ds18b20 import ReadingFault, TemperatureReading, crc8, decode_w1_slave
from bufferstand.drivers.thermometers.simulated_scratchpad import millidegrees, scratchpad, slave_text
from bufferstand.drivers.thermometers.w1.simulated import W1Tree
from bufferstand.foundation.errors import BadInput
from tests.drivers.simulated.standing import device

# --- GSV-2 --------------------------------------------------------------------------------------------


def test_frames_are_those_of_the_manual() -> None:
    assert encode_frames(np.array([0])) == bytes.fromhex("2c 00 80 00 00")
    assert encode_frames(np.array([0x7FFFFF])) == bytes.fromhex("2c 00 ff ff ff")
    assert encode_frames(np.array([-1])) == bytes.fromhex("2c 00 7f ff ff")
    assert encode_frames(np.array([10**9, -(10**9)])) == bytes.fromhex("2c00ffffff 2c00000001")


@given(counts=st.lists(st.integers(-0x7FFFFF, 0x7FFFFF), min_size=5, max_size=50))
def test_frames_decode_to_what_was_sent(counts: list[int]) -> None:
    decoder = FrameDecoder(aligned=True)
    found = decoder.feed(encode_frames(np.array(counts)) + b"\x2c\x00")
    assert [frame.count for frame in found] == counts
    assert decoder.resyncs == 0


@pytest.fixture
def amplifier(tmp_path: Path) -> Iterator[InstrumentPty]:
    made = InstrumentPty(tmp_path / "wires" / "amplifier", deque(), Gsv2Device(250.0))
    yield made
    made.close()


@pytest.fixture
def reader(amplifier: InstrumentPty) -> Iterator[int]:
    descriptor = os.open(amplifier.link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    tty.setraw(descriptor)
    yield descriptor
    os.close(descriptor)


def send(amplifier: InstrumentPty, *counts: int) -> None:
    amplifier._frames.append(InstrumentValues(np.zeros(len(counts)), np.array(counts, dtype=np.int64)))
    amplifier.pump()


def read(descriptor: int, wanted: int = 0) -> bytes:
    """Read what is there; wait for ``wanted`` bytes, because the kernel carries them over in its own time."""
    data = b""
    deadline_s = time.monotonic() + 60.0
    while True:
        try:
            while piece := os.read(descriptor, 8192):
                data += piece
        except BlockingIOError:
            pass
        if len(data) >= wanted or time.monotonic() > deadline_s:
            return data
        time.sleep(0.001)


def command(amplifier: InstrumentPty, reader: int, byte: bytes) -> None:
    os.write(reader, byte)
    assert select.select([amplifier._master], [], [], 10.0)[0]


def test_it_streams_unasked_and_obeys_its_commands(amplifier: InstrumentPty, reader: int) -> None:
    send(amplifier, 1, 2)
    expected = encode_frames(np.array([1, 2]))
    assert read(reader, len(expected)) == expected
    command(amplifier, reader, b"\x23")
    send(amplifier, 3)
    assert read(reader) == b""
    command(amplifier, reader, b"\x16")
    amplifier.pump()
    assert 5e6 / ((1 << 24) - int.from_bytes(read(reader, 3), "big")) == pytest.approx(250.0)
    command(amplifier, reader, b"\x24")
    send(amplifier, 40)
    expected = encode_frames(np.array([40]))
    assert read(reader, len(expected)) == expected
    command(amplifier, reader, b"\x0c")
    send(amplifier, 41, 42)
    expected = encode_frames(np.array([1, 2]))
    assert read(reader, len(expected)) == expected


def bytes_waiting(reader: int) -> int:
    return int(struct.unpack("i", fcntl.ioctl(reader, termios.FIONREAD, b"\0\0\0\0"))[0])


def test_a_reader_that_comes_too_late_finds_whole_frames_and_the_loss_is_counted(
    amplifier: InstrumentPty, reader: int
) -> None:
    waiting = 0
    for start in range(0, 3000, 100):
        before = amplifier.overruns
        send(amplifier, *range(start, start + 100))
        waiting = 500 if amplifier.overruns > before else waiting + 500
        deadline_s = time.monotonic() + 60.0
        # the kernel carries bytes from one end of a pty to the other in its own time
        while bytes_waiting(reader) != waiting and time.monotonic() < deadline_s:
            time.sleep(0.001)
    data = read(reader, waiting)
    assert amplifier.overruns > 0
    assert len(data) <= BUFFER
    frames = FrameDecoder(aligned=True).feed(data + b"\x2c\x00")
    assert [frame.count for frame in frames] == list(range(3000 - len(frames), 3000))


def test_silence_sends_nothing_and_keeps_no_backlog(amplifier: InstrumentPty, reader: int) -> None:
    amplifier._frames.append(InstrumentValues(np.zeros(1), np.array([5], dtype=np.int64)))
    amplifier.pump(silent=True)
    assert read(reader) == b""
    send(amplifier, 6)
    expected = encode_frames(np.array([6]))
    assert read(reader, len(expected)) == expected


def test_the_link_replaces_a_stale_one_and_goes_when_closed(tmp_path: Path) -> None:
    link = tmp_path / "amplifier"
    link.symlink_to(tmp_path / "gone")
    made = InstrumentPty(link, deque(), Gsv2Device(250.0))
    attributes = termios.tcgetattr(os.open(link, os.O_RDWR | os.O_NOCTTY))
    assert not attributes[3] & (termios.ECHO | termios.ICANON)
    made.close()
    assert not link.is_symlink()


def test_a_real_device_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "ttyUSB0").write_text("", encoding="ascii")
    with pytest.raises(BadInput, match="never replaced"):
        InstrumentPty(tmp_path / "ttyUSB0", deque(), Gsv2Device(250.0))
    assert (tmp_path / "ttyUSB0").is_file()


# --- 1-Wire -------------------------------------------------------------------------------------------


def test_scratchpad_is_the_known_vector() -> None:
    data = scratchpad(0x003F)
    assert data == bytes.fromhex("3f 00 4b 46 7f ff 01 10 47")
    assert crc8(data) == 0
    assert slave_text(data) == (
        "3f 00 4b 46 7f ff 01 10 47 : crc=47 YES\n3f 00 4b 46 7f ff 01 10 47 t=3937\n"
    )


@given(counts=st.integers(-55 * 16, 125 * 16))
def test_every_temperature_is_read_back(counts: int) -> None:
    reading = decode_w1_slave(slave_text(scratchpad(counts)))
    if counts == 0x07FF:
        assert reading is ReadingFault.NO_POWER
    else:
        assert isinstance(reading, TemperatureReading)
        assert reading.count == counts


def test_millidegrees_round_towards_zero_as_the_kernel_does() -> None:
    assert millidegrees(scratchpad(-1)) == -62
    assert millidegrees(scratchpad(1)) == 62


def test_power_on_value_differs_from_a_true_85() -> None:
    assert decode_w1_slave(slave_text(scratchpad(85 * 16, power_on=True))) is ReadingFault.POWER_ON
    assert isinstance(decode_w1_slave(slave_text(scratchpad(85 * 16))), TemperatureReading)


def test_tree_is_as_the_kernels_and_goes_when_closed(tmp_path: Path) -> None:
    stand = device(tmp_path, temperature_noise_C=0.0)
    tree = W1Tree(tmp_path / "w1" / "devices", stand.thermometers, stand.faults)
    folder = tmp_path / "w1" / "devices" / "28-00000a3f91c2"
    assert (folder / "temperature").read_text(encoding="ascii") == "21000\n"
    stand.spring.sensor_temperature_C = 30.5  # type: ignore[misc]
    stand.advance_to(1.0)
    tree.update(1.0)
    reading = decode_w1_slave((folder / "w1_slave").read_text(encoding="ascii"))
    assert isinstance(reading, TemperatureReading)
    assert reading.count == 488
    assert sorted(path.name for path in folder.iterdir()) == ["temperature", "w1_slave"]
    tree.close()
    assert not (tmp_path / "w1" / "devices").exists()


def test_tree_shows_faults_while_they_last(tmp_path: Path) -> None:
    stand = device(tmp_path)
    stand.faults.add(ScheduledFault("temperature_1", "silent", 1.0, 2.0))
    stand.faults.add(ScheduledFault("temperature_1", "power-on", 2.0, 3.0))
    tree = W1Tree(tmp_path / "devices", stand.thermometers, stand.faults)
    path = tmp_path / "devices" / "28-00000a3f91c2" / "w1_slave"
    seen = []
    for now_s in (0.5, 1.5, 2.5, 3.5):
        tree.update(now_s)
        seen.append(decode_w1_slave(path.read_text(encoding="ascii")))
    assert seen[1:3] == [ReadingFault.EMPTY, ReadingFault.POWER_ON]
    assert all(isinstance(seen[index], TemperatureReading) for index in (0, 3))


def test_the_kernels_own_folder_is_left_alone() -> None:
    with pytest.raises(BadInput, match="real sensors"):
        W1Tree(Path("/sys/bus/w1/devices"), (), device_faults())


def device_faults() -> object:
    return None


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("controller=lost@12:15", ScheduledFault("controller", "lost", 12.0, 15.0)),
        ("temperature_2=power-on@3.5", ScheduledFault("temperature_2", "power-on", 3.5)),
        ("amplifier=silent@0", ScheduledFault("amplifier", "silent", 0.0)),
    ],
)
def test_faults_are_read(text: str, fault: ScheduledFault) -> None:
    assert parse_fault(text) == fault


@pytest.mark.parametrize(
    "text", ["controller=silent@1", "pump=lost@1", "amplifier=silent", "x", "amplifier=lost@1"]
)
def test_faults_that_cannot_be_are_refused(text: str) -> None:
    with pytest.raises(BadInput, match="no fault that can be simulated"):
        parse_fault(text)
