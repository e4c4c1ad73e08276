"""One owner of one Modbus wire: bounded waits, checked replies, a fresh start after any doubt.

pymodbus compares neither length nor function of a reply with the request and never closes a silent
connection; both are done here. Every request that goes through here is idempotent (absolute
acknowledgement, sequence-numbered commands, plain values), so each may be sent once more.
"""

from __future__ import annotations

import logging
import struct
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Literal, TypeVar

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

from drivers import packed_exchange
from drivers.modbus_wires import CannotOpenError, Client, TcpWire, Wire
from drivers.packed_exchange import Exchange, PackedPort, PackedReply
from drivers.registers import pack
from foundation.errors import DeviceFault

# What pymodbus logs is said here as events and faults; without a handler Python would print it besides.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

EXCEPTION_TEXTS = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "device failure",
    5: "acknowledge, still working",
    6: "device busy",
    8: "memory parity error",
    10: "gateway path unavailable",
    11: "gateway target does not respond",
}
"""Modbus exception codes (application protocol 1.1b3, 7)."""

Table = Literal["holding", "input"]
"""Where a register lies: holding registers (FC3, FC6, FC16, FC23) or input registers (FC4, read only)."""

Check = Callable[[Sequence[int]], str]
"""Says what is doubtful about registers that were read; empty where nothing is."""

_MOST_EVENTS = 1000
_TROUBLE = (ModbusException, OSError, struct.error, ValueError, IndexError)
"""What a wire, or what came over it, raises."""


_AnyReply = TypeVar("_AnyReply", ModbusPDU, PackedReply)


def _nothing_doubtful(_registers: Sequence[int]) -> str:
    return ""


class ModbusRefusal(DeviceFault):
    """The device answered a request with a Modbus exception; ``code`` is its number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class ModbusLink:
    """Requests and checked replies over one wire, from one thread at a time.

    A request waits at most ``timeout_s`` for a connection and twice ``timeout_s`` for a whole reply (the
    second wait only for a reply that has begun), and is sent at most twice. After a doubt a serial line is
    left alone for ``timeout_s`` (at most three times that) before it is opened again.

    Parameters
    ----------
    wire : Wire
        Network or serial line; this object owns it.
    device_id : int
        Unit identifier.
    timeout_s : float
        Longest wait for a connection or for the next bytes of a reply [s].
    name : str
        What messages call the device.
    """

    def __init__(
        self, wire: Wire, *, device_id: int = 1, timeout_s: float = 0.5, name: str = "controller"
    ) -> None:
        self.name = name
        self._wire = wire
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._client: Client | None = None
        self._port: PackedPort | None = None
        self._ahead: Exchange | None = None
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._was_open = False
        self._busy = threading.Lock()

    @property
    def address(self) -> str:
        """Wire and unit, for messages."""
        return f"{self._wire.address} unit {self._device_id}"

    @property
    def bytes_per_s(self) -> float:
        """What the wire can carry."""
        return self._wire.bytes_per_s

    def open(self) -> None:
        """Connect, if not connected.

        Raises
        ------
        DeviceFault
            If nobody answers there in time.
        """
        self._opened()

    def read(
        self,
        address: int,
        count: int,
        what: str,
        *,
        table: Table = "holding",
        check: Check = _nothing_doubtful,
    ) -> list[int]:
        """Get ``count`` registers (FC3 from the holding table, FC4 from the input table).

        Parameters
        ----------
        address, count
            0-based wire address of the first register, and how many.
        what : str
            What is asked for, for messages.
        table : str
            ``holding`` or ``input``.
        check : callable
            Finds what is doubtful about the registers; they are asked for once more then.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        function = 3 if table == "holding" else 4

        def send(client: Client) -> ModbusPDU:
            if function == 3:
                return client.read_holding_registers(address, count=count, device_id=self._device_id)
            return client.read_input_registers(address, count=count, device_id=self._device_id)

        reply = self._ask(
            f"reading {what} (FC{function}, {count} registers from {address})",
            function,
            send,
            lambda reply: _wrong_length(reply, count) or check(reply.registers),
        )
        return list(reply.registers)

    def write(self, address: int, values: Sequence[int], what: str) -> None:
        """Set holding registers: FC6 for one, FC16 for several; the echo is checked.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        if len(values) == 1:
            value = values[0]
            self._ask(
                f"writing {what} (FC6, {value} to {address})",
                6,
                lambda client: client.write_register(address, value, device_id=self._device_id),
                lambda reply: _wrong_echo((reply.address, *reply.registers), (address, value)),
            )
            return
        self._ask(
            f"writing {what} (FC16, {len(values)} registers from {address})",
            16,
            lambda client: client.write_registers(address, list(values), device_id=self._device_id),
            lambda reply: _wrong_echo((reply.address, reply.count), (address, len(values))),
        )

    def exchange(
        self,
        *,
        read_address: int,
        read_count: int,
        write_address: int,
        values: Sequence[int],
        what: str,
        check: Check = _nothing_doubtful,
    ) -> list[int]:
        """Set registers and get others in one transaction (FC23: the device writes first).

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        asked = f"exchanging {what} (FC23, {read_count} registers from {read_address})"
        reply = self._ask(
            asked,
            23,
            lambda client: client.readwrite_registers(
                read_address=read_address,
                read_count=read_count,
                write_address=write_address,
                values=list(values),
                device_id=self._device_id,
            ),
            lambda reply: _wrong_length(reply, read_count) or check(reply.registers),
        )
        return list(reply.registers)

    def exchange_packed(self, exchange: Exchange) -> bytes:
        """Make an exchange (FC23) whose registers come as bytes; one that was sent ahead is collected.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        if not isinstance(self._wire, TcpWire):
            values = struct.unpack(f">{len(exchange.written) // 2}H", exchange.written)
            return pack(
                self.exchange(
                    read_address=exchange.read_address,
                    read_count=exchange.read_count,
                    write_address=exchange.write_address,
                    values=values,
                    what=exchange.what,
                )
            )
        reply = self._ask(
            exchange,
            packed_exchange.FUNCTION,
            lambda _: self._exchange_packed(exchange),
            lambda reply: reply.find_doubt(exchange.read_count),
        )
        return reply.data[1:]

    @property
    def has_asked_ahead(self) -> bool:
        """Whether an exchange is under way that was sent ahead: its reply is of before it is asked for."""
        return self._ahead is not None

    def ask_ahead(self, exchange: Exchange) -> None:
        """Send an exchange that will be asked for next, so that the device works on it meanwhile.

        Its reply is collected before anything else is sent: one request is under way at most. On a serial
        line, which is the bound itself, and where the connection fails, nothing is done.
        """
        if self._port is None or self._ahead is not None:
            return
        try:
            self._port.send(exchange)
        except _TROUBLE as error:
            self._give_up(exchange, error)
        else:
            self._ahead = exchange

    def distrust(self, text: str) -> None:
        """Note a doubt that was found behind the link, and begin afresh with the next request."""
        self._drop(doubtful=True)
        self.note(text)

    def note(self, text: str) -> None:
        """Keep an event for :meth:`events`."""
        self._events.append(text)

    def events(self) -> list[str]:
        """Get (and forget) what happened since the last call: doubts, retries, reopenings."""
        kept = list(self._events)
        self._events.clear()
        return kept

    def close(self) -> None:
        """Let go of the connection; never raises."""
        self._drop()
        self._was_open = False

    def _drop(self, *, doubtful: bool = False) -> None:
        client, self._client = self._client, None
        self._port = self._ahead = None
        if client is not None:
            if doubtful:
                self._wire.settle(client, self._timeout_s)
            client.close()  # type: ignore[no-untyped-call]

    def _opened(self) -> Client:
        if self._client is not None:
            return self._client
        try:
            client = self._wire.open(self._timeout_s)
        except CannotOpenError as error:
            raise self._fault(error.problem, error.look) from None
        self._client = client
        if isinstance(client, ModbusTcpClient):
            self._port = PackedPort(client, self._device_id, self._timeout_s)
        if self._was_open:
            self.note(f"connection to {self.name} at {self.address} opened again")
        self._was_open = True
        return client

    def _ask(
        self,
        asked: str | Exchange,
        function: int,
        send: Callable[[Client], _AnyReply],
        find_doubt: Callable[[_AnyReply], str],
    ) -> _AnyReply:
        """Send, check, and send once more on a fresh connection after a doubt."""
        if not self._busy.acquire(blocking=False):
            raise RuntimeError(f"two threads use the link to {self.name} at once; a bus has one owner")
        try:
            if self._ahead != asked:
                self._collect_ahead()
            if self._port is not None and not isinstance(asked, Exchange) and not self._port.make_way():
                self.distrust("half a reply lies before the next one; connection closed")
            return self._ask_twice(asked, function, send, find_doubt)
        finally:
            self._busy.release()

    def _ask_twice(
        self,
        asked: str | Exchange,
        function: int,
        send: Callable[[Client], _AnyReply],
        find_doubt: Callable[[_AnyReply], str],
    ) -> _AnyReply:
        doubt = ""
        for attempt in (1, 2):
            client = self._opened()
            try:
                reply = send(client)
                doubt = self._refused_or_doubtful(reply, function, asked) or find_doubt(reply)
            except _TROUBLE as error:
                doubt = self._describe(error, connected=client.connected)
            if not doubt:
                return reply
            self._drop(doubtful=True)
            further = "sent once more on a new connection" if attempt == 1 else "given up"
            self.note(f"{asked}: {doubt}; connection closed, {further}")
        cable = "network cable" if isinstance(self._wire, TcpWire) else "serial cable and its termination"
        raise self._fault(
            f"{asked}: {doubt}, twice",
            f"look at the {cable}, the {self.name}'s load, and whether a second program talks to it",
        )

    def _exchange_packed(self, exchange: Exchange) -> PackedReply:
        """Send an exchange, unless it was sent ahead, and wait for its reply."""
        port = self._port
        if port is None:
            raise OSError("the connection is closed")
        ahead, self._ahead = self._ahead, None
        if ahead is None:
            port.send(exchange)
        return port.receive()

    def _collect_ahead(self) -> None:
        """Let the reply to what was sent ahead come: nobody wants it, but it is not to meet another's."""
        ahead, self._ahead = self._ahead, None
        if ahead is not None and self._port is not None:
            try:
                self._port.receive()
            except _TROUBLE as error:
                self._give_up(ahead, error)

    def _give_up(self, exchange: Exchange, error: Exception) -> None:
        """Begin afresh after an exchange that was sent ahead has failed; it is sent again when asked for."""
        connected = self._client is not None and self._client.connected
        self.distrust(f"{exchange}: {self._describe(error, connected=connected)}; connection closed")

    def _refused_or_doubtful(
        self, reply: ModbusPDU | PackedReply, function: int, asked: str | Exchange
    ) -> str:
        if reply.isError() and reply.function_code & 0x7F == function:
            code = int(reply.exception_code)
            text = EXCEPTION_TEXTS.get(code, "unknown")
            raise ModbusRefusal(
                f"{self.name} at {self.address}: {asked}: refused with Modbus exception {code} ({text}); "
                "look at the register profile and the state of the controller",
                code,
            )
        if reply.function_code != function:
            return f"the reply has function code {reply.function_code} instead of {function}"
        return ""

    def _describe(self, error: Exception, *, connected: bool) -> str:
        if not connected:
            return "the device closed the connection"
        if isinstance(error, ModbusException) and "No response" in str(error):
            return f"no reply within {self._timeout_s:g} s"
        return f"the reply cannot be decoded ({error})"

    def _fault(self, problem: str, look: str) -> DeviceFault:
        return DeviceFault(f"{self.name} at {self.address}: {problem}; {look}")


def _wrong_length(reply: ModbusPDU, count: int) -> str:
    got = len(reply.registers)
    return "" if got == count else f"the reply has {got} registers instead of {count}"


def _wrong_echo(got: Sequence[int], wanted: Sequence[int]) -> str:
    return "" if tuple(got) == tuple(wanted) else f"the reply echoes {tuple(got)} instead of {tuple(wanted)}"
