"""One owner of one Modbus TCP connection: bounded waits, checked replies, a fresh connection after any doubt.

pymodbus compares neither length nor function of a reply with the request and never closes a silent
connection; both are done here. Every request that goes through here is idempotent (absolute
acknowledgement, sequence-numbered commands, plain values), so each may be sent once more.
"""

from __future__ import annotations

import logging
import socket
import struct
from collections import deque
from collections.abc import Callable, Sequence

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

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

_MOST_EVENTS = 1000


class ModbusRefusal(DeviceFault):
    """The device answered a request with a Modbus exception; ``code`` is its number."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.code = code


class ModbusLink:
    """Requests and checked replies over one connection, from one thread.

    A request waits at most ``timeout_s`` for a connection and twice ``timeout_s`` for a whole reply (the
    second wait only for a reply that has begun), and is sent at most twice.

    Parameters
    ----------
    host, port
        Of the Modbus TCP server.
    device_id : int
        Unit identifier.
    timeout_s : float
        Longest wait for a connection or for the next bytes of a reply [s].
    name : str
        What messages call the device.
    """

    def __init__(
        self, host: str, port: int, *, device_id: int = 1, timeout_s: float = 0.5, name: str = "controller"
    ) -> None:
        self.name = name
        self._host = host
        self._port = port
        self._device_id = device_id
        self._timeout_s = timeout_s
        self._client: ModbusTcpClient | None = None
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._was_open = False

    @property
    def address(self) -> str:
        """``host:port`` and unit, for messages."""
        return f"{self._host}:{self._port} unit {self._device_id}"

    def open(self) -> None:
        """Connect, if not connected.

        Raises
        ------
        DeviceFault
            If nobody answers there in time.
        """
        self._opened()

    def read(self, address: int, count: int, what: str) -> list[int]:
        """Get ``count`` holding registers (FC3).

        Parameters
        ----------
        address, count
            0-based wire address of the first register, and how many.
        what : str
            What is asked for, for messages.

        Raises
        ------
        DeviceFault
            If no true reply comes; ModbusRefusal if the device refuses.
        """
        asked = f"reading {what} (FC3, {count} registers from {address})"
        reply = self._ask(
            asked,
            3,
            lambda client: client.read_holding_registers(address, count=count, device_id=self._device_id),
            lambda reply: _wrong_length(reply, count),
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
        self, *, read_address: int, read_count: int, write_address: int, values: Sequence[int], what: str
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
            lambda reply: _wrong_length(reply, read_count),
        )
        return list(reply.registers)

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

    def _drop(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            client.close()  # type: ignore[no-untyped-call]

    def _opened(self) -> ModbusTcpClient:
        if self._client is not None:
            return self._client
        try:
            wire = socket.create_connection((self._host, self._port), timeout=self._timeout_s)
        except TimeoutError:
            raise self._fault(
                f"no connection within {self._timeout_s:g} s",
                "is it switched on, the network cable in, and the host right?",
            ) from None
        except OSError as error:
            raise self._fault(
                f"cannot connect: {error.strerror or error}",
                "is the controller's Modbus server running, and are host and port of the stand file right?",
            ) from None
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = ModbusTcpClient(self._host, port=self._port, timeout=self._timeout_s, retries=0)
        client.socket = wire
        self._client = client
        if self._was_open:
            self.note(f"connection to {self.name} at {self.address} opened again")
        self._was_open = True
        return client

    def _ask(
        self,
        asked: str,
        function: int,
        send: Callable[[ModbusTcpClient], ModbusPDU],
        find_doubt: Callable[[ModbusPDU], str],
    ) -> ModbusPDU:
        """Send, check, and send once more on a fresh connection after a doubt."""
        doubt = ""
        for attempt in (1, 2):
            client = self._opened()
            try:
                reply = send(client)
                doubt = self._refused_or_doubtful(reply, function, asked) or find_doubt(reply)
            except (ModbusException, OSError, struct.error, ValueError, IndexError) as error:
                doubt = self._describe(error, connected=client.connected)
            if not doubt:
                return reply
            self._drop()
            further = "sent once more on a new connection" if attempt == 1 else "given up"
            self.note(f"{asked}: {doubt}; connection closed, {further}")
        raise self._fault(
            f"{asked}: {doubt}, twice",
            "look at the network cable, the controller's load, and whether a second program talks to it",
        )

    def _refused_or_doubtful(self, reply: ModbusPDU, function: int, asked: str) -> str:
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
