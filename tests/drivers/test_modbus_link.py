from __future__ import annotations

import re
import socket
import time
from collections.abc import Iterator

import pytest

from bufferstand.drivers.modbus.link import Exchange, ModbusLink, ModbusRefusal
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.profile import Profile
from bufferstand.foundation.errors import DeviceFault, WireLost
from tests.drivers import servers
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import RawServer, raw_server

TIMEOUT_S = 0.25


@pytest.fixture
def server(profile: Profile) -> Iterator[RawServer]:
    with raw_server(RingDevice(profile)) as raw:
        yield raw


@pytest.fixture
def link(server: RawServer) -> Iterator[ModbusLink]:
    one = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=TIMEOUT_S)
    yield one
    one.close()


def test_nothing_happens_on_a_good_wire(link: ModbusLink, server: RawServer) -> None:
    assert link.read(0, 2, "identity") == [0x4253, 3]
    link.write(97, [7], "heartbeat")
    link.write(100, [1, 2, 3, 4], "limits")
    assert link.read(100, 4, "limits") == [1, 2, 3, 4]
    assert link.exchange(Exchange(97, 2, 98, (500,), "both")) == [
        7,
        500,
    ]
    assert server.connections == 1
    assert link.events() == []


def test_nodelay_is_set(link: ModbusLink) -> None:
    link.open()
    assert link._client is not None
    wire = link._client.socket
    assert wire is not None
    assert wire.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0


@pytest.mark.parametrize(
    ("reply", "doubt"),
    [
        (servers.silent, "no reply within 0.25 s"),
        (servers.late(3 * TIMEOUT_S), "no reply within 0.25 s"),
        (servers.dropped, "the device closed the connection"),
        (servers.half_a_frame, "no reply within 0.25 s"),
        (servers.one_register_less, "the reply has 1 registers instead of 2"),
        (servers.with_function(4), "the reply has function code 4 instead of 3"),
        (servers.other_transaction, "no reply within 0.25 s"),
        (servers.garbled, "the reply cannot be decoded"),
    ],
)
class TestDoubt:
    def test_once_is_mended_on_a_new_connection_and_told(
        self, link: ModbusLink, server: RawServer, reply: servers.Reply, doubt: str
    ) -> None:
        link.open()
        server.replies = [reply]
        assert link.read(0, 2, "identity") == [0x4253, 3]
        assert server.connections == 2
        first, second = link.events()
        assert first.startswith(f"reading identity (FC3, 2 registers from 0): {doubt}")
        assert first.endswith("connection closed, sent once more on a new connection")
        assert second == f"connection to controller at {link.address} opened again"
        assert link.read(4, 2, "test value") == [0x1234, 0x5678]  # a late reply is not taken for this one
        assert link.events() == []

    def test_twice_is_a_fault_that_names_device_and_request(
        self, link: ModbusLink, server: RawServer, reply: servers.Reply, doubt: str
    ) -> None:
        server.replies = [reply, reply]
        with pytest.raises(DeviceFault, match=re.escape(doubt)) as caught:
            link.read(0, 2, "identity")
        text = str(caught.value)
        assert text.startswith(f"controller at 127.0.0.1:{server.port} unit 1: reading identity (FC3")
        assert text.endswith(
            "twice; look at the network cable, the controller's load, "
            "and whether a second program talks to it"
        )
        assert link.events()[-1].endswith("connection closed, given up")
        assert len(server.requests) == 2


def test_wrong_echo_of_a_write_is_a_doubt(link: ModbusLink, server: RawServer) -> None:
    server.replies = [servers.other_echo]
    link.write(97, [6], "heartbeat")
    assert link.events()[0].startswith(
        "writing heartbeat (FC6, 6 to 97): the reply echoes (97, 7) instead of (97, 6)"
    )
    server.replies = [servers.other_echo]
    link.write(100, [1, 2], "limits")
    assert "the reply echoes (100, 3) instead of (100, 2)" in link.events()[0]


def test_an_exception_is_an_answer_not_a_doubt(link: ModbusLink, server: RawServer) -> None:
    server.replies = [servers.with_exception(2)]
    with pytest.raises(
        ModbusRefusal, match=r"refused with Modbus exception 2 \(illegal data address\)"
    ) as caught:
        link.read(0, 2, "identity")
    assert caught.value.code == 2
    assert "look at the register profile" in str(caught.value)
    assert len(server.requests) == 1
    assert server.connections == 1
    assert link.events() == []


def test_an_exception_to_another_function_is_a_doubt(link: ModbusLink, server: RawServer) -> None:
    server.replies = [servers.with_function(0x86)]
    assert link.read(0, 2, "identity") == [0x4253, 3]
    assert "the reply has function code 134 instead of 3" in link.events()[0]


def test_every_wait_is_bounded(link: ModbusLink, server: RawServer) -> None:
    server.replies = [servers.silent] * 2
    start_s = time.monotonic()
    with pytest.raises(DeviceFault, match="no reply"):
        link.read(0, 2, "identity")
    assert time.monotonic() - start_s < 30 * TIMEOUT_S  # two waits of one timeout; room for a busy machine


@pytest.mark.slow
def test_nobody_listens(profile: Profile) -> None:
    with raw_server(RingDevice(profile)) as server:
        port = server.port
    link = ModbusLink(TcpWire("127.0.0.1", port), timeout_s=TIMEOUT_S)
    with pytest.raises(DeviceFault, match="cannot connect: Connection refused; is its Modbus server"):
        link.open()
    link.close()


@pytest.mark.slow
def test_the_server_goes_away_and_comes_back(profile: Profile) -> None:
    device = RingDevice(profile)
    with raw_server(device) as server:
        link = ModbusLink(TcpWire("127.0.0.1", server.port), timeout_s=TIMEOUT_S)
        assert link.read(0, 1, "type") == [0x4253]
    with pytest.raises(DeviceFault, match="cannot connect"):
        link.read(0, 1, "type")
    with pytest.raises(DeviceFault, match="cannot connect"):  # and again: no state is left behind
        link.read(0, 1, "type")
    assert "the device closed the connection" in link.events()[0]
    link.close()
    link.close()


@pytest.mark.slow
def test_close_is_followed_by_a_fresh_start(link: ModbusLink, server: RawServer) -> None:
    link.open()
    link.close()
    assert link.read(0, 1, "type") == [0x4253]
    assert server.connections == 2
    assert link.events() == []


# --- a wire that is lost ----------------------------------------------------------------------------


def lose(link: ModbusLink, server: RawServer) -> None:
    """Let a request be given up."""
    server.replies = [servers.silent] * 2
    with pytest.raises(WireLost):
        link.read(0, 2, "identity")
    assert link.is_lost


@pytest.mark.slow
def test_a_lost_wire_is_asked_once_a_time_until_it_answers(link: ModbusLink, server: RawServer) -> None:
    link.read(0, 2, "identity")
    lose(link, server)
    told = len(link.events())
    for tries in range(1, 4):
        before = len(server.requests)
        server.replies = [servers.silent]
        with pytest.raises(WireLost, match="no reply within"):
            link.write(97, [tries], "heartbeat")
        assert len(server.requests) == before + 1
    assert told > 0
    assert not [event for event in link.events() if "closed" in event], "it was said when it began"
    link.write(97, [9], "heartbeat")
    assert not link.is_lost
    server.replies = [servers.silent]
    assert link.read(0, 2, "identity") == [0x4253, 3], "twice again"


@pytest.mark.slow
def test_each_try_waits_a_little_longer_up_to_the_timeout(link: ModbusLink, server: RawServer) -> None:
    link.read(0, 2, "identity")
    lose(link, server)
    waits = []
    for _ in range(9):
        waits.append(link._patience_s(hurry=False))
        link._tries_lost += 1
    assert waits[0] == pytest.approx(link.patience_s)
    assert waits == sorted(waits)
    assert waits[-1] <= TIMEOUT_S


@pytest.mark.slow
def test_a_refusal_is_an_answer_of_a_wire_that_was_lost(link: ModbusLink, server: RawServer) -> None:
    lose(link, server)
    server.replies = [servers.with_exception(2)]
    with pytest.raises(ModbusRefusal):
        link.read(0, 2, "identity")
    assert not link.is_lost


@pytest.mark.slow
def test_a_stop_that_gets_no_reply_does_not_make_the_next_request_a_hurried_one(
    link: ModbusLink, server: RawServer
) -> None:
    server.replies = [servers.silent]
    with pytest.raises(WireLost):
        link.write(97, [1], "hold", hurry=True)
    assert not link.is_lost
    server.replies = [servers.silent]
    assert link.read(0, 2, "identity") == [0x4253, 3]


@pytest.mark.slow
def test_thousands_of_refused_connections_are_no_overflow() -> None:
    """As within minutes at a controller that is switched off: the wait for a reply is the timeout then."""
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))  # nobody listens
        link = ModbusLink(TcpWire("127.0.0.1", closed.getsockname()[1]), timeout_s=TIMEOUT_S)
        link._tries_lost = 100_000
        with pytest.raises(WireLost, match="cannot connect"):
            link.read(0, 1, "anything")
        assert link._patience_s(hurry=False) == TIMEOUT_S
        link.close()
