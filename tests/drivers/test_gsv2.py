from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.drivers.amplifiers.aed.values import continuous_decoder
from bufferstand.drivers.amplifiers.gsv2.amplifier import Gsv2Amplifier, frequency_of, register_of
from bufferstand.drivers.amplifiers.text_values import LineDecoder, decimal_counts
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.amplifiers import PATIENCE_S, Collector, until
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.test_gsv2_frames import noisy, stream

SETTINGS: Any = load_stand(SAMPLE_STAND).amplifier[0]


class PtyAmplifier:
    """The far end of a serial line: answers commands; the test decides when frames are sent."""

    def __init__(self, *, rate_Hz: float = 250.0, answers: bool = True, stops: bool = True) -> None:
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = Path(os.ttyname(self.slave))
        self.commands = b""
        self.sending = threading.Event()
        self._rate_Hz = rate_Hz
        self._answers = answers
        self._stops = stops
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        os.close(self.master)
        os.close(self.slave)

    def _listen(self) -> None:
        while not self._end.is_set():
            if not self._stops:
                self.send(stream([1]))
            if not select.select([self.master], [], [], 0.01)[0]:
                continue
            for command in os.read(self.master, 100):
                self.commands += bytes([command])
                if command == 0x23:
                    self.sending.clear()
                elif command == 0x24:
                    self.sending.set()
                elif command == 0x16 and self._answers:
                    self.send(register_of(self._rate_Hz).to_bytes(3, "big"))


@pytest.fixture
def far() -> Iterator[PtyAmplifier]:
    one = PtyAmplifier()
    yield one
    one.close()


@pytest.fixture
def amplifier(far: PtyAmplifier) -> Iterator[Gsv2Amplifier]:
    one = Gsv2Amplifier(far.path, SETTINGS, WallClock())
    yield one
    one.close()


def test_frequency_register() -> None:
    assert frequency_of(0xFFFFFF) == 5e6
    assert register_of(250.0) == (1 << 24) - 20_000
    assert frequency_of(register_of(250.0)) == 250.0
    assert frequency_of(0) == pytest.approx(0.298, abs=1e-3)
    with pytest.raises(ValueError, match="is no 24-bit register"):
        register_of(0.1)


def test_full_scale_is_105_percent_of_the_range() -> None:
    channel = SETTINGS.channel
    assert channel.calibration.apply(0x7FFFFF) == pytest.approx(1.05 * SETTINGS.range_kN)


def test_values_come_whole_and_in_order(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    amplifier.start()
    amplifier.start()  # a second time does nothing
    assert far.sending.wait(PATIENCE_S)
    assert far.commands == b"\x23\x16\x24"
    counts = noisy(200, 1)
    data = stream(counts)
    for position in range(0, len(data), 37):
        far.send(data[position : position + 37])
    got = Collector(amplifier)
    until(lambda: len(got.take().counts) >= 199)
    assert got.counts == counts[:-1]
    assert got.faults == []
    sequences = np.concatenate([b.first_sequence + np.arange(len(b.time_us)) for b in got.blocks])
    np.testing.assert_array_equal(sequences, np.arange(199))
    time_us = np.concatenate([block.time_us for block in got.blocks])
    assert np.all(np.diff(time_us) > 0)
    assert {block.stream for block in got.blocks} == {"amplifier"}
    assert all(block.lost == 0 for block in got.blocks)
    assert amplifier.resyncs == 0


def test_torn_frames_are_reported_and_counted(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    amplifier.start()
    assert far.sending.wait(PATIENCE_S)
    counts = noisy(60, 2)
    data = stream(counts)
    far.send(data[:102] + data[103:])
    got = Collector(amplifier)
    until(lambda: len(got.take().counts) >= 58)
    assert got.counts == counts[:20] + counts[21:-1]
    assert [block.lost for block in got.blocks if block.lost] == [1]
    after = next(block for block in got.blocks if block.lost)
    assert after.first_sequence == 21
    (fault,) = got.faults
    assert fault.stream == "amplifier"
    assert "the spacing of its frames was lost (count since the start: 1); look at cable" in fault.what
    assert str(far.path) in fault.what
    assert amplifier.resyncs == 1


def test_silence_is_reported_once_and_ends(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    amplifier.start()
    assert far.sending.wait(PATIENCE_S)
    got = Collector(amplifier)
    until(lambda: bool(got.take().faults))
    assert "silent for 1." in got.faults[0].what
    assert "look at cable, power and port" in got.faults[0].what
    far.send(stream(noisy(20, 3)))
    until(lambda: len(got.take().counts) >= 19)
    assert len(got.faults) == 1


def test_bytes_without_frames_are_told_from_silence(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    amplifier.start()
    assert far.sending.wait(PATIENCE_S)
    far.send(b"+123.45 kN\r\n" * 10)
    got = Collector(amplifier)
    until(lambda: any("bytes but no frame" in fault.what for fault in got.take().faults))
    assert any("look at the baud rate and whether it sends 5-byte binary" in f.what for f in got.faults)
    assert got.blocks == []


def test_another_rate_is_refused() -> None:
    far = PtyAmplifier(rate_Hz=100.0)
    amplifier = Gsv2Amplifier(far.path, SETTINGS, WallClock())
    try:
        with pytest.raises(DeviceFault, match="it is set to 100 values a second, the stand file says 250"):
            amplifier.start()
    finally:
        amplifier.close()
        far.close()


def test_no_answer_about_the_rate_is_told_and_reading_goes_on() -> None:
    far = PtyAmplifier(answers=False)
    amplifier = Gsv2Amplifier(far.path, SETTINGS, WallClock())
    try:
        amplifier.start()
        assert far.sending.wait(PATIENCE_S)
        far.send(stream(noisy(20, 4)))
        got = Collector(amplifier)
        until(lambda: len(got.take().counts) >= 19)
        assert "no answer to “read frequency” (0x16)" in got.faults[0].what
    finally:
        amplifier.close()
        far.close()


def test_an_amplifier_that_does_not_stop_is_read_all_the_same() -> None:
    far = PtyAmplifier(stops=False)
    amplifier = Gsv2Amplifier(far.path, SETTINGS, WallClock())
    try:
        amplifier.start()
        got = Collector(amplifier)
        until(lambda: len(got.take().counts) >= 10)
        assert set(got.counts) == {1}
        assert "it does not stop sending on command 0x23" in got.faults[0].what
    finally:
        amplifier.close()
        far.close()


def test_no_port(tmp_path: Path) -> None:
    amplifier = Gsv2Amplifier(tmp_path / "nothing", SETTINGS, WallClock())
    with pytest.raises(DeviceFault, match=r"nothing: cannot be opened .*; look whether the device is there"):
        amplifier.start()
    amplifier.close()


def test_a_port_in_use_is_not_shared(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    amplifier.start()
    second = Gsv2Amplifier(far.path, SETTINGS, WallClock())
    with pytest.raises(DeviceFault, match="cannot be opened"):
        second.start()
    second.close()


def test_a_line_that_goes_away_and_comes_back(tmp_path: Path) -> None:
    wire = tmp_path / "amplifier"
    first, second = PtyAmplifier(), PtyAmplifier()
    wire.symlink_to(first.path)
    amplifier = Gsv2Amplifier(wire, SETTINGS, WallClock())
    got = Collector(amplifier)
    try:
        amplifier.start()
        assert first.sending.wait(PATIENCE_S)
        wire.unlink()
        wire.symlink_to(second.path)
        first.close()
        until(lambda: bool(got.take().faults))
        assert "its line failed" in got.faults[0].what
        assert "look at plug and power; tried again" in got.faults[0].what
        assert second.sending.wait(PATIENCE_S)
        second.send(stream(noisy(20, 5)))
        until(lambda: len(got.take().counts) >= 19)
        assert len(got.faults) == 1
    finally:
        amplifier.close()
        second.close()


@pytest.mark.slow
def test_zero_is_sent_only_when_asked(far: PtyAmplifier, amplifier: Gsv2Amplifier) -> None:
    with pytest.raises(DeviceFault, match="zero was not set, its port is not open"):
        amplifier.zero()
    amplifier.start()
    amplifier.zero()
    until(lambda: far.commands.endswith(b"\x0c"))
    assert far.commands.count(b"\x0c") == 1


def test_a_line_of_more_digits_than_counts_have_is_lost() -> None:
    """Found by fuzzing: it ended the thread that reads."""
    decoder = LineDecoder(lambda line: decimal_counts(line, 2), aligned=True)
    found = decoder.feed(b"+0001.25\r\n+99999999999999999999.25\r\n+0001.50\r\n")
    assert [(value.count, value.lost) for value in found] == [(125, 0), (150, 1)]
    aed = continuous_decoder(3, checksum=False, address=None, aligned=True)
    assert [value.count for value in aed.feed(b"12\r\n99999999999999\r\n13\r\n")] == [12, 13]
