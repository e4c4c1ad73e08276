"""The wires that Modbus runs on: how each is opened, and how it is made quiet after a doubt."""

from __future__ import annotations

import math
import socket
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Literal, Protocol, TypeVar

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusIOException
from pymodbus.pdu.register_message import ReadHoldingRegistersResponse

from bufferstand.foundation import steady_s

_NO_LINE: tuple[type[Exception], ...] = (OSError, ValueError)  # SerialException is an OSError
try:
    import termios
except ImportError:  # Windows: there plans are made, and no wire is opened
    pass
else:
    _NO_LINE = (*_NO_LINE, termios.error)

Client = ModbusTcpClient | ModbusSerialClient
_Client = TypeVar("_Client", ModbusTcpClient, ModbusSerialClient)
Parity = Literal["none", "even", "odd"]

_PARITIES = {"none": "N", "even": "E", "odd": "O"}


class _Registers(ReadHoldingRegistersResponse):
    """Registers of a reply, decoded at once; pymodbus takes 100 µs for 121 of them one by one."""

    def decode(self, data: bytes) -> None:
        """Take the registers; their number must be what the reply says."""
        if data[0] != len(data) - 1 or data[0] % 2:
            raise ModbusIOException(f"byte count {data[0]} of {len(data) - 1} bytes")
        self.registers = list(struct.unpack_from(f">{data[0] // 2}H", data, 1))

    def __str__(self) -> str:
        """Return less than pymodbus would, which makes this text of every reply for a log that is off."""
        return type(self).__name__


class _Holding(_Registers):
    function_code = 3


class _Input(_Registers):
    function_code = 4


class _Exchanged(_Registers):
    function_code = 23


class CannotOpenError(Exception):
    """A wire that cannot be opened: what is wrong, and where to look."""

    def __init__(self, problem: str, look: str) -> None:
        super().__init__(problem)
        self.problem = problem
        self.look = look


def with_quick_replies(client: _Client) -> _Client:
    """Let a client decode registers at once; return it."""
    for reply in (_Holding, _Input, _Exchanged):
        client.register(reply)
    return client


class Wire(Protocol):
    """What a link needs of the wire under it."""

    @property
    def address(self) -> str:
        """Where it leads, for messages."""
        ...

    @property
    def bytes_per_s(self) -> float:
        """What it can carry; infinite where something else is the bound."""
        ...

    @property
    def now_s(self) -> Callable[[], float]:
        """The clock by which its round trips are timed [s]: it goes on while the computer is suspended."""
        ...

    @property
    def sleep(self) -> Callable[[float], None]:
        """Waits by that clock for so long [s]."""
        ...

    def open(self, timeout_s: float) -> Client:
        """Return an open client of pymodbus that does not retry by itself.

        Raises
        ------
        CannotOpenError
            If the wire cannot be opened in time.
        """
        ...

    def settle(self, client: Client, timeout_s: float) -> None:
        """Let what may still be under way come and go, before the wire is closed after a doubt."""
        ...


class TcpWire:
    """Modbus TCP: a new connection leaves every late reply behind.

    Parameters
    ----------
    host, port
        Of the Modbus TCP server.
    """

    now_s: Callable[[], float] = staticmethod(steady_s)
    sleep: Callable[[float], None] = staticmethod(time.sleep)

    def __init__(self, host: str, port: int) -> None:
        self._host = host
        self._port = port

    @property
    def address(self) -> str:
        """``host:port``."""
        return f"{self._host}:{self._port}"

    @property
    def bytes_per_s(self) -> float:
        """No bound that matters here."""
        return math.inf

    def open(self, timeout_s: float) -> ModbusTcpClient:
        """Connect, without delay of small segments.

        Raises
        ------
        CannotOpenError
            If nobody answers there in time.
        """
        try:
            wire = socket.create_connection((self._host, self._port), timeout=timeout_s)
        except TimeoutError:
            raise CannotOpenError(
                f"no connection within {timeout_s:g} s",
                "is it switched on, the network cable in, and the host right?",
            ) from None
        except OSError as error:
            raise CannotOpenError(
                f"cannot connect: {error.strerror or error}",
                "is its Modbus server running, and are host and port of the stand file right?",
            ) from None
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client = ModbusTcpClient(self._host, port=self._port, timeout=timeout_s, retries=0)
        client.socket = wire
        return with_quick_replies(client)

    def settle(self, client: Client, timeout_s: float) -> None:
        """Do nothing: the next connection cannot hear this one."""


class RtuWire:
    """Modbus RTU on a serial line, which carries no transaction number.

    A late reply cannot be told from the next one by its frame, so after a doubt nothing is sent until the
    line has been silent for as long as a reply may take.

    Parameters
    ----------
    port : Path
        The serial device.
    baud : int
        Bits a second.
    parity : str
        ``none``, ``even`` or ``odd``; eight data bits.
    stop_bits : int
        1 or 2.
    """

    now_s: Callable[[], float] = staticmethod(steady_s)
    sleep: Callable[[float], None] = staticmethod(time.sleep)

    def __init__(self, port: Path, *, baud: int = 19200, parity: Parity = "even", stop_bits: int = 1) -> None:
        self._port = port
        self._baud = baud
        self._parity = parity
        self._stop_bits = stop_bits

    @property
    def address(self) -> str:
        """Device and line settings."""
        return f"{self._port} ({self._baud} baud, 8 data bits, {self._parity} parity, {self._stop_bits} stop)"

    @property
    def bytes_per_s(self) -> float:
        """By baud rate and bits of a character: start, eight data, parity, stop."""
        return self._baud / (9 + (self._parity != "none") + self._stop_bits)

    def open(self, timeout_s: float) -> ModbusSerialClient:
        """Open the serial device for this program alone, and forget what came before.

        Raises
        ------
        CannotOpenError
            If there is no such device, it is in use, or it may not be opened.
        """
        client = ModbusSerialClient(
            str(self._port),
            baudrate=self._baud,
            parity=_PARITIES[self._parity],
            stopbits=self._stop_bits,
            timeout=timeout_s,
            retries=0,
        )
        try:
            line = serial.Serial(
                str(self._port),
                timeout=timeout_s,
                write_timeout=timeout_s,
                stopbits=self._stop_bits,
                baudrate=self._baud,
                parity=self._parity_of_line(),
                exclusive=True,
                inter_byte_timeout=client.inter_byte_timeout or None,
            )
            line.reset_input_buffer()
        except _NO_LINE as error:
            raise CannotOpenError(
                f"cannot open the serial line: {error}",
                "is the adapter plugged in, the port of the stand file right, no other program on it, "
                "and may you use it (group dialout)?",
            ) from None
        client.socket = line
        return with_quick_replies(client)

    def _parity_of_line(self) -> str:
        """Return the parity to set: a pseudo-terminal (a simulated stand) knows none and refuses it."""
        simulated = str(self._port.resolve()).startswith("/dev/pts/")
        return "N" if simulated else _PARITIES[self._parity]

    def settle(self, client: Client, timeout_s: float) -> None:
        """Read away what still comes until the line was silent for ``timeout_s`` (thrice that at most)."""
        line = client.socket
        if not isinstance(line, serial.Serial):
            return
        end_s = time.monotonic() + 3.0 * timeout_s
        with suppress(OSError):  # the line itself is gone: opening it again will say so
            while line.read(1) and time.monotonic() < end_s:
                line.reset_input_buffer()
