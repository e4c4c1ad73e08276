"""The LabJack driver against an emulator that somebody else has made from the documents, on the real wire."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.acquisition.kind import AcquisitionDevice
from bufferstand.drivers.acquisition.labjack.kind import KIND
from bufferstand.drivers.acquisition.labjack.packets import (
    RECOVERED,
    SEPARATOR,
    NotAPacketError,
    StreamPacket,
    body_bytes,
    packet_of,
    reply_of,
)
from bufferstand.drivers.acquisition.labjack.registers import analog_input, digital_line, words_of_real
from bufferstand.drivers.acquisition.labjack.scans import ScanAssembly
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.acquisition.labjack.volts import VoltScale, flash_address, scale_of
from bufferstand.drivers.instruments.kind import InstrumentSite
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput, DeviceFault
from bufferstand.foundation.settings import parse_settings
from tests.drivers.labjack_session import WIRE, session
from tests.drivers.replay import replayed_tcp
from tests.peers.labjack.emulator import LabJackEmulator
from tests.peers.labjack.stream import Habits

PATIENCE_S = 120.0
LSB_V = 0.000315805780


def swinging(time_s: np.ndarray) -> np.ndarray:
    """Return volts whose slope, 50 V/s at most, tells one scan at 1 kHz from the next."""
    return np.asarray(8.0 * np.sin(2.0 * np.pi * time_s))


def entry(rate_Hz: float = 1000.0, inputs: int = 2, **more: Any) -> dict[str, Any]:
    channels = [
        {
            "terminal": f"AIN{number}",
            "channel": {
                "name": f"pressure_{number}",
                "quantity": "pressure",
                "unit": "bar",
                "calibration": {"id": "volts", "coefficients": [0.0, 1.0]},
            },
        }
        for number in range(inputs)
    ]
    return {
        "kind": "labjack",
        "model": "T7",
        "host": "127.0.0.1",
        "rate_Hz": rate_Hz,
        "input": channels,
        **more,
    }


class Heard:
    """All that a driver has delivered."""

    def __init__(self, device: AcquisitionDevice) -> None:
        self._device = device
        self.blocks: list[SampleBlock] = []
        self.said: list[str] = []

    def take(self) -> Heard:
        for item in self._device.drain():
            if isinstance(item, SampleBlock):
                self.blocks.append(item)
            else:
                self.said.append(item.what)
        return self

    @property
    def rows(self) -> int:
        return sum(len(block.time_us) for block in self.blocks)

    @property
    def lost(self) -> int:
        return sum(block.lost for block in self.blocks)

    @property
    def numbers(self) -> np.ndarray:
        return np.concatenate([block.first_sequence + np.arange(len(block.time_us)) for block in self.blocks])

    def column(self, name: str) -> np.ndarray:
        return np.concatenate([block.counts[name] for block in self.blocks])

    def until(self, done: Callable[[Heard], bool]) -> Heard:
        end_s = time.monotonic() + PATIENCE_S
        while not done(self.take()):
            assert time.monotonic() < end_s, self.said
            time.sleep(0.01)
        return self


@contextmanager
def reading(emulator: LabJackEmulator, content: dict[str, Any]) -> Iterator[tuple[AcquisitionDevice, Heard]]:
    settings = LabJackSettings.model_validate(
        content | {"port": emulator.port, "stream_port": emulator.stream_port}
    )
    device = KIND.driver(settings, InstrumentSite(Path(), WallClock(), "acquisition"))
    device.start()
    try:
        yield device, Heard(device)
    finally:
        device.close()


def off_by_scans(heard: Heard, start_s: float, rate_Hz: float) -> float:
    """Return by how many scans values and numbers do not fit, at worst where the slope is steep."""
    true_s = start_s + (heard.numbers + 1) / rate_Hz
    slope = 16.0 * np.pi * np.cos(2.0 * np.pi * true_s)
    steep = np.abs(slope) > 25.0
    error = (heard.column("pressure_0") - swinging(true_s))[steep] / slope[steep] * rate_Hz
    return float(np.max(np.abs(error)))


@pytest.mark.parametrize("delivery", ["packets", "requests"])
def test_every_scan_comes_once_with_its_number_and_value(delivery: str) -> None:
    with LabJackEmulator(
        {0: swinging, 1: lambda t: 0.0 * t + 1.5}, habits=Habits(channel_interval_us=0.0)
    ) as far:
        with reading(far, entry(delivery=delivery)) as (device, heard):
            assert device.identity.startswith("LabJack T7 serial 470012345, firmware 1.02")
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 1500)
        assert heard.lost == 0
        assert heard.said == []
        assert np.array_equal(heard.numbers, np.arange(heard.rows))
        time_us = np.concatenate([block.time_us for block in heard.blocks])
        assert np.array_equal(time_us, 1000 * np.arange(heard.rows))
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) < 0.02
        np.testing.assert_allclose(heard.column("pressure_1"), 1.5, atol=LSB_V)
        assert far.device.stream is None or not far.device.stream.running  # it was stopped


def test_a_t8_is_read_by_its_own_constants() -> None:
    content = entry(model="T8") | {"rate_Hz": 500.0}
    for one in content["input"]:
        one["range_V"] = 4.884
    inputs = {0: lambda t: 0.0 * t + 3.25, 1: lambda t: 0.0 * t - 2.0}
    with LabJackEmulator(inputs, product=8) as far, reading(far, content) as (device, heard):
        heard.until(lambda heard: heard.rows >= 200)
        assert device.identity.startswith("LabJack T8")
    np.testing.assert_allclose(heard.column("pressure_0"), 3.25, atol=4.884 / 32768)
    np.testing.assert_allclose(heard.column("pressure_1"), -2.0, atol=4.884 / 32768)


@pytest.mark.parametrize("counted", [True, False])
def test_an_overflow_is_counted_to_the_scan(counted: bool) -> None:
    habits = Habits(dummy_is_counted=counted, channel_interval_us=0.0)
    with LabJackEmulator({0: swinging}, habits=habits) as far:
        with reading(far, entry(buffer_bytes=1024, separator_counted=counted)) as (_, heard):
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 300)
            far.hold_packets(0.8)  # 256 scans fit
            heard.until(lambda heard: heard.lost > 0 and heard.rows >= 1200)
        assert heard.lost > 300
        assert any("buffer is full" in text for text in heard.said) or any(
            "were skipped" in text for text in heard.said
        )
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) < 0.02


def test_a_wrong_word_on_the_separator_shows_as_one_scan() -> None:
    """What is not said of the T7 costs one period behind an overflow: it is a setting."""
    with LabJackEmulator(
        {0: swinging}, habits=Habits(dummy_is_counted=False, channel_interval_us=0.0)
    ) as far:
        with reading(far, entry(buffer_bytes=1024, separator_counted=True)) as (_, heard):
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 300)
            far.hold_packets(0.8)
            heard.until(lambda heard: heard.lost > 0 and heard.rows >= 1200)
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) == pytest.approx(1.0, abs=0.05)


def test_lost_packets_are_counted_by_their_numbers() -> None:
    with LabJackEmulator({0: swinging}, habits=Habits(channel_interval_us=0.0)) as far:
        with reading(far, entry()) as (_, heard):
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 300)
            far.lose_packets(3)
            heard.until(lambda heard: heard.lost > 0 and heard.rows >= 900)
        assert heard.lost == 3 * 20  # scans of a packet: 20 ms
        assert any("3 packets of its stream are missing" in text for text in heard.said)
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) < 0.02


@pytest.mark.parametrize("delivery", ["packets", "requests"])
def test_a_cut_wire_begins_anew_and_the_hole_is_measured_by_the_devices_clock(delivery: str) -> None:
    with LabJackEmulator({0: swinging}, habits=Habits(channel_interval_us=0.0)) as far:
        with reading(far, entry(delivery=delivery)) as (_, heard):
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 300)
            far.cut()
            heard.until(lambda heard: heard.lost > 0 and heard.rows >= 900)
        assert any("missing by its own clock" in text for text in heard.said)
        # A stream that begins anew begins at any instant: half a period is what a whole number cannot say.
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) < 0.6


def test_a_lost_reply_is_no_silent_loss() -> None:
    with LabJackEmulator({0: swinging}, habits=Habits(channel_interval_us=0.0)) as far:
        with reading(far, entry(delivery="requests")) as (_, heard):
            stream = far.device.stream
            assert stream is not None
            heard.until(lambda heard: heard.rows >= 300)
            far.lose_replies(1)
            heard.until(lambda heard: heard.lost > 0 and heard.rows >= 900)
        assert any("had to be repeated" in text for text in heard.said)
        assert off_by_scans(heard, stream.scan_time_s(-1), 1000.0) < 0.6


def test_a_scan_that_overlaps_is_said_and_the_stream_goes_on() -> None:
    with LabJackEmulator({0: swinging}) as far, reading(far, entry()) as (_, heard):
        heard.until(lambda heard: heard.rows >= 100)
        far.overlap_scan()
        heard.until(lambda heard: any("2942" in text for text in heard.said))
        before = heard.rows
        heard.until(lambda heard: heard.rows > before + 200)


def test_the_stop_output_is_set_while_the_stream_runs() -> None:
    with LabJackEmulator({0: swinging}) as far:
        with reading(far, entry(stop_output="EIO1", stop_level="low")) as (device, heard):
            assert device.can_ask_for_stop
            heard.until(lambda heard: heard.rows >= 50)
            assert [(line, level) for _, line, level in far.device.outputs] == [(9, 1)]
            device.ask_for_stop("force")
            heard.until(lambda _: device.stop_asked)
            assert [(line, level) for _, line, level in far.device.outputs] == [(9, 1), (9, 0)]
            before = heard.rows
            heard.until(lambda heard: heard.rows > before + 50)
        assert heard.lost == 0


def test_another_model_is_refused_with_what_to_write() -> None:
    wrong = r"it is a T8, the stand file says T7; write model = “T8”"
    with (
        LabJackEmulator({}, product=8) as far,
        pytest.raises(DeviceFault, match=wrong),
        reading(far, entry()),
    ):
        pass


def test_a_second_reader_is_kept_from_breaking_the_first_ones_stream() -> None:
    with LabJackEmulator({0: swinging}) as far, reading(far, entry()) as (_, heard):
        heard.until(lambda heard: heard.rows >= 50)
        refused = pytest.raises(DeviceFault, match="another program of this computer reads it")
        with refused, reading(far, entry()):
            pass
        before = heard.rows
        heard.until(lambda heard: heard.rows > before + 100)
    assert heard.lost == 0
    with LabJackEmulator({0: swinging}) as far:
        for _ in range(2):  # it is let go of
            with reading(far, entry()) as (_, heard):
                heard.until(lambda heard: heard.rows >= 20)


def test_nobody_there_is_one_message() -> None:
    settings = LabJackSettings.model_validate(entry(port=1))
    device = KIND.driver(settings, InstrumentSite(Path(), WallClock(), "acquisition"))
    with pytest.raises(DeviceFault, match=r"acquisition at 127\.0\.0\.1:1"):
        device.start()


def test_a_saturated_input_is_said_once() -> None:
    with LabJackEmulator({0: lambda t: 0.0 * t + 20.0}) as far, reading(far, entry()) as (_, heard):
        heard.until(lambda heard: heard.rows >= 300)
    said = [text for text in heard.said if "pressure_0" in text]
    assert len(said) == 1
    assert "pressure_0 reads 10.11 V (≥ 10.11), an end of its converter" in said[0]


# --- parts --------------------------------------------------------------------------------------------


def test_volts_of_the_data_sheets_nominal_constants() -> None:
    scale = VoltScale(0.000315805780, -0.000315805800, 33523.0)
    low, high = scale.ends
    assert low == pytest.approx(-10.586956, abs=LSB_V)  # “Voltage Offset” of section 20.0.1
    assert high == pytest.approx((65535 - 33523) * 0.000315805780, rel=1e-6)
    assert scale.volts(np.array([33523], dtype=np.uint16))[0] == 0.0


def test_constants_lie_where_the_data_sheet_says() -> None:
    assert flash_address("T7", 5, 10.0) == 3948544
    assert flash_address("T7", 5, 0.1) == 3948544 + 32
    assert flash_address("T8", 0, 11.0) == 6844416 + 64
    assert flash_address("T8", 1, 9.768) == 6844416 + 64 + 16 * 12


def test_constants_that_are_none_are_refused() -> None:
    empty = [0xFFFF] * 8
    with pytest.raises(ValueError, match="slopes"):
        scale_of(empty)
    good = [word for value in (0.0003, -0.0003, 33500.0, -10.5) for word in words_of_real(value)]
    assert scale_of(good).centre == 33500.0


@pytest.mark.parametrize(
    ("terminal", "number"), [("AIN0", 0), ("AIN249", 249), ("AIN250", None), ("FIO0", None), ("ain0", None)]
)
def test_analog_inputs_by_name(terminal: str, number: int | None) -> None:
    assert analog_input(terminal) == number


@pytest.mark.parametrize(
    ("terminal", "number"),
    [("FIO7", 7), ("EIO0", 8), ("CIO3", 19), ("MIO2", 22), ("MIO3", None), ("FIO8", None)],
)
def test_digital_lines_by_name(terminal: str, number: int | None) -> None:
    assert digital_line(terminal) == number


def test_a_packet_is_taken_apart_as_the_data_sheet_has_it() -> None:
    head = bytes.fromhex("0007 0000 000e 01 4c 10 00 0004 0b7d 002a")
    assert body_bytes(head) == 4
    packet = packet_of(head, bytes.fromhex("8000ffff"))
    assert (packet.transaction, packet.backlog_bytes, packet.status, packet.additional) == (7, 4, 2941, 42)
    assert packet.samples.tolist() == [0x8000, 0xFFFF]
    with pytest.raises(NotAPacketError):
        body_bytes(bytes.fromhex("0007 0000 000e 01 03 10 00 0004 0000 0000"))


def test_a_reply_that_says_more_than_it_holds_is_refused() -> None:
    assert reply_of([2, 0, 0, 0, 5, 6, 0]).samples.tolist() == [5, 6]
    with pytest.raises(NotAPacketError, match="3 samples"):
        reply_of([3, 0, 0, 0, 5, 6])


@given(
    cuts=st.lists(st.integers(1, 40), min_size=1, max_size=20),
    inputs=st.integers(1, 5),
)
def test_scans_do_not_depend_on_how_their_samples_were_cut(cuts: list[int], inputs: int) -> None:
    samples = np.arange(sum(cuts), dtype=np.uint16)
    assembly = ScanAssembly(inputs, 20)
    found, begun = [], 0
    for cut in cuts:
        stretches, missing = assembly.take(StreamPacket(samples[begun : begun + cut], 0, 0, 0))
        assert missing == 0
        found += stretches
        begun += cut
    whole = samples.size // inputs
    joined = np.concatenate([one.samples for one in found]) if found else np.zeros((0, inputs))
    assert np.array_equal(joined.ravel(), samples[: whole * inputs])
    assert [one.first for one in found] == np.cumsum([0, *(len(one.samples) for one in found)])[:-1].tolist()


@given(missing=st.integers(1, 60_000), begin=st.integers(0, 0xFFFF))
def test_packets_are_missed_over_the_turn_of_their_numbers(missing: int, begin: int) -> None:
    assembly = ScanAssembly(2, 20)
    samples = np.zeros(20, dtype=np.uint16)
    assembly.take(StreamPacket(samples, 0, 0, 0, begin))
    stretches, said = assembly.take(StreamPacket(samples, 0, 0, 0, (begin + 1 + missing) % 0x10000))
    assert said == missing
    assert stretches[0].lost == 10 * missing
    assert stretches[0].first == 10 + 10 * missing


def test_what_was_skipped_lies_at_the_separator() -> None:
    assembly = ScanAssembly(2, 8)
    assembly.take(StreamPacket(np.arange(8, dtype=np.uint16), 0, 0, 0, 0))
    samples = np.array([8, 9, SEPARATOR, SEPARATOR, 50, 51, 52, 53], dtype=np.uint16)
    stretches, _ = assembly.take(StreamPacket(samples, 0, RECOVERED, 7, 1))
    assert [(one.first, one.lost, one.samples.ravel().tolist()) for one in stretches] == [
        (4, 0, [8, 9]),
        (12, 7, [50, 51, 52, 53]),
    ]


def test_without_a_separator_what_was_skipped_is_still_counted() -> None:
    assembly = ScanAssembly(1, 4)
    lost = 0
    for number in range(8):
        status = RECOVERED if number == 1 else 0
        stretches, _ = assembly.take(StreamPacket(np.ones(4, dtype=np.uint16), 0, status, 7, number))
        lost += sum(one.lost for one in stretches)
    assert lost == 7
    assert assembly.next == 32 + 7


def written(*inputs: tuple[str, str], model: str = "T7", rate: float = 100.0, more: str = "") -> str:
    """Return a table of a stand file, with terminals and further keys of its inputs."""
    lines = ['kind = "labjack"', f'model = "{model}"', 'host = "x"', f"rate_Hz = {rate}", more]
    for number, (terminal, keys) in enumerate(inputs):
        lines += ["[[input]]", f'terminal = "{terminal}"', keys]
        lines += [f'channel = {{ name = "f{number}", quantity = "force", unit = "kN" }}']
    return "\n".join(lines)


PLAIN = ("AIN0", "")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (written(("AIN300", "")), "“AIN300” is no analog input; write “AIN0”"),
        (written(PLAIN, ("AIN1", ""), rate=60000.0), "a T7 takes 100000; write rate_Hz = 50000 or less"),
        (written(("AIN1", "differential = true")), "write an even one, AIN0"),
        (written(("AIN0", "differential = true"), ("AIN1", "")), "AIN1 is taken twice"),
        (written(("AIN0", "range_V = 5.0")), "range_V = 5 is none of a T7; write one of 10, 1, 0.1, 0.01"),
        (written(PLAIN, more="buffer_bytes = 5000"), "write a power of 2 up to 32768"),
        (written(PLAIN, more='stop_output = "DAC0"'), "“DAC0” is no digital line"),
        (written(PLAIN, more="resolution_index = 12"), "a stream of a T7 has 0 to 8"),
        (written(("AIN9", "range_V = 11.0"), model="T8"), "a T8 has AIN0 to AIN7"),
    ],
)
def test_what_does_not_fit_the_device_is_refused_with_what_to_write(
    text: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInput) as caught:
        parse_settings(text, LabJackSettings, tmp_path / "stand.toml")
    assert message in str(caught.value)


def test_later_inputs_of_a_scan_were_sampled_later() -> None:
    settings = LabJackSettings.model_validate(entry(inputs=3, channel_interval_us=15.0))
    assert [channel.delay_s for channel in settings.channels] == pytest.approx([0.0, -15e-6, -30e-6])


def test_the_session_of_the_kept_transcript_is_kept_byte_by_byte() -> None:
    """Whoever changes what goes over the wire sees it here (``python -m tests.drivers.labjack_session``)."""
    with replayed_tcp("labjack", WIRE) as (port, replay):
        device = session("127.0.0.1", port)
        assert replay.done.wait(10.0), replay.problem
    assert replay.problem == ""
    assert device.identity == "LabJack T7 serial 470012345, firmware 1.0292"
    assert device.rate_Hz == pytest.approx(1000.0)
    assert [scale.centre for scale in device.scales] == [33523.0, 33523.0]
    assert device.scales[1].positive == pytest.approx(0.00000315805780, rel=1e-6)
