"""The controller's registers over TCP: two foreign clients, the driver's conventions, every refusal."""

from __future__ import annotations

import asyncio
import binascii
import socket
import struct
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from pymodbus.client import ModbusTcpClient
from pyModbusTCP.client import ModbusClient

from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.drivers.simulated.machine.commands import ControllerFault, RejectReason
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.foundation.errors import BadInput
from tests.drivers.simulated.standing import device

RING = load_profile("ring")


@dataclass
class Served:
    """A stand that advances by ``per_request`` samples with each request, so that no test depends on time."""

    stand: SimulatedDevice
    profile: Profile
    per_request: int = 0
    cut: bool = False
    cut_by_catching_up: bool = False
    port: int = 0
    acting: list[bool] = field(default_factory=list)
    loop: asyncio.AbstractEventLoop | None = None

    def catch_up(self, acting: bool) -> None:
        self.acting.append(acting)
        if self.per_request:
            self.stand.advance(self.per_request)
        self.cut |= self.cut_by_catching_up

    def settle(self) -> None:
        """Let the server do all that it is going to do about what it has been sent."""

        async def turns() -> None:
            for _ in range(20):
                await asyncio.sleep(0)

        assert self.loop is not None
        asyncio.run_coroutine_threadsafe(turns(), self.loop).result(60)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    made = Served(device(tmp_path), RING)
    bank = RegisterBank(made.stand, RING)
    server = ModbusStandServer(Responder(bank, made.catch_up, lambda: made.cut), 1)
    loop = made.loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    made.port = asyncio.run_coroutine_threadsafe(server.start("127.0.0.1", 0), loop).result(60)
    yield made
    asyncio.run_coroutine_threadsafe(server.stop(), loop).result(60)
    loop.call_soon_threadsafe(loop.stop)
    thread.join(60)
    loop.close()


@pytest.fixture
def client(served: Served) -> Iterator[ModbusTcpClient]:
    made = ModbusTcpClient("127.0.0.1", port=served.port, timeout=60, retries=0)
    assert made.connect()
    yield made
    made.close()


def write_block(first: str, last: str, **values: float) -> tuple[int, list[int]]:
    block = RING.block(first, last)
    return block.address, block.encode({place.name: values.get(place.name, 0.0) for place in block.places})


def status(client: ModbusTcpClient) -> dict[str, float | int]:
    block = RING.block("status_word", "tick")
    return block.decode(client.read_holding_registers(block.address, count=block.words).registers)


def test_identity_and_test_values_are_there(client: ModbusTcpClient) -> None:
    block = RING.block("device_type", "sample_rate")
    reply = client.read_holding_registers(block.address, count=block.words)
    values = block.decode(reply.registers)
    for name, register in RING.registers.items():
        if register.expect is not None:
            assert values[name] == register.expect
    assert values["sample_rate"] == 1000.0


def test_a_command_runs_from_arming_to_its_end(served: Served, client: ModbusTcpClient) -> None:
    served.per_request = 100
    for word in (0x0006, 0x0007, 0x000F):
        assert not client.write_register(96, word).isError()
    assert status(client)["state"] == 2
    address, words = write_block(
        "command_sequence", "static_pause", command_sequence=1, command_code=2, target=20.0, speed=50.0
    )
    assert client.write_registers(address, words).count == len(words)
    assert (status(client)["echo_sequence"], status(client)["reject_code"]) == (1, 0)
    assert client.write_register(84, 1).registers == [1]
    seen = [status(client) for _ in range(8)]
    assert {reading["state"] for reading in seen} >= {2, 3}
    assert seen[-1]["done_sequence"] == 1
    assert seen[-1]["end_reason"] == 1
    assert seen[-1]["position"] == pytest.approx(20.0, abs=0.01)
    assert seen[-1]["force"] == pytest.approx(served.stand.measured_force_kN, rel=1e-6)
    assert seen[-1]["heartbeat"] > seen[0]["heartbeat"]
    assert seen[-1]["tick"] == served.stand.ring.total * 1000


def test_rejects_are_told(served: Served, client: ModbusTcpClient) -> None:
    client.write_register(96, 0x000F)
    address, words = write_block("command_sequence", "static_pause", command_sequence=7, command_code=99)
    client.write_registers(address, words)
    assert (status(client)["echo_sequence"], status(client)["reject_code"]) == (
        7,
        RejectReason.UNKNOWN_COMMAND,
    )
    client.write_register(84, 7)
    assert status(client)["reject_code"] == RejectReason.NOT_ARMED


def test_ring_is_read_whole_by_acknowledged_sequence_and_a_retry_loses_nothing(
    served: Served, client: ModbusTcpClient
) -> None:
    served.per_request = 11
    acknowledged, ticks, overlap = 0, [], 0
    for number in range(40):
        reply = client.readwrite_registers(
            read_address=260,
            read_count=121,
            write_address=256,
            values=RING.encode("ring_acknowledge", acknowledged),
        )
        header = RING.ring_header.decode(reply.registers[:9])
        count = int(header["count"])
        assert (header["asked"], header["first_sequence"]) == (acknowledged, acknowledged)
        words = reply.registers[:7] + reply.registers[9 : 9 + 8 * count]
        assert header["check"] == binascii.crc32(struct.pack(f">{len(words)}H", *words))
        rows = RING.ring_sample.decode_rows(reply.registers[9 : 9 + 8 * count], count)
        if number % 3 == 2:  # the reply is lost: ask again
            overlap += count
            continue
        ticks += rows["tick"].tolist()
        acknowledged += count
    assert overlap > 0
    assert ticks == [1000 * n for n in range(1, len(ticks) + 1)]
    assert served.stand.ring.overruns == 0
    # Acknowledging is no act: a server need not interrupt its slice for it.
    assert not any(served.acting)


def test_ring_across_its_end_and_overrun(served: Served, client: ModbusTcpClient) -> None:
    served.stand.advance(70_000)
    _, columns = served.stand.ring.window(65_530, 14)
    for wanted, first, overruns in ((65_530, 65_530, 0), (100, 4464, 1), (70_000, 70_000, 1)):
        reply = client.readwrite_registers(
            read_address=260,
            read_count=121,
            write_address=256,
            values=RING.encode("ring_acknowledge", wanted),
        )
        header = RING.ring_header.decode(reply.registers[:9])
        assert (header["first_sequence"], header["overruns"]) == (first, overruns)
        rows = RING.ring_sample.decode_rows(reply.registers[9:], 14)
        if wanted == 65_530:
            for name, column in columns.items():
                assert np.array_equal(rows[name], column), name
        assert header["count"] == (0 if wanted == 70_000 else 14)


def test_limits_are_kept_as_written_and_refused_beyond_the_stand(
    served: Served, client: ModbusTcpClient
) -> None:
    address, words = write_block("force_limit", "stroke_limit", force_limit=550.5, stroke_limit=99.0)
    assert not client.write_registers(address, words).isError()
    assert client.read_holding_registers(address, count=4).registers == words
    assert served.stand.controller.force_limit_kN == 550.5
    for wrong in ({"force_limit": 601.0, "stroke_limit": 99.0}, {"force_limit": 500.0, "stroke_limit": -1.0}):
        reply = client.write_registers(address, write_block("force_limit", "stroke_limit", **wrong)[1])
        assert reply.exception_code == 3
        assert client.read_holding_registers(address, count=4).registers == words
        assert served.stand.controller.force_limit_kN == 550.5
        assert served.stand.controller.stroke_limit_mm == 99.0


def test_watchdog_registers(served: Served, client: ModbusTcpClient) -> None:
    client.write_register(98, 1500)
    client.write_register(97, 17)
    assert served.stand.controller.watchdog.time_ms == 1500
    assert status(client)["watchdog_remaining"] == 1500
    assert client.read_holding_registers(97, count=2).registers == [17, 1500]


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        (bytes.fromhex("01 0000 0001"), "81 01"),  # coils are not served
        (bytes.fromhex("04 0000 0001"), "84 01"),  # everything lies in the holding table
        (bytes.fromhex("03 000b 0001"), "83 02"),  # no such address
        (bytes.fromhex("03 fff0 0020"), "83 02"),  # beyond the last
        (bytes.fromhex("03 0000 0000"), "83 03"),
        (bytes.fromhex("03 0000 007e"), "83 03"),
        (bytes.fromhex("03 0000"), "83 03"),  # cut short
        (bytes.fromhex("06 0000 0001"), "86 02"),  # read only
        (bytes.fromhex("06 0104 0001"), "86 02"),  # the ring's window is read only
        (bytes.fromhex("10 0040 0002 04 0001"), "90 03"),  # byte count and data differ
        (bytes.fromhex("10 0040 0002 03 0001"), "90 03"),
        (bytes.fromhex("17 0000 0001 0104 0001 02 0000"), "97 02"),  # write part refused
        (bytes.fromhex("17 000b 0001 0060 0001 02 000f"), "97 02"),  # read part refused: nothing written
        (bytes.fromhex("17 0000 0000 0100 0002 04 0000 0000"), "97 03"),
        (bytes.fromhex("17 0000 0001 0060 0001 03 000f"), "97 03"),  # byte count and data differ
        (bytes.fromhex("06 0060"), "86 03"),  # cut short
        (bytes.fromhex("18 0000"), "98 01"),
        (bytes.fromhex("08 0000 0001"), "88 01"),  # pymodbus would echo it
        (bytes.fromhex("16 0060 0000 000f"), "96 01"),  # … and do this one
        (bytes.fromhex("05 0060 ff00"), "85 01"),
        (bytes.fromhex("2b 0e 01 00"), "ab 01"),
        (bytes.fromhex("63"), "e3 01"),
    ],
)
def test_what_cannot_be_is_refused_with_its_code(served: Served, request_: bytes, reply: str) -> None:
    with raw(served.port) as wire:
        wire.sendall(framed(request_, 0x1234))
        assert receive(wire, 9) == struct.pack(">HHHB", 0x1234, 0, 3, 1) + bytes.fromhex(reply)
        wire.sendall(framed(READ_ONE))  # and the connection is as good as before
        assert receive(wire, 11)[7:] == bytes.fromhex("03 02 42 53")
    assert not served.stand.controller.valve_on
    assert True not in served.acting


READ_ONE = bytes.fromhex("03 0000 0001")
SWITCH_ON = bytes.fromhex("06 0060 000f")


def framed(request: bytes, transaction: int = 0, unit: int = 1) -> bytes:
    return struct.pack(">HHHB", transaction, 0, len(request) + 1, unit) + request


def raw(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=60)


def receive(wire: socket.socket, length: int) -> bytes:
    data = b""
    while len(data) < length:
        piece = wire.recv(length - len(data))
        assert piece, f"closed after {data!r}"
        data += piece
    return data


def assert_silent(wire: socket.socket) -> None:
    wire.setblocking(False)
    with pytest.raises(BlockingIOError):
        wire.recv(1)
    wire.settimeout(10)


def test_torn_requests_are_each_answered_once(served: Served) -> None:
    """However TCP cuts a request; one at a time, as a Modbus client is to ask."""
    with raw(served.port) as wire:
        for number in range(1, 12):
            request = framed(READ_ONE, number)
            wire.sendall(request[:number])
            wire.sendall(request[number:])
            assert receive(wire, 11) == struct.pack(">HHHB", number, 0, 5, 1) + bytes.fromhex("03 02 42 53")


def test_pipelined_requests_are_each_answered_in_order(served: Served) -> None:
    """All are answered, in order; the server of pymodbus answers only the first."""
    with raw(served.port) as wire:
        wire.sendall(b"".join(framed(READ_ONE, number) for number in range(1, 6)))
        assert [receive(wire, 11)[:2] for _ in range(5)] == [struct.pack(">H", n) for n in range(1, 6)]
        assert_silent(wire)


@pytest.mark.slow
@pytest.mark.parametrize("unit", [0, 2, 255])
@pytest.mark.parametrize("request_", [READ_ONE, SWITCH_ON, bytes.fromhex("03 fff0 0001")])
def test_another_unit_is_not_there(served: Served, unit: int, request_: bytes) -> None:
    with raw(served.port) as wire:
        wire.sendall(framed(request_, 1, unit))
        assert receive(wire, 9) == struct.pack(">HHHB", 1, 0, 3, unit) + bytes((request_[0] | 0x80, 0x0B))
    assert not served.stand.controller.valve_on


@pytest.mark.slow
def test_what_is_not_modbus_is_hung_up_on(served: Served) -> None:
    with raw(served.port) as wire:
        wire.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert wire.recv(100) == b""


@pytest.mark.slow
@pytest.mark.parametrize("torn", [0, 5])
def test_a_cut_link_is_deaf_and_dumb_and_comes_back(served: Served, torn: int) -> None:
    """What was sent into the cut is neither done nor answered, also not later."""
    with raw(served.port) as wire, raw(served.port) as other:
        other.sendall(framed(READ_ONE))
        receive(other, 11)
        wire.sendall(framed(SWITCH_ON, 3)[:torn])
        served.cut = True
        wire.sendall(framed(SWITCH_ON, 3)[torn:])
        served.settle()
        assert_silent(wire)
        served.cut = False
        served.settle()
        wire.sendall(framed(READ_ONE, 4))
        assert receive(wire, 11) == struct.pack(">HHHB", 4, 0, 5, 1) + bytes.fromhex("03 02 42 53")
        assert not served.stand.controller.valve_on
        wire.sendall(framed(SWITCH_ON, 5))
        assert receive(wire, 12)[7:] == SWITCH_ON
        assert served.stand.controller.valve_on


@pytest.mark.slow
def test_a_link_cut_as_a_request_is_done_does_nothing_and_says_nothing(served: Served) -> None:
    served.cut_by_catching_up = True
    with raw(served.port) as wire:
        wire.sendall(framed(SWITCH_ON))
        served.settle()
        assert_silent(wire)
    assert served.acting == [True]
    assert not served.stand.controller.valve_on


@pytest.mark.slow
def test_a_second_implementation_agrees(served: Served) -> None:
    """pyModbusTCP: reads, single and multiple writes, FC23 (its own encoding of each)."""
    served.per_request = 20
    client = ModbusClient(host="127.0.0.1", port=served.port, unit_id=1, timeout=60, auto_open=True)
    assert client.read_holding_registers(0, 2) == [0x4253, 3]
    assert client.write_single_register(96, 0x000F)
    address, words = write_block(
        "command_sequence", "static_pause", command_sequence=3, command_code=2, target=10.0, speed=100.0
    )
    assert client.write_multiple_registers(address, words)
    assert client.write_single_register(84, 3)
    for _ in range(30):
        block = client.read_holding_registers(16, 22)
    values = RING.block("status_word", "tick").decode(block)
    assert (values["done_sequence"], values["fault_code"]) == (3, ControllerFault.NONE)
    window = client.write_read_multiple_registers(256, RING.encode("ring_acknowledge", 100), 260, 121)
    assert RING.ring_header.decode(window[:9])["first_sequence"] == 100
    assert client.read_holding_registers(11, 1) is None
    assert client.last_except == 2
    client.close()


@pytest.mark.slow
@pytest.mark.parametrize("port", ["taken", 70_000])
def test_a_port_that_cannot_be_had_is_said(served: Served, port: int | str) -> None:
    wanted = served.port if isinstance(port, str) else port

    async def start() -> None:
        bank = RegisterBank(served.stand, RING)
        await ModbusStandServer(Responder(bank, bool, lambda: False), 1).start("127.0.0.1", wanted)

    with pytest.raises(BadInput, match=rf"cannot listen on 127\.0\.0\.1:{wanted}.*0: a free one"):
        asyncio.run(start())


@pytest.mark.slow
def test_a_request_catches_up_once_and_acts_only_if_it_writes(served: Served) -> None:
    """Acknowledging is no act, and the echo of a single write needs no newer sample."""
    exchange = bytes.fromhex("17 0104 0079 0100 0002 04 0000 0000")
    with raw(served.port) as wire:
        for request_, length in ((READ_ONE, 11), (SWITCH_ON, 12), (exchange, 251)):
            wire.sendall(framed(request_))
            receive(wire, length)
    assert served.acting == [False, True, False]


LITTLE = (Path(__file__).parents[3] / "drivers/register_maps/profiles/ring.toml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_another_map_with_little_words_works_alike(tmp_path: Path) -> None:
    text = LITTLE.replace('word_order = "big"', 'word_order = "little"').replace(
        "address = 84", "address = 86"
    )
    (tmp_path / "other.toml").write_text(text, encoding="utf-8")
    profile = load_profile("other.toml", tmp_path)
    stand = device(tmp_path)
    bank = RegisterBank(stand, profile)
    assert profile.decode("test_float", bank.read(2, 2)) == -1234.5
    assert bank.read(4, 2) == [0x5678, 0x1234]
    stand.advance(20)
    bank.write(256, profile.encode("ring_acknowledge", 3))
    window = bank.read(260, 121)
    rows = profile.ring_sample.decode_rows(window[9:121], 14)
    assert rows["tick"].tolist() == [1000 * n for n in range(4, 18)]


@pytest.mark.slow
def test_a_map_of_what_is_not_measured_is_refused(tmp_path: Path) -> None:
    text = LITTLE.replace('"command:i16"', '"command:i16", "current:i16"')
    (tmp_path / "other.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match="has no channel “current”"):
        RegisterBank(device(tmp_path), load_profile("other.toml", tmp_path))
