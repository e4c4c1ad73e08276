"""HBM AED: the bytes of its commands and output formats, and what the engineer hears."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.aed.amplifier import AedAmplifier, icr_of
from bufferstand.drivers.amplifiers.aed.simulated import AedDevice
from bufferstand.drivers.amplifiers.aed.values import (
    BinaryDecoder,
    continuous_decoder,
    decode_binary,
    parse_text,
    status_words,
)
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.amplifiers import Collector, FarEnd, amplifier_settings, until
from tests.drivers.test_gsv2_frames import noisy

BASE = 'protocol = "aed"\nport = "wire"\nbaud = 38400\nrate_Hz = 100.0\nrange_kN = 630.0\n'
BINARY = (0, 2, 4, 6, 8, 12)
TEXT = (1, 3, 9, 11)

# By the AD104 manual: commands end in “;” (p. 14); inputs are answered “0” or “?” and CR LF, STP and S..
# not at all (p. 15); IDN? (p. 51); COF 32 + 8 = 4 bytes and no CR LF, the last one status (pp. 21, 22);
# ICR0 = 100 a second (p. 38); TAS1 = gross (p. 45); MSV?0 sends until STP (p. 38). CSM: from memory.
START = (
    (";STP;", ""),
    ("IDN?;", 'HBM, "AED104         ","1234   ", P20\r\n'),
    ("COF40;", "0\r\n"),
    ("COF?;", "40\r\n"),
    ("CSM0;", "0\r\n"),
    ("CSM?;", "0\r\n"),
    ("TAS1;", "0\r\n"),
    ("TAS?;", "1\r\n"),
    ("ICR0;", "0\r\n"),
    ("ICR?;", "0\r\n"),
    ("MSV?0;", ""),
)
# The manual's example of taring, p. 45 (values in text).
TARING = (
    ("COF3;", "0\r\n"),
    ("TAS1;", "0\r\n"),
    ("MSV?;", "    1500\r\n"),
    ("TAR;", "0\r\n"),
    ("TAV?;", "1500\r\n"),
    ("MSV?;", "       0\r\n"),
    ("TAS?;", "0\r\n"),
    ("TAS1;", "0\r\n"),
)


@pytest.mark.parametrize("transcript", [START, TARING])
def test_the_simulated_device_answers_the_transcript(transcript: tuple[tuple[str, str], ...]) -> None:
    device = AedDevice()
    device.send(np.array([1500]))
    for sent, answer in transcript:
        assert device.obey(sent.encode()) == answer.encode(), sent


def test_commands_may_come_in_pieces_small_letters_and_with_line_feeds() -> None:
    device = AedDevice()
    assert device.obey(b"ic") == b""
    assert device.obey(b"r3\n icr?;") == b"0\r\n3\r\n"
    assert device.obey(b"XYZ;") == b"?\r\n"


@pytest.mark.parametrize(
    ("output", "data", "count", "status"),
    [
        (0, "FF FF 85 00", -123, 0),
        (4, "00 85 FF FF", -123, 0),
        (8, "4E 20 00 08", 5120000, 8),
        (12, "08 00 20 4E", 5120000, 8),
        (2, "4E 20", 20000, 0),
        (6, "20 4E", 20000, 0),
        (2, "80 00", -32768, 0),
        (0, "00 00 01 01", None, 0),
        (8, "00 00 01 10", None, 0),
    ],
)
def test_binary_values_by_the_manual(output: int, data: str, count: int | None, status: int) -> None:
    """Order of bytes: p. 21; 5120000 (four bytes) and 20000 (two) at nominal load: p. 38."""
    found = decode_binary(bytes.fromhex(data), output)
    if count is None:
        assert found is None
    else:
        assert found is not None
        assert (found.count, found.status) == (count, status)


def test_a_checksum_is_the_exclusive_or_of_the_value() -> None:
    found = decode_binary(bytes.fromhex("12 34 56 70"), 8, checksum=True)
    assert found is not None
    assert found.count == 0x123456
    assert decode_binary(bytes.fromhex("12 34 57 70"), 8, checksum=True) is None


@pytest.mark.parametrize(
    ("output", "line", "found"),
    [
        (3, b"-0012345", (-12345, 0)),
        (1, b"   12345,31", (12345, 0)),
        (9, b"   12345,31,004", (12345, 4)),
        (11, b"   12345,008", (12345, 8)),
        (9, b"   12345,31", None),
        (9, b"   12345,31,999", None),
        (9, b"   12345,07,000", None),
        (3, b"12a45", None),
        (11, b"12345,1", None),
    ],
)
def test_text_values_by_the_manual(output: int, line: bytes, found: tuple[int, int] | None) -> None:
    assert parse_text(line, output, 31) == found


@given(
    st.sampled_from([*BINARY, *TEXT]),
    st.lists(st.integers(-32000, 32000), min_size=1, max_size=40),
    st.lists(st.integers(1, 23), min_size=1, max_size=8),
    st.booleans(),
)
def test_every_format_is_read_as_the_device_sends_it(
    output: int, counts: list[int], sizes: list[int], checksum: bool
) -> None:
    checksum = checksum and output in {8, 12}
    device = AedDevice()
    device.obey(f"COF{output + (0 if output in TEXT else 32)};CSM{int(checksum)};MSV?0;".encode())
    data = device.send(np.array(counts))
    decoder = continuous_decoder(output, checksum=checksum, address=None, aligned=True)
    got: list[int] = []
    at = 0
    while at < len(data):
        size = sizes[at % len(sizes)]
        got += [value.count for value in decoder.feed(data[at : at + size])]
        at += size
    assert got == counts
    assert decoder.resyncs == 0


@pytest.mark.parametrize(
    ("load", "jump"), [(3_400_000, None), (100_000, 2**21), (0, 2**21), (-50_000, 2**21)]
)
def test_a_slip_in_a_binary_stream_is_seen_and_asks_for_a_restart(load: int, jump: float | None) -> None:
    """By its status byte alone under load; near zero, where data looks like a status, by its jumps."""
    decoder = BinaryDecoder(8, jump=jump)
    counts = [load + count - 100_000 for count in noisy(60, 1)]
    good = b"".join(count.to_bytes(3, "big", signed=True) + b"\x00" for count in counts)
    values = decoder.feed(good[:41] + good[42:])
    assert [value.count for value in values[:10]] == counts[:10]
    assert len(values) <= 12
    assert decoder.undecided
    assert decoder.resyncs == 1
    assert decoder.feed(good) == []


def test_one_disturbed_value_costs_itself_and_is_counted() -> None:
    decoder = BinaryDecoder(8)
    counts = noisy(30, 2)
    pieces = [count.to_bytes(3, "big") + b"\x00" for count in counts]
    pieces[10] = b"\x00\x00\x00\x30"
    values = decoder.feed(b"".join(pieces))
    assert [value.count for value in values] == counts[:10] + counts[11:]
    assert [value.lost for value in values if value.lost] == [1]
    assert values[10].lost == 1
    assert not decoder.undecided


@pytest.mark.parametrize(("rate", "top", "icr"), [(100, 100, 0), (12.5, 100, 3), (12, 100, 3), (600, 600, 0)])
def test_rates_by_halving(rate: float, top: float, icr: int) -> None:
    assert icr_of(rate, top) == icr


@pytest.mark.parametrize("rate", [80.0, 200.0, 0.1])
def test_rates_that_it_has_not(rate: float) -> None:
    with pytest.raises(ValueError, match=r"values a second are not one of 100, 50, 25, 12\.5"):
        icr_of(rate, 100.0)


def test_what_the_status_byte_says() -> None:
    (overdriven,) = status_words([0x08, 0x0C, 0x00])
    assert overdriven[1].startswith("its converter is overdriven (input beyond ±2.5 mV/V)")
    assert [text for _, text in status_words([0x03, 0x40])] == [
        "its gross value overflows; its scaling is too sensitive for this load",
        "its net value overflows; its tare value is too large",
        "it says that its values do not fit its settings; set it up anew",
    ]


def opened(tmp_path: Path, table: str, device: AedDevice) -> tuple[FarEnd, AedAmplifier]:
    far = FarEnd(tmp_path / "wire", device)
    return far, AedAmplifier(tmp_path / "wire", amplifier_settings(tmp_path, BASE + table), WallClock())


def test_it_is_set_up_and_read_byte_by_byte(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 8 }", AedDevice())
    got = Collector(amplifier)
    try:
        amplifier.start()
        assert amplifier.identity == 'HBM, "AED104         ","1234   ", P20'
        until(lambda: far.heard == "".join(sent for sent, _ in START).encode())
        far.give(1, -2, 800_000)
        until(lambda: len(got.take().counts) == 3)
        assert got.counts == [1, -2, 800_000]
        assert got.said == []
    finally:
        amplifier.close()
        far.close()


def test_overload_comes_by_the_status_byte_and_by_the_end_of_the_range(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 9 }", AedDevice())
    got = Collector(amplifier)
    try:
        amplifier.start()
        far.give(1, 2, 3, overload=True)
        until(lambda: len(got.take().said) == 2)
        assert "its converter is overdriven (input beyond ±2.5 mV/V); look at load" in got.said[0]
        assert "an end of its converter" in got.said[1]
    finally:
        amplifier.close()
        far.close()


def test_a_lost_byte_costs_a_restart_that_is_counted(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 8 }", AedDevice())
    got = Collector(amplifier)
    try:
        amplifier.start()
        far.give(*noisy(60, 3), drop=1)
        until(lambda: far.heard.count(b"MSV?0;") == 2)
        far.give(7, 8)
        until(lambda: got.take().counts[-2:] == [7, 8])
        assert any(
            "the spacing of its frames was lost (count since the start: 1)" in text for text in got.said
        )
        assert any("it is stopped and started again" in text for text in got.said)
    finally:
        amplifier.close()
        far.close()


def test_on_a_bus_each_value_is_asked_for(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 11, address = 7 }", AedDevice(address=7))
    got = Collector(amplifier)
    try:
        far.give(4711)
        amplifier.start()
        until(lambda: len(got.take().counts) >= 3)
        assert set(got.counts) == {4711}
        assert far.heard.count(b"S07;MSV?;") >= 3
        assert b"MSV?0" not in far.heard
        assert got.said == []
    finally:
        amplifier.close()
        far.close()


@pytest.mark.parametrize(
    ("table", "refused", "message"),
    [
        ("aed = { output = 8, address = 9 }", "", r"no answer to IDN\?; .* and the address 9"),
        ("aed = { output = 8 }", "COF40", "it refused COF40: “\\?”; look at its model, its password"),
        ("aed = { output = 8, top_rate_Hz = 600.0 }", "", "100 values a second are not one of 600, 300, 150"),
        ("aed = { output = 8, checksum = true }", "CSM", "it refused CSM1"),
        ("aed = { output = 8 }", "IDN?", "it does not know IDN\\?; look whether it is an AED"),
    ],
)
def test_what_it_does_not_take_is_named(tmp_path: Path, table: str, refused: str, message: str) -> None:
    device = AedDevice()
    if refused:
        device.refused.add(refused)
    far, amplifier = opened(tmp_path, table, device)
    try:
        with pytest.raises(DeviceFault, match=message):
            amplifier.start()
    finally:
        amplifier.close()
        far.close()


def test_an_old_device_without_checksums_is_taken_when_none_is_wanted(tmp_path: Path) -> None:
    device = AedDevice()
    device.refused.add("CSM")
    far, amplifier = opened(tmp_path, "aed = { output = 8 }", device)
    try:
        amplifier.start()
    finally:
        amplifier.close()
        far.close()


def test_taring_stops_the_stream_and_goes_on_with_net_values(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 8, net = true }", AedDevice())
    got = Collector(amplifier)
    try:
        amplifier.start()
        far.give(1000, 1000)
        until(lambda: len(got.take().counts) == 2)
        amplifier.zero()
        until(lambda: far.heard.endswith(b"TAR;MSV?0;"))
        far.give(1250)
        until(lambda: len(got.take().counts) == 3)
        assert got.counts == [1000, 1000, 250]
        assert got.blocks[-1].lost > 0  # the values that were not sent meanwhile are counted
    finally:
        amplifier.close()
        far.close()


def test_a_tare_that_would_not_be_seen_is_refused(tmp_path: Path) -> None:
    far, amplifier = opened(tmp_path, "aed = { output = 8 }", AedDevice())
    got = Collector(amplifier)
    try:
        amplifier.start()
        amplifier.zero()
        until(lambda: bool(got.take().said))
        assert "it shows gross values (aed.net = false), a tare would not be seen" in got.said[0]
        until(lambda: far.heard.count(b"MSV?0;") == 2)
        far.give(5)
        until(lambda: got.take().counts == [5])
    finally:
        amplifier.close()
        far.close()
