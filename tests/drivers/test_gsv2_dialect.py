"""GSV-2: the bytes of its commands and forms, and what the engineer hears when it is not as stated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.gsv2.amplifier import Gsv2Amplifier
from bufferstand.drivers.amplifiers.gsv2.frames import SHORT, FrameDecoder
from bufferstand.drivers.amplifiers.gsv2.simulated import Gsv2Device, encode_short_frames
from bufferstand.drivers.amplifiers.text_values import LineDecoder, decimal_counts
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.amplifiers import Collector, FarEnd, amplifier_settings, until
from tests.drivers.test_gsv2_frames import noisy

BASE = 'protocol = "gsv2"\nport = "wire"\nbaud = 38400\nrate_Hz = 250.0\nrange_kN = 630.0\n'

# Bytes by the GSV-2AS manual: table of commands (p. 18: 0x2B firmware, 2 bytes; 0x1F serial number, 8 bytes;
# 0x27 get mode; 0x16 read frequency, 3 bytes), transmission mode (p. 38: 0x81, bit 3 = 5 bytes; 0x80 sets it;
# frame 0xA5 and 16 bits), rate = 5·10⁶ / (2²⁴ − register) (p. 29): 250 Hz ↔ 0xFFB1E0.
SET_UP_SHORT = (
    ("23", ""),  # stop transmission
    ("2B", "01 2A"),  # firmware 1.42
    ("1F", "30 39 31 38 33 37 30 31"),  # “09183701”
    ("27", "00"),  # mode: binary
    ("81", "08"),  # five bytes a frame …
    ("80 00", ""),  # … set to three
    ("81", "00"),
    ("12 0B B8", ""),  # set frequency, two bytes out of the manual's table
    ("16", "FF B1 E0"),  # read frequency
    ("24", ""),  # start transmission
)


def test_the_simulated_device_answers_the_transcript() -> None:
    device = Gsv2Device(10.0, rate_codes={0x0BB8: 250.0})
    for sent, answer in SET_UP_SHORT:
        assert device.obey(bytes.fromhex(sent)) == bytes.fromhex(answer), sent
    assert device.streaming


@pytest.fixture
def wire(tmp_path: Path) -> Path:
    return tmp_path / "wire"


def test_it_is_set_up_and_read_back_byte_by_byte(tmp_path: Path, wire: Path) -> None:
    table = BASE + 'gsv2 = { frame = "binary3", set_up = true, rate_code = 0x0BB8 }'
    far = FarEnd(wire, Gsv2Device(10.0, rate_codes={0x0BB8: 250.0}))
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, table), WallClock())
    try:
        amplifier.start()
        assert amplifier.identity == "GSV-2 serial 09183701, firmware 1.42"
        until(lambda: far.heard == b"".join(bytes.fromhex(sent) for sent, _ in SET_UP_SHORT))
        far.give(-0x7FFF, -1, 0, 1, 0x1234, 0x7FFE, 5)
        got = Collector(amplifier)
        until(lambda: len(got.take().counts) == 6)
        assert got.counts == [-0x7FFF, -1, 0, 1, 0x1234, 0x7FFE]
        assert got.said == []
    finally:
        amplifier.close()
        far.close()


def test_a_rate_that_does_not_stick_is_refused(tmp_path: Path, wire: Path) -> None:
    far = FarEnd(wire, Gsv2Device(10.0))
    table = BASE + "gsv2 = { set_up = true, rate_code = 0x0001 }"
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, table), WallClock())
    try:
        with pytest.raises(DeviceFault, match="it is set to 10 values a second, the stand file says 250"):
            amplifier.start()
    finally:
        far.close()


def test_a_locked_amplifier_is_named(tmp_path: Path, wire: Path) -> None:
    device = Gsv2Device(250.0)
    device.locked = True
    far = FarEnd(wire, device)
    table = BASE + 'gsv2 = { frame = "binary3", set_up = true }'
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, table), WallClock())
    try:
        with pytest.raises(
            DeviceFault, match=r"its transmission mode stays at 0x08 .* look whether changes are locked"
        ):
            amplifier.start()
    finally:
        far.close()


def test_somebody_else_on_the_line_is_named(tmp_path: Path, wire: Path) -> None:
    class Deaf(Gsv2Device):
        def obey(self, data: bytes) -> bytes:
            return super().obey(data) and b""

    far = FarEnd(wire, Deaf(250.0))
    table = BASE + "gsv2 = { set_up = true }"
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, table), WallClock())
    try:
        with pytest.raises(
            DeviceFault, match=r"no answer to “firmware version” \(0x2B\); look at the baud rate, the cable"
        ):
            amplifier.start()
    finally:
        far.close()


def test_lines_of_text_are_values_too(tmp_path: Path, wire: Path) -> None:
    table = BASE.replace("250.0", "100.0") + 'gsv2 = { frame = "text", set_up = true, decimals = 2 }'
    device = Gsv2Device(100.0, decimals=2, unit="kN")
    far = FarEnd(wire, device)
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, table), WallClock())
    got = Collector(amplifier)
    try:
        amplifier.start()
        assert device.mode == 0x02
        far.give(12345, -7, 0)
        until(lambda: len(got.take().counts) == 3)
        assert got.counts == [12345, -7, 0]
        far.pty.send(b"+1.2\r\n")
        far.give(100)
        until(lambda: len(got.take().counts) == 4)
        assert [block.lost for block in got.blocks if block.lost] == [1]
        assert any(
            "the spacing of its frames was lost (count since the start: 1" in text for text in got.said
        )
    finally:
        amplifier.close()
        far.close()


def test_saturation_is_said_once_while_it_lasts(tmp_path: Path, wire: Path) -> None:
    far = FarEnd(wire, Gsv2Device(250.0))
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, BASE), WallClock())
    got = Collector(amplifier)
    try:
        amplifier.start()
        for _ in range(3):
            far.give(*noisy(20, 1), overload=True)
            until(lambda: bool(got.take().blocks))
        until(lambda: len(got.take().counts) >= 59)
        (said,) = got.said
        assert "force_2 reads 8388607 counts (≥ 8388607), an end of its converter: the amplifier is" in said
        assert "saturated or the bridge open; look at transducer cable, range and overload" in said
        far.give(*noisy(20, 2))
        until(lambda: len(got.take().counts) >= 79)
        far.give(*noisy(20, 3), overload=True)
        until(lambda: len(got.take().said) == 2)
    finally:
        amplifier.close()
        far.close()


def test_overload_of_the_transducer_is_named(tmp_path: Path, wire: Path) -> None:
    far = FarEnd(wire, Gsv2Device(250.0))
    extra = "plausible = { overload = 600.0, rate_per_s = 1e6 }"
    amplifier = Gsv2Amplifier(wire, amplifier_settings(tmp_path, BASE, extra=extra), WallClock())
    got = Collector(amplifier)
    try:
        amplifier.start()
        far.give(*[7_700_000] * 5)
        until(lambda: bool(got.take().said))
        assert "force_2 is overloaded: 607.2 kN, the transducer bears 600; unload" in got.said[0]
    finally:
        amplifier.close()
        far.close()


@settings(max_examples=20)
@given(
    st.lists(st.integers(-0x7FFF, 0x7FFF), min_size=12, max_size=60),
    st.lists(st.integers(1, 23), min_size=1, max_size=20),
)
def test_short_frames_come_whole_whatever_the_pieces(counts: list[int], sizes: list[int]) -> None:
    data = encode_short_frames_of(counts)
    decoder = FrameDecoder(aligned=True, form=SHORT)
    got: list[int] = []
    at = 0
    while at < len(data):
        size = sizes[at % len(sizes)]
        got += [frame.count for frame in decoder.feed(data[at : at + size])]
        at += size
    assert got == counts[:-1]
    assert decoder.resyncs == 0


def encode_short_frames_of(counts: list[int]) -> bytes:
    return encode_short_frames(np.array(counts))


@pytest.mark.parametrize(("cut", "missing"), [(100, 1), (100, 2), (101, 1), (99, 4)])
def test_a_torn_short_frame_is_counted_and_the_next_are_found(cut: int, missing: int) -> None:
    counts = [v // 256 for v in noisy(100, 4)]
    data = encode_short_frames_of(counts)
    decoder = FrameDecoder(aligned=True, form=SHORT)
    frames = decoder.feed(data[:cut] + data[cut + missing :])
    assert decoder.resyncs == 1
    assert {frame.count for frame in frames} <= set(counts)
    assert len(frames) + sum(frame.lost for frame in frames) in {98, 99}


def test_sync_bytes_in_short_data_wait_for_the_noise() -> None:
    steady = [0xA5A5 - 0x8000] * 40
    decoder = FrameDecoder(form=SHORT)
    assert decoder.feed(encode_short_frames_of(steady)) == []
    moving = [0x1234, 0x2345, 0x3456, 7, 9, 11, 5, 3, 1]
    got = [frame.count for frame in decoder.feed(encode_short_frames_of(moving))]
    assert got == (steady + moving)[:-1]


def test_steady_sync_bytes_ask_for_a_restart() -> None:
    decoder = FrameDecoder(form=SHORT)
    decoder.feed(encode_short_frames_of([0xA5A5 - 0x8000] * 150))
    assert decoder.undecided


@pytest.mark.parametrize(
    ("line", "decimals", "counts"),
    [
        (b"+0123.45 kN", 2, 12345),
        (b"-1.0000 mV/V", 4, -10000),
        (b"  17 ", 0, 17),
        (b"- 0.5", 1, -5),
        (b"+0123.4 kN", 2, None),
        (b"nonsense", 2, None),
        (b"", 2, None),
        (b"1.2.3", 1, None),
    ],
)
def test_numbers_in_text(line: bytes, decimals: int, counts: int | None) -> None:
    assert decimal_counts(line, decimals) == (None if counts is None else (counts, 0))


def test_a_line_without_end_does_not_fill_the_memory() -> None:
    decoder = LineDecoder(lambda line: decimal_counts(line, 0), aligned=True)
    for _ in range(100):
        assert decoder.feed(b"x" * 50) == []
    assert decoder.pending_frames <= 1
    assert decoder.resyncs == 1
    assert decoder.feed(b"\r\n7\r\n8\r\n")[-1].count == 8
