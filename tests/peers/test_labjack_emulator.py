"""The T7/T8 emulator against the documents' numbers, by a client that is written here."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.peers.labjack.calibration import Converter
from tests.peers.labjack.device import DeviceError, LabJack
from tests.peers.labjack.emulator import LabJackEmulator
from tests.peers.labjack.stream import BURST_COMPLETE, RECOVERED, RECOVERING, Habits
from tests.peers.labjack.wire import answer


def ramp(t_s: NDArray[np.float64]) -> NDArray[np.float64]:
    return t_s - 5.0


class Clock:
    """A true time that a test turns."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def ask(device: LabJack, address: int, words: int) -> tuple[int, ...]:
    reply = answer(device, struct.pack(">BHH", 3, address, words))
    assert reply[0] == 3, f"exception {reply[1]}, LabJack error {ask(device, 55000, 1)}"
    return struct.unpack(f">{words}H", reply[2:])


def put(device: LabJack, address: int, raw: bytes) -> int:
    """Write by function 16; return the device's own error code, 0 for none."""
    head = struct.pack(">BHHB", 16, address, len(raw) // 2, len(raw))
    reply = answer(device, head + raw)
    return 0 if reply[0] == 16 else ask(device, 55000, 1)[0]


def u32(value: int) -> bytes:
    return struct.pack(">I", value)


def set_up(device: LabJack, *, rate_Hz: float, addresses: list[int], **others: int) -> int:
    values = {4006: 16, 4012: 4096, 4016: 16, 4018: 0, 4020: 0} | {
        {"packet": 4006, "buffer": 4012, "target": 4016, "scans": 4020}[key]: value
        for key, value in others.items()
    }
    assert put(device, 4002, struct.pack(">f", rate_Hz)) == 0
    assert put(device, 4004, u32(len(addresses))) == 0
    assert put(device, 4100, b"".join(map(u32, addresses))) == 0
    for address, value in values.items():
        assert put(device, address, u32(value)) == 0
    return put(device, 4990, u32(1))


def stream_read(device: LabJack, words: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    found = ask(device, 4500, words)
    return found[:4], found[4 : 4 + found[0]]


def test_the_test_registers_of_the_document() -> None:
    device = LabJack(7, {}, Clock())
    assert ask(device, 55100, 2) == (0x0011, 0x2233)
    assert ask(device, 55122, 2) == (0x8899, 0xAABB)
    assert ask(device, 55124, 2) == (0xC61C, 0x3C00)
    assert ask(device, 60000, 2) == struct.unpack(">2H", struct.pack(">f", 7.0))


def test_the_nominal_calibration_of_the_document_lies_in_flash() -> None:
    device = LabJack(7, {}, Clock())
    assert put(device, 61810, u32(0x3C4000)) == 0
    raw = struct.pack(">82H", *ask(device, 61812, 82))
    slope, negative, center, offset = struct.unpack(">4f", raw[:16])
    assert (slope, negative) == pytest.approx((0.00031580578, -0.0003158058), rel=1e-6)
    assert (center, offset) == pytest.approx((33523.0, -10.586956522))
    assert put(device, 61810, u32(0x1000)) == 0
    with pytest.raises(DeviceError) as refused:
        device.read(61812, 2)
    assert refused.value.code == 2350


@pytest.mark.parametrize(("product", "range_V"), [(7, 10.0), (7, 1.0), (8, 9.768), (8, 0.305)])
def test_bits_and_constants_give_the_volts_back(product: int, range_V: float) -> None:
    cal = Converter(product).cal(range_V)
    volts = np.linspace(-0.95 * range_V, 0.95 * range_V, 41)
    bits = cal.bits(volts).astype(float)
    above, below = (bits - cal.center) * cal.positive_slope, (cal.center - bits) * cal.negative_slope
    np.testing.assert_allclose(np.where(bits < cal.center, below, above), volts, atol=cal.positive_slope)


def test_scans_are_true_at_their_instants_and_keep_the_device_clock() -> None:
    clock, drift = Clock(), 1e-3
    device = LabJack(7, {3: ramp}, clock, drift, Habits(channel_interval_us=0.0))
    clock.now = 2.0
    assert set_up(device, rate_Hz=1000.0, addresses=[6]) == 0
    clock.now = 2.1
    (count, backlog, status, _), bits = stream_read(device, 110)
    cal = Converter(7).cal(10.0)
    times = 2.0 + (np.arange(count) + 1) / (1000.0 * (1.0 + drift))
    np.testing.assert_array_equal(bits, cal.bits(times - 5.0))
    assert (count, backlog, status) == (100, 0, 0)


def test_a_reader_that_is_too_slow_loses_counted_scans() -> None:
    clock = Clock()
    device = LabJack(7, {0: ramp, 1: ramp}, clock)
    assert set_up(device, rate_Hz=1000.0, addresses=[0, 2], buffer=256) == 0  # 64 scans
    clock.now = 0.1
    head, old = stream_read(device, 104)
    assert head[2] == RECOVERING
    assert len(old) == 100
    clock.now = 0.2
    head, rest = stream_read(device, 104)
    assert head[2] == RECOVERED
    assert len(rest) == 28 + 2, "what was left, and the scan that parts"
    assert rest[28:] == (0xFFFF, 0xFFFF)
    assert head[3] == 200 - 64, "every scan that was not kept is told"
    clock.now = 0.21
    head, new = stream_read(device, 104)
    assert head[2] == 0
    assert len(new) == 20


def test_a_burst_ends_by_itself() -> None:
    clock = Clock()
    device = LabJack(8, {0: ramp}, clock)
    assert set_up(device, rate_Hz=100.0, addresses=[0], scans=7) == 0
    clock.now = 1.0
    head, bits = stream_read(device, 20)
    assert len(bits) == 7
    assert head[2] == BURST_COMPLETE
    assert ask(device, 4990, 2) == (0, 0)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"rate_Hz": 60_000.0, "addresses": [0, 2]}, 2608),
        ({"rate_Hz": 100.0, "addresses": [1]}, 2625),
        ({"rate_Hz": 100.0, "addresses": []}, 2600),
        ({"rate_Hz": 100.0, "addresses": [0], "target": 0}, 2612),
        ({"rate_Hz": 100.0, "addresses": [0], "target": 17}, 2612),
        ({"rate_Hz": 100.0, "addresses": [0], "buffer": 3000}, 2615),
        ({"rate_Hz": 100.0, "addresses": [0], "target": 1, "packet": 513}, 2618),
    ],
)
def test_a_bad_setting_is_refused_by_the_documents_code(changes: dict[str, object], code: int) -> None:
    device = LabJack(7, {}, Clock())
    if not changes["addresses"]:
        assert put(device, 4002, struct.pack(">f", 100.0)) == 0
        assert put(device, 4990, u32(1)) == code
        return
    assert set_up(device, **changes) == code  # type: ignore[arg-type]


def test_what_a_running_stream_does_not_allow() -> None:
    device = LabJack(7, {0: ramp}, Clock())
    assert put(device, 4990, u32(0)) == 2620
    assert set_up(device, rate_Hz=100.0, addresses=[0], target=1) == 0
    assert put(device, 4990, u32(1)) == 2605
    assert put(device, 4004, u32(2)) == 2605
    for address, code in ((0, 2605), (4500, 2603)):
        with pytest.raises(DeviceError) as refused:
            device.read(address, 6 if address else 2)
        assert refused.value.code == code
    assert put(device, 4990, u32(0)) == 0
    assert ask(device, 0, 2) == struct.unpack(">2H", struct.pack(">f", -5.0))


def test_a_digital_line_is_seen_to_be_written() -> None:
    device = LabJack(7, {}, Clock())
    assert answer(device, struct.pack(">BHH", 6, 2008, 1)) == struct.pack(">BHH", 6, 2008, 1)
    assert device.outputs == [(0.0, 8, 1)]
    assert put(device, 60000, struct.pack(">f", 8.0)) == 2, "read only"
    assert answer(device, struct.pack(">BHH", 5, 2008, 1)) == bytes((0x85, 1))


@contextmanager
def _streaming(packet: int) -> Iterator[tuple[LabJackEmulator, socket.socket]]:
    with (
        LabJackEmulator({0: ramp, 1: ramp}) as emulator,
        socket.create_connection(("127.0.0.1", emulator.port), 5.0) as commands,
        socket.create_connection(("127.0.0.1", emulator.stream_port), 5.0) as stream,
    ):
        stream.settimeout(10.0)

        def write(address: int, raw: bytes) -> None:
            pdu = struct.pack(">BHHB", 16, address, len(raw) // 2, len(raw)) + raw
            commands.sendall(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
            reply = commands.recv(300)
            assert reply[7] == 16, reply.hex()

        write(4002, struct.pack(">f", 5000.0))
        write(4004, u32(2))
        write(4100, u32(0) + u32(2))
        for address, value in {4006: packet, 4012: 4096, 4016: 1, 4018: 0}.items():
            write(address, u32(value))
        write(4990, u32(1))
        yield emulator, stream


def _packet(stream: socket.socket) -> tuple[tuple[int, ...], tuple[int, ...]]:
    head = b""
    while len(head) < 16:
        head += stream.recv(16 - len(head))
    transaction, protocol, length, unit, function, kind, _, backlog, status, more = struct.unpack(
        ">HHHBBBBHHH", head
    )
    assert (protocol, unit, function, kind) == (0, 1, 76, 16)
    data = b""
    while len(data) < length - 10:
        data += stream.recv(length - 10 - len(data))
    return (transaction, backlog, status, more), struct.unpack(f">{len(data) // 2}H", data)


def test_packets_come_by_themselves_and_are_numbered() -> None:
    with _streaming(packet=200) as (_, stream):
        heads = [_packet(stream) for _ in range(20)]
    assert [head[0] for head, _ in heads] == list(range(20))
    assert all(len(data) == 200 and head[2] == 0 for head, data in heads)
    firsts = np.array([data[0::2] for _, data in heads]).ravel().astype(int)
    assert np.all(np.diff(firsts) >= 0), "a ramp, scan by scan, with nothing lost"


def test_a_lost_packet_leaves_a_hole_in_the_numbers() -> None:
    with _streaming(packet=200) as (emulator, stream):
        first = _packet(stream)[0][0]
        emulator.lose_packets(2)
        numbers = [_packet(stream)[0][0] for _ in range(30)]
    steps = np.diff([first, *numbers])
    assert steps.sum() == len(steps) + 2


def test_a_network_that_stands_still_makes_the_buffer_overflow() -> None:
    with _streaming(packet=200) as (emulator, stream):
        _packet(stream)
        emulator.hold_packets(0.6)  # the buffer holds 0.2 s
        seen = [_packet(stream) for _ in range(60)]
    states = [head[2] for head, _ in seen]
    assert RECOVERING in states
    assert RECOVERED in states
    head, data = seen[states.index(RECOVERED)]
    assert head[3] > 1000, "5000 scans a second for what was beyond the buffer"
    assert 0xFFFF in data


def test_connections_are_cut_and_taken_again() -> None:
    with _streaming(packet=200) as (emulator, stream):
        _packet(stream)
        emulator.cut()
        with suppress(ConnectionError):
            while stream.recv(4096):
                pass
        with socket.create_connection(("127.0.0.1", emulator.port), 5.0) as again:
            again.sendall(struct.pack(">HHHBBHH", 9, 0, 6, 1, 3, 55100, 2))
            assert again.recv(100) == struct.pack(">HHHBBBHH", 9, 0, 7, 1, 3, 4, 0x0011, 0x2233)


def test_replies_can_be_lost_and_late() -> None:
    request = struct.pack(">HHHBBHH", 9, 0, 6, 1, 3, 55100, 2)
    with (
        LabJackEmulator({}) as emulator,
        socket.create_connection(("127.0.0.1", emulator.port), 5.0) as commands,
    ):
        emulator.lose_replies(1)
        commands.sendall(request)
        commands.settimeout(0.2)
        with pytest.raises(TimeoutError):
            commands.recv(100)
        emulator.delay_replies(0.3)
        commands.sendall(request)
        with pytest.raises(TimeoutError):
            commands.recv(100)
        commands.settimeout(5.0)
        assert len(commands.recv(100)) == 13
