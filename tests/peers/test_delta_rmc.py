"""The RMC emulator against the manual's own numbers, and as physics: before a driver is tried against it."""

from __future__ import annotations

import json
import math
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from tests.peers.delta_rmc import (
    MODELS,
    AxisFacts,
    RmcController,
    RmcServer,
    Unsaid,
    UserProgram,
    iec_number,
    modbus_address,
)


class Wire:
    """A host that knows Modbus and nothing of the project."""

    def __init__(self, address: tuple[str, int], low_word_first: bool = True, timeout_s: float = 5.0) -> None:
        self._socket = socket.create_connection(address, timeout=timeout_s)
        self._low_first, self._transaction = low_word_first, 0

    def close(self) -> None:
        self._socket.close()

    def ask(self, body: bytes) -> bytes:
        self._transaction += 1
        self._socket.sendall(struct.pack(">HHHB", self._transaction, 0, len(body) + 1, 0) + body)
        head = self._some(7)
        transaction, _, length, _ = struct.unpack(">HHHB", head)
        assert transaction == self._transaction
        return self._some(length - 1)

    def _some(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            more = self._socket.recv(count - len(data))
            if not more:
                raise ConnectionError
            data += more
        return data

    def read(self, address: int, registers: int, function: int = 3) -> list[int]:
        answer = self.ask(struct.pack(">BHH", function, address - 1, 2 * registers))
        assert answer[0] == function, f"exception {answer[1]}"
        return self._values(answer[2:])

    def _values(self, data: bytes) -> list[int]:
        words = struct.unpack(f">{len(data) // 2}H", data)
        low, high = (words[::2], words[1::2]) if self._low_first else (words[1::2], words[::2])
        return [b << 16 | a for a, b in zip(low, high, strict=True)]

    def reals(self, address: int, registers: int) -> list[float]:
        return [real(bits) for bits in self.read(address, registers)]

    def _data(self, values: list[int]) -> bytes:
        pairs = [(v & 0xFFFF, v >> 16) if self._low_first else (v >> 16, v & 0xFFFF) for v in values]
        return struct.pack(f">{2 * len(values)}H", *(word for pair in pairs for word in pair))

    def write(self, address: int, values: list[int]) -> bytes:
        data = self._data(values)
        return self.ask(struct.pack(">BHHB", 16, address - 1, len(data) // 2, len(data)) + data)

    def command(self, number: int, *words: float, axis: int = 0) -> None:
        values = [bits(float(word)) for word in (number, *words)]
        answer = self.write(1025 + 20 * axis, values)
        assert answer[0] == 16


def real(value: int) -> float:
    return float(struct.unpack(">f", struct.pack(">I", value))[0])


def bits(value: float) -> int:
    return int(struct.unpack(">I", struct.pack(">f", value))[0])


class Clock:
    """A clock that is turned by hand: no test waits for a stand."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def server(clock: Clock) -> Iterator[RmcServer]:
    with RmcServer(RmcController(program=UserProgram()), clock=clock) as served:
        yield served


@pytest.fixture
def wire(server: RmcServer) -> Iterator[Wire]:
    opened = Wire(server.address)
    yield opened
    opened.close()


STATUS, ERRORS, POSITION, FORCE, UPLOAD = 4097, 4099, 4113, 4097 + 512 + 16, modbus_address(104, 0)


@pytest.mark.parametrize(("file", "element", "address"), [(12, 3, 6151), (9, 56, 4721), (111, 0, 56833)])
def test_addresses_of_the_manuals_own_examples(file: int, element: int, address: int) -> None:
    assert modbus_address(file, element) == address
    assert iec_number(8, 33) == 32801
    assert iec_number(44, 10) == 180234


def test_files_of_both_models_begin_where_the_manual_says() -> None:
    rmc70, rmc150 = MODELS["RMC75"], MODELS["RMC150"]
    assert modbus_address(rmc150.commands, 0) == 20481
    assert modbus_address(rmc150.data_map, 0) == 21505
    assert modbus_address(rmc70.data_map, 0) == 9217
    assert modbus_address(rmc150.controller, 0) == 22529
    assert modbus_address(rmc150.plot_upload + 7, 0) == 56833


def test_nothing_moves_before_it_is_enabled(wire: Wire, clock: Clock) -> None:
    wire.command(20, 10.0, 100.0, 1000.0, 1000.0)
    clock.now_s = 1.0
    assert wire.reals(POSITION, 1)[0] == pytest.approx(-5.0)
    assert wire.read(ERRORS, 1)[0] == 1 << Unsaid().command_error_bit
    wire.command(4)
    assert wire.read(ERRORS, 1) == [0]


def test_a_move_ends_in_position_and_the_force_is_the_springs(wire: Wire, clock: Clock) -> None:
    wire.command(7)
    wire.command(20, 40.0, 100.0, 2000.0, 2000.0)
    clock.now_s = 0.2
    assert wire.read(STATUS, 1)[0] & (1 << 9 | 1) == 0  # neither done nor in position
    clock.now_s = 1.5
    assert wire.read(STATUS, 1)[0] & (1 << 13 | 1 << 9 | 1) == 1 << 13 | 1 << 9 | 1
    assert wire.reals(POSITION, 1)[0] == pytest.approx(40.0, abs=0.01)
    loading = (8.0 + 1.1 * 40.0 + 4.0e-4 * 40.0**3) * 1.18
    assert wire.reals(FORCE, 1)[0] == pytest.approx(loading, abs=0.2)


def ready_for_sine(wire: Wire, clock: Clock) -> None:
    wire.command(7)
    wire.command(103, 0)
    wire.command(20, 20.0, 200.0, 4000.0, 4000.0)
    clock.now_s = 1.0


def test_a_sine_from_its_lower_peak_has_amplitude_frequency_and_count(
    server: RmcServer, wire: Wire, clock: Clock
) -> None:
    ready_for_sine(wire, clock)
    block = iec_number(56, 20)
    wire.command(72, 30.0, 10.0, 2.0, 4.0, 4.0, block)
    clock.now_s = 2.0
    count, fraction, angle, amplitude, frequency, offset = wire.reals(1537 + 40, 6)
    assert (count, amplitude, frequency, offset) == (2.0, 10.0, 2.0, 30.0)
    assert angle == pytest.approx((270.0 + 360.0 * fraction) % 360.0, abs=1e-3)
    clock.now_s = 4.0
    assert wire.read(STATUS, 1)[0] >> 9 & 1
    assert wire.reals(1537 + 40, 1) == [4.0]  # does not go beyond what was asked for
    track = np.array(server.controller.truth)
    cycle = track[(track[:, 0] > 1.5) & (track[:, 0] <= 2.0)]
    lag = 1.0 / math.hypot(1.0, 2.0 * math.pi * 2.0 * AxisFacts().lag_s)
    assert np.ptp(cycle[:, 1]) / 2.0 == pytest.approx(10.0 * lag, rel=1e-3)


def test_the_loop_encloses_a_positive_area(server: RmcServer, wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    wire.command(72, 30.0, 10.0, 2.0, 4.0, 4.0)
    clock.now_s = 3.0
    wire.read(STATUS, 1)
    track = np.array(server.controller.truth)
    cycle = track[(track[:, 0] > 2.0) & (track[:, 0] <= 2.5)]
    area_J = float(np.trapezoid(cycle[:, 2], cycle[:, 1]))
    height_kN = 2.0 * 0.18 * float(np.mean(cycle[:, 2]))
    assert 0.6 * 20.0 * height_kN < area_J < 20.0 * height_kN


def test_a_sine_that_does_not_start_where_the_target_is_is_refused(wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    wire.command(72, 30.0, 5.0, 2.0, 4.0, 4.0)
    assert wire.read(ERRORS, 1)[0] == 1 << Unsaid().command_error_bit
    assert wire.reals(4101, 1) == [float(Unsaid().command_error_number)]


def test_the_amplitude_is_ramped_while_it_runs(wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    wire.command(72, 30.0, 10.0, 2.0, 0.0, 4.0, iec_number(56, 20))
    wire.command(80, Unsaid().target_parameters.index("amplitude"), 12.0, 0, 2.0)
    clock.now_s = 2.0
    assert wire.reals(1537 + 46, 1)[0] == pytest.approx(11.0, abs=0.01)
    clock.now_s = 4.0
    assert wire.reals(1537 + 46, 1)[0] == pytest.approx(12.0, abs=1e-3)
    wire.command(73, 3)  # at the next negative peak
    clock.now_s = 5.0
    assert wire.reals(POSITION, 1)[0] == pytest.approx(18.0, abs=0.02)


def set_up_plot(wire: Wire, samples: int) -> None:
    wire.write(UPLOAD, [2, samples])


def read_plot(wire: Wire, samples: int, sets: int = 3) -> tuple[list[int], np.ndarray]:
    values = wire.read(UPLOAD, 5 + samples * sets)
    data = np.array([real(value) for value in values[5:]]).reshape(sets, samples)
    return values[:5], data


def test_samples_come_set_by_set_and_without_a_hole(server: RmcServer, wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    set_up_plot(wire, 14)
    wire.command(72, 30.0, 10.0, 2.0, 4.0, 4.0)
    blocks = []
    for step in range(1, 41):
        clock.now_s = 1.0 + 0.014 * step
        head, data = read_plot(wire, 14)
        if head[4]:
            assert head[0] == 2
            blocks.append((head[2], data))
    indices = [index for index, _ in blocks]
    assert np.all(np.diff(indices) == 14)
    assert len(blocks) > 30
    track = np.array(server.controller.truth)
    first = indices[0]
    positions = np.concatenate([data[0] for _, data in blocks])
    np.testing.assert_allclose(positions, track[first : first + len(positions), 1], atol=1e-4)


def test_too_few_samples_give_none_and_keep_the_index(wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    set_up_plot(wire, 14)
    clock.now_s += 0.010
    before, _ = read_plot(wire, 14)
    clock.now_s += 0.010
    after, _ = read_plot(wire, 14)
    assert before[4] == 0
    assert (after[2], after[4]) == (before[2], 14)


def test_an_overrun_is_said_until_the_index_is_written(server: RmcServer, wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    set_up_plot(wire, 14)
    server.overrun()
    head, _ = read_plot(wire, 14)
    assert head[0] >> 4 == 2
    assert head[4] == 0
    wire.write(UPLOAD + 4, [server.controller.plots[0].captured - 100])
    head, _ = read_plot(wire, 14)
    assert (head[0] >> 4, head[4]) == (0, 14)


@pytest.mark.parametrize("moves", [True, False])
def test_a_lost_reply_moves_the_index_or_does_not(clock: Clock, moves: bool) -> None:
    controller = RmcController(unsaid=Unsaid(index_moves_when_lost=moves))
    with RmcServer(controller, clock=clock) as server:
        wire = Wire(server.address, timeout_s=0.2)
        ready_for_sine(wire, clock)
        set_up_plot(wire, 14)
        clock.now_s += 0.1
        first, _ = read_plot(wire, 14)
        server.lose()
        with pytest.raises(TimeoutError):
            read_plot(wire, 14)
        wire.close()
        again = Wire(server.address)
        head, _ = read_plot(again, 14)
        assert head[2] - first[2] == (28 if moves else 14)
        again.write(UPLOAD + 4, [first[2] + 14])  # the index can be put back
        head, _ = read_plot(again, 14)
        assert head[2] == first[2] + 14
        again.close()


def test_a_heartbeat_that_stands_still_stops_and_disables(wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    wire.write(1537, [bits(2.0), bits(0.5)])
    wire.command(72, 30.0, 10.0, 2.0, 0.0, 4.0)
    clock.now_s += 0.4
    wire.write(1537, [bits(3.0)])
    clock.now_s += 0.4
    assert wire.read(STATUS, 1)[0] & 1 << 13
    clock.now_s += 0.6
    assert wire.read(STATUS, 1)[0] & 1 << 13 == 0
    assert wire.reals(1537 + 4, 1) == [1.0]


def test_a_reset_forgets_enable_variables_and_plot(server: RmcServer, wire: Wire, clock: Clock) -> None:
    ready_for_sine(wire, clock)
    wire.write(1537, [bits(7.0)])
    server.reset()
    with pytest.raises(ConnectionError):
        wire.read(STATUS, 1)
    again = Wire(server.address)
    assert again.read(STATUS, 1)[0] & 1 << 13 == 0
    assert again.reals(1537, 1) == [0.0]
    assert again.reals(modbus_address(96, 9), 1) == [2.0]
    assert again.reals(POSITION, 1)[0] == pytest.approx(20.0, abs=0.02)
    again.close()


def test_the_data_map_gathers_registers_at_address_1(clock: Clock) -> None:
    controller = RmcController(data_map=((8, 0), (8, 8), (9, 8)))
    with RmcServer(controller, clock=clock) as server:
        wire = Wire(server.address)
        status, position, _ = wire.read(1, 3)
        assert status == wire.read(STATUS, 1)[0]
        assert real(position) == pytest.approx(-5.0)
        wire.close()


@pytest.mark.parametrize("low_first", [True, False])
@pytest.mark.parametrize("model", ["RMC75", "RMC150"])
def test_either_word_order_and_model(clock: Clock, low_first: bool, model: str) -> None:
    with RmcServer(RmcController(model, unsaid=Unsaid(low_word_first=low_first)), clock=clock) as server:
        wire = Wire(server.address, low_first)
        assert wire.reals(POSITION, 1)[0] == pytest.approx(-5.0)
        period = wire.reals(modbus_address(MODELS[model].plot_status, 2), 1)[0]
        assert period == pytest.approx(1e-3)
        assert wire.read(1025, 10) == [0] * 10  # the command area is write-only
        wire.close()


def test_what_it_does_not_serve_is_refused(wire: Wire) -> None:
    assert wire.ask(struct.pack(">BHH", 1, 0, 8)) == bytes((0x81, 1))
    assert wire.ask(struct.pack(">BHH", 3, 0, 126)) == bytes((0x83, 3))
    assert wire.ask(struct.pack(">BHH", 6, 1024, 0)) == bytes((0x86, 2))
    assert wire.ask(struct.pack(">BHH", 8, 0, 0xA5A5)) == struct.pack(">BHH", 8, 0, 0xA5A5)


def test_as_a_process_it_says_where_it_is_and_takes_troubles() -> None:
    words = [sys.executable, "-P", "-m", "tests.peers.delta_rmc"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        where = json.loads(process.stdout.readline())
        wire = Wire((where["host"], where["port"]))
        wire.command(7)
        process.stdin.write("state\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["enabled"] is True
        wire.close()
        process.stdin.close()
        assert process.wait(20) == 0
