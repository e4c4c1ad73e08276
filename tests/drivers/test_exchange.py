"""FC23, also asked ahead: no doubtful, late or doubled reply is taken for the true one."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Iterator

import numpy as np
import pytest

from bufferstand.drivers.controllers.ring_controller import AHEAD_S, BEHIND_BLOCKS, RingController
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.modbus.link import Exchange, ModbusLink, ModbusRefusal
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers import servers
from tests.drivers.clocks import HandClock
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.profiles import plain_ring
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import RawServer, raw_server

TIMEOUT_S = 0.25
CHANNELS = load_stand(SAMPLE_STAND).controller.channel


@pytest.fixture
def device(profile: Profile) -> RingDevice:
    return RingDevice(profile)


@pytest.fixture
def server(device: RingDevice) -> Iterator[RawServer]:
    with raw_server(device) as raw:
        yield raw


@pytest.fixture
def link(server: RawServer) -> Iterator[ModbusLink]:
    one = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=TIMEOUT_S)
    yield one
    one.close()


def both(value: int) -> Exchange:
    """Write the watchdog's time, read it with the register before it."""
    return Exchange(97, 2, 98, (value,), "both")


def test_it_writes_then_reads(link: ModbusLink, server: RawServer) -> None:
    assert link.exchange(both(500)) == [0, 500]
    assert link.exchange(both(600)) == [0, 600]
    assert link.read(98, 1, "time") == [600]
    assert server.connections == 1
    assert link.events() == []


def other_unit(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(servers.framed(header[:6] + bytes([header[6] ^ 3]), pdu))


def other_protocol(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(servers.framed(header[:2] + b"\0\7" + header[4:], pdu))


@pytest.mark.parametrize("ahead", [False, True])
@pytest.mark.parametrize(
    ("reply", "doubt"),
    [
        (servers.silent, "no reply within 0.25 s"),
        (servers.late(3 * TIMEOUT_S), "no reply within 0.25 s"),
        (servers.dropped, "the device closed the connection"),
        (servers.half_a_frame, "no reply within 0.25 s"),
        (servers.one_register_less, "the reply has 1 registers instead of 2"),
        (servers.with_function(3), "the reply has function code 3 instead of 23"),
        (servers.other_transaction, "no reply within 0.25 s"),
        (servers.garbled, "the reply cannot be decoded"),
        (other_unit, "no reply within 0.25 s"),
        (other_protocol, "no reply within 0.25 s"),
    ],
)
def test_a_doubt_is_mended_on_a_new_connection_and_told(
    link: ModbusLink, server: RawServer, reply: servers.Reply, doubt: str, *, ahead: bool
) -> None:
    link.open()
    server.replies = [reply]
    if ahead:
        link.ask_ahead(both(700))
    assert link.exchange(both(700)) == [0, 700]
    assert server.connections == 2
    first, second = link.events()
    assert first.startswith(f"exchanging both (FC23, 2 registers from 97): {doubt}")
    assert first.endswith("connection closed, sent once more on a new connection")
    assert second == f"connection to controller at {link.address} opened again"
    assert link.exchange(both(800)) == [0, 800]  # a late reply is not taken for this one
    assert link.events() == []


def test_twice_is_a_fault(link: ModbusLink, server: RawServer) -> None:
    server.replies = [servers.one_register_less] * 2
    with pytest.raises(DeviceFault, match=re.escape("1 registers instead of 2, twice; look at the network")):
        link.exchange(both(1))
    assert len(server.requests) == 2


@pytest.mark.parametrize("ahead", [False, True])
def test_an_exception_is_an_answer(link: ModbusLink, server: RawServer, *, ahead: bool) -> None:
    link.open()
    server.replies = [servers.with_exception(3)]
    if ahead:
        link.ask_ahead(both(2))
    with pytest.raises(ModbusRefusal, match=r"FC23.*refused with Modbus exception 3 \(illegal data value\)"):
        link.exchange(both(2))
    assert server.connections == 1
    assert link.exchange(both(3)) == [0, 3]


class TestAhead:
    def test_it_is_sent_once(self, link: ModbusLink, server: RawServer) -> None:
        link.open()
        link.ask_ahead(both(500))
        link.ask_ahead(both(600))  # one at a time: this is not sent
        assert link.has_asked_ahead
        assert link.exchange(both(500)) == [0, 500]
        assert not link.has_asked_ahead
        assert len(server.requests) == 1

    def test_its_reply_is_not_that_of_another(self, link: ModbusLink, server: RawServer) -> None:
        link.open()
        link.ask_ahead(both(500))
        assert link.exchange(both(600)) == [0, 600]
        link.ask_ahead(both(700))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        assert link.exchange(both(700)) == [0, 700]
        assert [request[0] for request in server.requests] == [23, 23, 23, 3], "it was kept for who asks"
        assert server.connections == 1
        assert link.events() == []

    def test_what_was_kept_is_not_the_reply_of_another(self, link: ModbusLink, server: RawServer) -> None:
        link.open()
        link.ask_ahead(both(500))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        assert link.has_asked_ahead, "it is of before it is asked for"
        assert link.exchange(both(600)) == [0, 600]
        assert not link.has_asked_ahead
        assert link.exchange(both(500)) == [0, 500]
        assert [request[0] for request in server.requests] == [23, 3, 23, 23]

    @pytest.mark.parametrize("ends", ["closing", "distrust"])
    def test_what_was_kept_ends_with_the_connection(
        self, link: ModbusLink, server: RawServer, ends: str
    ) -> None:
        link.open()
        link.ask_ahead(both(500))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        if ends == "closing":
            link.close()
        else:
            link.distrust("for a try")
        assert not link.has_asked_ahead
        assert link.exchange(both(500)) == [0, 500]
        assert server.connections == 2

    @pytest.mark.parametrize("reply", [servers.one_register_less, servers.garbled])
    def test_a_doubtful_reply_that_was_kept_is_asked_for_anew(
        self, link: ModbusLink, server: RawServer, reply: servers.Reply
    ) -> None:
        link.open()
        server.replies = [reply]
        link.ask_ahead(both(500))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        assert link.exchange(both(500)) == [0, 500]
        assert server.connections == 2

    def test_one_request_is_under_way_at_most(self, link: ModbusLink, server: RawServer) -> None:
        came_early: list[bytes] = []

        def slowly(wire: socket.socket, header: bytes, pdu: bytes) -> None:
            time.sleep(0.3 * TIMEOUT_S)
            try:
                came_early.append(wire.recv(300, socket.MSG_PEEK | socket.MSG_DONTWAIT))
            except BlockingIOError:
                servers.truly(wire, header, pdu)

        link.open()
        server.replies = [slowly, slowly]
        link.ask_ahead(both(500))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        assert came_early == []
        assert link.events() == []

    @pytest.mark.parametrize("reply", [servers.silent, servers.dropped, servers.late(3 * TIMEOUT_S)])
    def test_what_fails_does_not_strike_the_next(
        self, link: ModbusLink, server: RawServer, reply: servers.Reply
    ) -> None:
        link.open()
        server.replies = [reply]
        link.ask_ahead(both(500))
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]
        first, second = link.events()
        assert first.startswith("exchanging both (FC23, 2 registers from 97): ")
        assert first.endswith("; connection closed")
        assert second.endswith("opened again")
        assert server.connections == 2

    def test_closing_forgets_it(self, link: ModbusLink, server: RawServer) -> None:
        link.open()
        link.ask_ahead(both(500))
        link.close()
        assert not link.has_asked_ahead
        assert link.exchange(both(600)) == [0, 600]
        assert server.connections == 2
        assert link.events() == []

    def test_a_connection_that_is_gone_is_no_fault_yet(self, device: RingDevice) -> None:
        with raw_server(device) as server:
            link = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=TIMEOUT_S)
            link.open()
        for _ in range(2):  # the first is sent into the void, the second is not sent
            link.ask_ahead(both(1))
        with pytest.raises(DeviceFault, match="cannot connect"):
            link.exchange(both(1))
        link.ask_ahead(both(1))  # closed: nothing is done
        assert not link.has_asked_ahead
        link.close()


def doubled(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    wire.sendall(2 * servers.framed(header, pdu))


def one_and_a_half(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    frame = servers.framed(header, pdu)
    wire.sendall(frame + frame[: len(frame) // 2])


def one_then_half(wire: socket.socket, header: bytes, pdu: bytes) -> None:
    """Between the two the first is read: what comes then lies before the next reply."""
    frame = servers.framed(header, pdu)
    wire.sendall(frame)
    time.sleep(0.3 * TIMEOUT_S)
    wire.sendall(frame[: len(frame) // 2])


def test_a_doubled_reply_is_passed_over(link: ModbusLink, server: RawServer) -> None:
    server.replies = [doubled, doubled]
    assert link.exchange(both(500)) == [0, 500]
    assert link.exchange(both(600)) == [0, 600]
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert server.connections == 1
    assert link.events() == []


@pytest.mark.parametrize("ahead", [False, True])
@pytest.mark.parametrize("reply", [one_and_a_half, one_then_half])
def test_half_a_reply_is_not_read_as_the_next(
    link: ModbusLink, server: RawServer, reply: servers.Reply, *, ahead: bool
) -> None:
    link.open()
    server.replies = [reply]
    if ahead:
        link.ask_ahead(both(500))
    else:
        link.exchange(both(500))
    time.sleep(0.6 * TIMEOUT_S)
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]
    assert link.read(4, 2, "test value") == [0x1234, 0x5678]


def test_bytes_that_trickle_in_make_one_reply(link: ModbusLink, server: RawServer) -> None:
    def trickle(wire: socket.socket, header: bytes, pdu: bytes) -> None:
        frame = servers.framed(header, pdu)
        for at in range(len(frame)):
            wire.sendall(frame[at : at + 1])
            time.sleep(0.002)

    server.replies = [trickle]
    assert link.exchange(both(500)) == [0, 500]
    assert link.events() == []


def drain(controller: RingController) -> list[SampleBlock]:
    blocks = []
    while (block := controller.read_block()) is not None:
        blocks.append(block)
    return blocks


class TestRing:
    @pytest.fixture
    def controller(self, link: ModbusLink, profile: Profile) -> RingController:
        controller = RingController(link, profile, CHANNELS, WallClock(), timeout_s=TIMEOUT_S)
        controller.connect()
        return controller

    def test_behind_a_full_block_the_next_is_asked_for(
        self, device: RingDevice, link: ModbusLink, profile: Profile
    ) -> None:
        # The clock stands: however busy this computer is, the wire is taken for a quick one.
        controller = RingController(link, profile, CHANNELS, HandClock(), timeout_s=TIMEOUT_S)
        controller.connect()
        device.sample(20)
        controller.read_block()
        assert link.has_asked_ahead
        controller.read_block()
        assert not link.has_asked_ahead

    def test_over_a_slow_wire_only_behind_several_full_blocks(
        self, controller: RingController, device: RingDevice, link: ModbusLink, server: RawServer
    ) -> None:
        slow = servers.late(2.0 * AHEAD_S)
        for samples, ahead in ((14 * BEHIND_BLOCKS - 1, False), (14 * BEHIND_BLOCKS, True)):
            device.sample(samples)
            server.replies = [slow] * BEHIND_BLOCKS
            for _ in range(BEHIND_BLOCKS):
                assert not link.has_asked_ahead
                controller.read_block()
            assert link.has_asked_ahead is ahead
            assert controller.read_block() is None

    def test_none_is_of_this_call(self, controller: RingController, device: RingDevice) -> None:
        device.sample(14)
        controller.read_block()  # the next was asked for when there were none
        device.sample(3)
        block = controller.read_block()
        assert block is not None
        assert len(block.time_us) == 3

    def test_a_status_between_blocks_costs_no_sample(
        self, controller: RingController, device: RingDevice
    ) -> None:
        device.sample(100)
        blocks = []
        while (block := controller.read_block()) is not None:
            blocks.append(block)
            controller.status()
        got = np.concatenate([block.time_us for block in blocks])
        np.testing.assert_array_equal(got, np.arange(100) * 1000)
        assert controller.events() == []

    @pytest.mark.parametrize("turn", range(4))
    @pytest.mark.parametrize(
        "reply", [servers.silent, servers.dropped, servers.late(3 * TIMEOUT_S), doubled, one_and_a_half]
    )
    def test_nothing_is_lost_or_doubled_whichever_reply_fails(
        self,
        controller: RingController,
        device: RingDevice,
        server: RawServer,
        reply: servers.Reply,
        turn: int,
    ) -> None:
        device.sample(50)
        server.replies = [*[servers.truly] * turn, reply]
        blocks = drain(controller)
        assert [block.lost for block in blocks] == [0] * len(blocks)
        got = np.concatenate([block.time_us for block in blocks])
        np.testing.assert_array_equal(got, np.arange(50) * 1000)

    @pytest.mark.slow
    def test_without_a_crc_nothing_is_asked_ahead(self) -> None:
        """Only its ticks tell a torn block then, and they are looked at last."""
        profile = plain_ring()
        device = RingDevice(profile)
        device.sample(100)
        with raw_server(device) as server:
            link = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=TIMEOUT_S)
            controller = RingController(link, profile, CHANNELS, WallClock(), timeout_s=TIMEOUT_S)
            controller.connect()
            controller.read_block()
            assert not link.has_asked_ahead
            controller.close()
