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
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Literal

from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.register_message import ReadWriteMultipleRegistersRequest

from bufferstand.drivers.interfaces import NO_REPLY
from bufferstand.drivers.modbus.wires import CannotOpenError, Client, TcpWire, Wire
from bufferstand.foundation import DeviceFault, WireLost

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
BitTable = Literal["coil", "discrete"]
"""Where a bit lies: coils (FC1) or discrete inputs (FC2)."""

Check = Callable[[Sequence[int]], str]
"""Says what is doubtful about registers that were read; empty where nothing is."""

HURRY_S = 0.1
"""A reply is waited for at least so long, in a hurry too [s]: a busy computer delays it."""
GROWS_FOR = 100
"""After so many tries in vain it grows no longer: it is the timeout by far then."""
LONGER = 1.25
"""Each further try on a wire that is lost waits so many times as long."""
_TIMED = 50
"""Replies of late by which the patience of a hurry goes."""
_MOST_EVENTS = 1000
_ILLEGAL_FUNCTION, _WRITE_ONE, _EXCHANGE = 1, 6, 23
_TROUBLE = (ModbusException, OSError, struct.error, ValueError, IndexError)
"""What a wire, or what came over it, raises."""


@dataclass(frozen=True)
class Exchange:
    """One transaction: registers are written, then others are read.

    Parameters
    ----------
    read_address, read_count : int
        What is read.
    write_address : int
        Where is written.
    values : tuple of int
        What is written.
    what : str
        What is exchanged, for messages.
    """

    read_address: int
    read_count: int
    write_address: int
    values: tuple[int, ...]
    what: str

    def __str__(self) -> str:
        """Return what is asked, for messages."""
        return f"exchanging {self.what} (FC23, {self.read_count} registers from {self.read_address})"


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

    Once a request was given up the wire counts as lost, until a true reply comes: what is asked meanwhile is
    sent once and waited for as in a hurry, each time a little longer, so that no moment is missed in which
    the device is there again. A serial line is left alone then, too, but for the writing of one register,
    whose echo is no other's.

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
    read_write : bool
        Whether the device knows function 23. Without it, and where a device refuses it with exception 1
        before it was ever granted, registers are written (FC6, FC16), then read (FC3): two round trips.
    """

    def __init__(
        self,
        wire: Wire,
        *,
        device_id: int = 1,
        timeout_s: float = 0.5,
        name: str = "controller",
        read_write: bool = True,
    ) -> None:
        self.name = name
        self._wire = wire
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._client: Client | None = None
        self._ahead: tuple[Exchange, ModbusPDU] | None = None
        self._kept: tuple[Exchange, ModbusPDU] | None = None
        self._read_write = read_write
        self._granted = False
        self._refusals = 0
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._was_open = False
        self._busy = threading.Lock()
        self._took: deque[float] = deque(maxlen=_TIMED)
        self._tries_lost = 0
        self._unsettled = False

    @property
    def address(self) -> str:
        """Wire and unit, for messages."""
        return f"{self._wire.address} unit {self._device_id}"

    @property
    def bytes_per_s(self) -> float:
        """What the wire can carry."""
        return self._wire.bytes_per_s

    @property
    def now_s(self) -> Callable[[], float]:
        """The wire's clock [s]."""
        return self._wire.now_s

    @property
    def sleep(self) -> Callable[[float], None]:
        """Waits by the wire's clock for so long [s]."""
        return self._wire.sleep

    @property
    def exchanges(self) -> bool:
        """Whether registers are written and read in one round trip (function 23)."""
        return self._read_write

    @property
    def mixes_up_replies(self) -> bool:
        """Whether a late reply can be taken for that to another request: the wire does not number them."""
        return not isinstance(self._wire, TcpWire)

    @property
    def may_answer_early(self) -> bool:
        """Whether a reply may be of before what was written last, and is no other's: no function 23, TCP.

        A PLC's own server writes and reads registers that the program looks at once a scan.
        """
        return not self.exchanges and not self.mixes_up_replies

    @property
    def patience_s(self) -> float:
        """How long a reply is waited for in a hurry [s]: twice as long as the slowest of late."""
        return min(self._timeout_s, max(HURRY_S, 2.0 * max(self._took, default=0.0)))

    @property
    def is_lost(self) -> bool:
        """Whether the last request was given up, and nothing was answered since."""
        return self._tries_lost > 0

    def open(self) -> None:
        """Connect, if not connected.

        Raises
        ------
        WireLost
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

    def read_bits(self, address: int, count: int, what: str, *, table: BitTable) -> list[bool]:
        """Get ``count`` bits (FC1 of coils, FC2 of discrete inputs).

        Parameters
        ----------
        address, count
            0-based wire address of the first bit, and how many.
        what : str
            What is asked for, for messages.
        table : str
            ``coil`` or ``discrete``.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        function = 1 if table == "coil" else 2

        def send(client: Client) -> ModbusPDU:
            if function == 1:
                return client.read_coils(address, count=count, device_id=self._device_id)
            return client.read_discrete_inputs(address, count=count, device_id=self._device_id)

        reply = self._ask(
            f"reading {what} (FC{function}, {count} bits from {address})",
            function,
            send,
            lambda reply: _wrong_bits(reply, count),
        )
        return [bool(bit) for bit in reply.bits[:count]]

    def write(self, address: int, values: Sequence[int], what: str, *, hurry: bool = False) -> None:
        """Set holding registers: FC6 for one, FC16 for several; the echo is checked.

        Parameters
        ----------
        address : int
            0-based wire address of the first register.
        values : sequence of int
            What they shall hold.
        what : str
            What is written, for messages.
        hurry : bool
            Whoever waits has another request to send: a reply is waited for only as long as replies have
            taken of late (:attr:`patience_s`), and the request is sent once.

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
                hurry=hurry,
            )
            return
        self._ask(
            f"writing {what} (FC16, {len(values)} registers from {address})",
            16,
            lambda client: client.write_registers(address, list(values), device_id=self._device_id),
            lambda reply: _wrong_echo((reply.address, reply.count), (address, len(values))),
            hurry=hurry,
        )

    def exchange(self, exchange: Exchange, *, check: Check = _nothing_doubtful) -> list[int]:
        """Set registers and get others, in one transaction (FC23) where the device can: it writes first.

        An exchange that was sent ahead is collected.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        if self._read_write:
            try:
                reply = self._ask(
                    exchange,
                    _EXCHANGE,
                    lambda client: self._exchanged(client, exchange),
                    lambda reply: _wrong_length(reply, exchange.read_count) or check(reply.registers),
                )
            except ModbusRefusal as refusal:
                self._judge_refusal(refusal)
            else:
                self._granted = True
                return list(reply.registers)
        return self._exchange_in_two(exchange, check)

    def _exchanged(self, client: Client, exchange: Exchange) -> ModbusPDU:
        """Send an exchange, unless it was sent ahead, and wait for its reply."""
        kept, self._kept = self._kept, None
        if kept is not None and kept[0] == exchange:
            return kept[1]
        ahead, self._ahead = self._ahead, None
        request = self._send(client, exchange) if ahead is None else ahead[1]
        return self._receive(client, request)

    def _send(self, client: Client, exchange: Exchange) -> ModbusPDU:
        """Send an exchange: what pymodbus does first when it executes a request."""
        request = ReadWriteMultipleRegistersRequest(
            read_address=exchange.read_address,
            read_count=exchange.read_count,
            write_address=exchange.write_address,
            write_registers=list(exchange.values),
            dev_id=self._device_id,
        )
        request.transaction_id = client.transaction.getNextTID()
        client.transaction.pdu_send(request)
        return request

    @staticmethod
    def _receive(client: Client, request: ModbusPDU) -> ModbusPDU:
        """Wait for the reply to a request; those to earlier ones, and to other units, are passed over."""
        return client.transaction.sync_get_response(request.dev_id, request.transaction_id)

    def _exchange_in_two(self, exchange: Exchange, check: Check) -> list[int]:
        """Write, then read; both again after a doubt, since what was written may have been altered."""
        what, doubt = exchange.what, ""
        for _ in range(2):
            self.write(exchange.write_address, exchange.values, what)
            registers = self.read(exchange.read_address, exchange.read_count, what)
            doubt = check(registers)
            if not doubt:
                return registers
            self.distrust(f"{what}: {doubt}; connection closed, written and read once more")
        raise self._fault(f"{what}: {doubt}, twice", "look whether a second program talks to it")

    def _judge_refusal(self, refusal: ModbusRefusal) -> None:
        """Go on without function 23 where the device has refused it twice, and never granted it.

        Raises
        ------
        ModbusRefusal
            If it was refused for another reason, or may have been altered on its way.
        """
        self._refusals += 1
        if refusal.code != _ILLEGAL_FUNCTION or self._granted or self._refusals < 2:
            raise refusal
        self._read_write = False
        self.note(
            f"{self.name} does not know function 23: registers are written, then read (FC16, FC3), which "
            "takes two round trips; [wire] read_write = false in its profile says so beforehand"
        )

    @property
    def trips_of_exchange(self) -> int:
        """Round trips that an exchange takes: two where function 23 is missing."""
        return 1 if self._read_write else 2

    @property
    def clock_doubt_s(self) -> float:
        """By so much at most the clock that a status shows is off from that of the samples [s]: here none."""
        return 0.0

    @property
    def has_asked_ahead(self) -> bool:
        """Whether an exchange was sent ahead: its reply is of before it is asked for."""
        return self._ahead is not None or self._kept is not None

    @property
    def can_ask_ahead(self) -> bool:
        """Whether :meth:`ask_ahead` does something: not on a serial line, not without function 23."""
        return self._read_write and isinstance(self._wire, TcpWire)

    def ask_ahead(self, exchange: Exchange) -> None:
        """Send an exchange that will be asked for next, so that the device works on it meanwhile.

        Its reply is collected before anything else is sent, and kept: one request is under way at most. On a
        serial line, which is the bound itself, without function 23, and where the connection fails, nothing
        is done.
        """
        if self._client is None or self.has_asked_ahead or not self.can_ask_ahead:
            return
        try:
            self._ahead = exchange, self._send(self._client, exchange)
        except _TROUBLE as error:
            self._give_up(exchange, error)

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
        self._tries_lost = 0

    def _drop(self, *, doubtful: bool = False) -> None:
        client, self._client = self._client, None
        self._ahead = self._kept = None
        if client is not None:
            if doubtful:
                self._wire.settle(client, self._timeout_s)
            client.close()  # type: ignore[no-untyped-call]

    def _opened(self, *, settle: bool = True) -> Client:
        """Return the open client; a line on which something may still come is let fall silent, if wanted."""
        if self._client is not None:
            return self._client
        try:
            client = self._wire.open(self._patience_of_connecting_s)
        except CannotOpenError as error:
            self._tries_lost += 1
            raise self._fault(error.problem, error.look) from None
        if self._unsettled and settle:
            self._wire.settle(client, self._timeout_s)
            self._unsettled = False
        self._client = client
        client.comm_params.timeout_connect = client.transaction.comm_params.timeout_connect = self._timeout_s
        if self._was_open:
            self.note(f"connection to {self.name} at {self.address} opened again")
        self._was_open = True
        return client

    @property
    def _patience_of_connecting_s(self) -> float:
        """How long a connection is waited for [s]; on a line it is how long a reply is."""
        hurried = self.is_lost and len(self._took) > 0 and isinstance(self._wire, TcpWire)
        return self.patience_s if hurried else self._timeout_s

    def _patience_s(self, *, hurry: bool) -> float:
        """Return how long a reply is waited for [s]: a little longer with each try on a wire that is lost."""
        if self.is_lost:
            tries = min(self._tries_lost - 1, GROWS_FOR)  # refused connections are thousands of tries
            return min(self._timeout_s, self.patience_s * LONGER**tries)
        return self.patience_s if hurry else self._timeout_s

    def _ask(
        self,
        asked: str | Exchange,
        function: int,
        send: Callable[[Client], ModbusPDU],
        find_doubt: Callable[[ModbusPDU], str],
        *,
        hurry: bool = False,
    ) -> ModbusPDU:
        """Send, check, and send once more on a fresh connection after a doubt; not so in a hurry."""
        if not self._busy.acquire(blocking=False):
            raise RuntimeError(f"two threads use the link to {self.name} at once; a bus has one owner")
        try:
            if self._ahead is not None and self._ahead[0] != asked:
                self._collect_ahead(self.patience_s if hurry else self._timeout_s)
            return self._ask_twice(asked, function, send, find_doubt, hurry=hurry)
        finally:
            self._busy.release()

    def _ask_twice(
        self,
        asked: str | Exchange,
        function: int,
        send: Callable[[Client], ModbusPDU],
        find_doubt: Callable[[ModbusPDU], str],
        *,
        hurry: bool,
    ) -> ModbusPDU:
        lost = self.is_lost
        once, settle = hurry or lost, not (hurry or (lost and function == _WRITE_ONE))
        patience_s, doubt = self._patience_s(hurry=hurry), ""
        for further in ("given up",) if once else ("sent once more on a new connection", "given up"):
            client = self._opened(settle=settle)
            try:
                began_s = self._wire.now_s()
                with _waiting(client, patience_s) if once else nullcontext():
                    reply = send(client)
                doubt = self._refused_or_doubtful(reply, function, asked) or find_doubt(reply)
            except _TROUBLE as error:
                doubt = self._describe(error, patience_s, connected=client.connected)
            if not doubt:
                self._took.append(self._wire.now_s() - began_s)
                self._tries_lost, self._unsettled = 0, False
                return reply
            last = further == "given up"
            self._unsettled = self._unsettled or (last and not hurry)  # before it is opened again
            self._drop(doubtful=not last)
            if not lost:
                self.note(f"{asked}: {doubt}; connection closed, {further}")
        self._tries_lost += not hurry or lost
        cable = "network cable" if isinstance(self._wire, TcpWire) else "serial cable and its termination"
        raise self._fault(
            f"{asked}: {doubt}" if once else f"{asked}: {doubt}, twice",
            f"look at the {cable}, the {self.name}'s load, and whether a second program talks to it",
        )

    def _collect_ahead(self, patience_s: float) -> None:
        """Wait for the reply to a request that was sent ahead, and keep it for that request alone."""
        ahead, self._ahead = self._ahead, None
        if ahead is not None and self._client is not None:
            try:
                with _waiting(self._client, patience_s):
                    self._kept = ahead[0], self._receive(self._client, ahead[1])
            except _TROUBLE as error:
                self._give_up(ahead[0], error)

    def _give_up(self, exchange: Exchange, error: Exception) -> None:
        """Begin afresh after an exchange that was sent ahead has failed; it is sent again when asked for."""
        connected = self._client is not None and self._client.connected
        doubt = self._describe(error, self._timeout_s, connected=connected)
        self.distrust(f"{exchange}: {doubt}; connection closed")

    def _refused_or_doubtful(self, reply: ModbusPDU, function: int, asked: str | Exchange) -> str:
        if reply.isError() and reply.function_code & 0x7F == function:
            self._tries_lost, code = 0, int(reply.exception_code)  # it has answered
            text = EXCEPTION_TEXTS.get(code, "unknown")
            raise ModbusRefusal(
                f"{self.name} at {self.address}: {asked}: refused with Modbus exception {code} ({text}); "
                "look at the register profile and the state of the controller",
                code,
            )
        if reply.function_code != function:
            return f"the reply has function code {reply.function_code} instead of {function}"
        return ""

    @staticmethod
    def _describe(error: Exception, patience_s: float, *, connected: bool) -> str:
        if not connected:
            return "the device closed the connection"
        if isinstance(error, TimeoutError) or "No response" in str(error):
            return f"{NO_REPLY} {patience_s:.3g} s"
        return f"the reply cannot be decoded ({error})"

    def _fault(self, problem: str, look: str) -> WireLost:
        return WireLost(f"{self.name} at {self.address}: {problem}; {look}")


@contextmanager
def _waiting(client: Client, patience_s: float) -> Iterator[None]:
    """Let a client wait so long for the next bytes of a reply, inside."""
    settings = (client.comm_params, client.transaction.comm_params)
    before = [one.timeout_connect for one in settings]
    for one in settings:
        one.timeout_connect = patience_s
    try:
        yield
    finally:
        for one, timeout_s in zip(settings, before, strict=True):
            one.timeout_connect = timeout_s


def _wrong_length(reply: ModbusPDU, count: int) -> str:
    got = len(reply.registers)
    return "" if got == count else f"the reply has {got} registers instead of {count}"


def _wrong_bits(reply: ModbusPDU, count: int) -> str:
    got, whole = len(reply.bits), 8 * ((count + 7) // 8)  # a reply has whole bytes
    return "" if got == whole else f"the reply has {got} bits instead of {whole}"


def _wrong_echo(got: Sequence[int], wanted: Sequence[int]) -> str:
    return "" if tuple(got) == tuple(wanted) else f"the reply echoes {tuple(got)} instead of {tuple(wanted)}"
