"""A simulated LabJack T7 on its two ports: registers of Modbus TCP, and the stream in packets.

What is served is what the driver needs of it (T-Series Datasheet 3.1, 3.2.4, 20.0.1), by the simulated
machine. The emulator of the tests was made by another author from the documents alone; this twin is not.
"""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from bufferstand.drivers.acquisition.labjack import (
    AIN_NEGATIVE,
    AIN_RANGE,
    AUTO_TARGET,
    CORE_TIMER,
    ENABLE,
    FIO0,
    FIRMWARE_VERSION,
    FLASH,
    FLASH_POINTER,
    FLASH_READ,
    FUNCTION,
    HEAD_BYTES,
    LARGEST,
    LAST_ERROR,
    PRODUCT_ID,
    RANGES_V,
    SAMPLES_PER_PACKET,
    SCAN_LIST,
    SCAN_RATE,
    SERIAL_NUMBER,
    SIMULATED_SERIAL,
    START_STAMP,
    TARGET_PACKETS,
    TEST,
    TEST_VALUE,
    TICKS_PER_S,
    TYPE,
    LabJackSettings,
    number_of,
    words_of_number,
    words_of_real,
)
from bufferstand.drivers.modbus import Table
from bufferstand.drivers.simulated.machine import SimulatedAcquisition, SimulatedDevice
from bufferstand.drivers.simulated.wires.modbus_requests import ILLEGAL_VALUE, Responder
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.foundation import BadInput

HERTZ = TICKS_PER_S[7]
FIRMWARE = 1.0300
CENTRE = 32768.0
OVER = 1.06
"""A range reaches so much further than its name."""
MOST_WAITING = 1 << 20
"""Bytes that may wait for a reader; more are skipped, as by a full buffer."""
_FLASH_REGISTERS = 16
_AREA = {
    TEST: 2,
    PRODUCT_ID: 2,
    FIRMWARE_VERSION: 2,
    SERIAL_NUMBER: 2,
    LAST_ERROR: 2,
    CORE_TIMER: 2,
    FLASH_POINTER: 2,
    FLASH_READ: 2,
    AIN_RANGE: 512,
    AIN_NEGATIVE: 256,
    SCAN_RATE: 28,
    SCAN_LIST: 256,
    ENABLE: 2,
    FIO0: 23,
}
"""Registers that it has: first, and how many."""


class LabJackTwin:
    """A T7 that measures the simulated machine.

    Parameters
    ----------
    device : SimulatedDevice
        Whose faults strike it.
    simulated : SimulatedAcquisition
        Of that device.
    catch_up : callable
        Brings the device up to the present.

    Raises
    ------
    BadInput
        If the stand file asks for what it does not serve.
    """

    def __init__(
        self, device: SimulatedDevice, simulated: SimulatedAcquisition, catch_up: Callable[[bool], object]
    ) -> None:
        settings = simulated.entry
        if not isinstance(settings, LabJackSettings) or settings.model != "T7":
            raise BadInput(
                f"an acquisition device of kind “{settings.kind}” has no simulated one on the network",
                place=simulated.stream,
                remedy="leave it out for a rehearsal; a LabJack T7 has one",
            )
        if settings.delivery != "packets":
            raise BadInput(
                "the simulated LabJack sends packets only",
                place=f"{simulated.stream}.delivery",
                remedy='write delivery = "packets" for a rehearsal',
            )
        self.settings, self.stream = settings, simulated.stream
        self._device, self._simulated = device, simulated
        self._bank = _Bank(self)
        self._network = ModbusStandServer(Responder(self._bank, catch_up, self._is_cut), 1)
        self._server: asyncio.Server | None = None
        self._listeners: set[asyncio.Transport] = set()
        self._first: float | None = None
        self._transaction = 0
        self._rest = np.zeros(0, dtype=np.uint16)
        self._skipped = 0
        self._scales = np.array([one.range_V * OVER / CENTRE for one in settings.input])

    async def listen(self, host: str, port: int, stream_port: int) -> tuple[int, int]:
        """Serve both ports; return them (0 takes a free one).

        Raises
        ------
        BadInput
            If one cannot be had.
        """
        port = await self._network.start(host, port, f"{self.stream}.port")
        try:
            self._server = await asyncio.get_running_loop().create_server(
                lambda: _Listener(self._listeners), host, stream_port
            )
        except (OSError, OverflowError) as error:
            raise BadInput(
                f"port {stream_port} cannot be had: {error}",
                place=f"{self.stream}.stream_port",
                remedy="write another one",
            ) from None
        return port, int(self._server.sockets[0].getsockname()[1])

    async def stop(self) -> None:
        """Take both away."""
        await self._network.stop()
        for transport in list(self._listeners):
            transport.abort()
        if self._server is not None:
            self._server.close()
            with suppress(asyncio.CancelledError):
                await self._server.wait_closed()
            self._server = None

    def ticks(self, time_s: float) -> int:
        """Return CORE_TIMER at a stand time [s]."""
        shown_s = float(self._simulated.shown_s(np.array([time_s]))[0])
        return int(shown_s * HERTZ) % (1 << 32)

    @property
    def now_ticks(self) -> int:
        """CORE_TIMER now."""
        return self.ticks(self._device.time_s)

    def begin(self) -> int:
        """Start the stream with the next scan; return CORE_TIMER then."""
        rate_Hz = self.settings.rate_Hz * (1.0 + self._simulated.drift)
        self._first = (math.floor(self._device.time_s * rate_Hz) + 1) / rate_Hz
        self._transaction, self._skipped, self._rest = 0, 0, self._rest[:0]
        return self.ticks(self._first)

    def end(self) -> None:
        """Stop the stream."""
        self._first = None

    @property
    def runs(self) -> bool:
        """Whether a stream runs."""
        return self._first is not None

    def pump(self) -> None:
        """Send what has been scanned since the last call."""
        scans = self._simulated.scans
        parts = [self._rest]
        while scans:
            one = scans.popleft()
            if self._first is None or self._is_cut():
                continue
            wanted = one.counts[one.time_s > self._first - 1e-6]
            bits = np.rint(wanted / self._scales + CENTRE)
            parts.append(np.clip(bits, 0, LARGEST).astype(np.uint16).ravel())
        if self._first is None:
            return
        samples = np.concatenate(parts)
        size = max(1, self._bank.number(SAMPLES_PER_PACKET))
        whole = samples.size // size * size
        for begin in range(0, whole, size):
            self._send(samples[begin : begin + size])
        self._rest = samples[whole:]

    def _send(self, samples: np.ndarray[tuple[int], np.dtype[np.uint16]]) -> None:
        body = samples.astype(">u2").tobytes()
        head = struct.pack(
            ">HHHBBBBHHH",
            self._transaction,
            0,
            HEAD_BYTES - 6 + len(body),
            1,
            FUNCTION,
            TYPE,
            0,
            0,
            0,
            0,
        )
        self._transaction = (self._transaction + 1) % 0x10000
        for transport in self._listeners:
            if transport.get_write_buffer_size() < MOST_WAITING:  # else the packet's number tells the hole
                transport.write(head + body)

    def _is_cut(self) -> bool:
        return self._device.faults.find(self.stream, "silent", self._device.time_s) is not None


class _Listener(asyncio.Protocol):
    """A connection to the stream port, which is only written to."""

    def __init__(self, listeners: set[asyncio.Transport]) -> None:
        self._listeners = listeners
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take it."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._listeners.add(transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Forget it."""
        if self._transport is not None:
            self._listeners.discard(self._transport)


class _Bank:
    """The twin's registers (:class:`.modbus_requests.Bank`)."""

    def __init__(self, twin: LabJackTwin) -> None:
        self._twin = twin
        self._there = frozenset(at + step for at, count in _AREA.items() for step in range(count))
        self._words = dict.fromkeys(self._there, 0)
        for at, words in (
            (TEST, words_of_number(TEST_VALUE)),
            (PRODUCT_ID, words_of_real(7.0)),
            (FIRMWARE_VERSION, words_of_real(FIRMWARE)),
            (SERIAL_NUMBER, words_of_number(SIMULATED_SERIAL)),
        ):
            self._put(at, words)

    @property
    def readable(self) -> Mapping[Table, frozenset[int]]:
        """Addresses that exist."""
        return {"holding": self._there, "input": self._there}

    @property
    def writable(self) -> frozenset[int]:
        """Addresses that can be written."""
        return self._there

    def number(self, at: int) -> int:
        """Return a UINT32."""
        return number_of([self._words[at], self._words[at + 1]])

    def read_packed(self, address: int, count: int, table: Table) -> bytes:  # noqa: ARG002 - one table
        """Return registers as they are on the wire."""
        wanted = range(address, address + count)
        if CORE_TIMER in wanted:
            self._put(CORE_TIMER, words_of_number(self._twin.now_ticks))
        if ENABLE in wanted:
            self._put(ENABLE, words_of_number(int(self._twin.runs)))
        return struct.pack(f">{count}H", *(self._words[at] for at in wanted))

    def write(self, address: int, values: Sequence[int]) -> int:
        """Write registers, and do what they mean; return 0, or why nothing was done."""
        if address == AUTO_TARGET and number_of(list(values)) != TARGET_PACKETS:
            return ILLEGAL_VALUE
        self._put(address, values)
        if address == FLASH_POINTER:
            self._put(FLASH_READ, self._flash(number_of(list(values))))
        if address == ENABLE:
            if number_of(list(values)):
                self._put(START_STAMP, words_of_number(self._twin.begin()))
            else:
                self._twin.end()
        return 0

    def is_harmless(self, address: int, count: int) -> bool:  # noqa: ARG002 - nothing of the stand is here
        """Return True: nothing here does anything to the stand."""
        return True

    def is_momentary(self, addresses: range, table: Table) -> bool:  # noqa: ARG002 - one table
        """Return whether the clock is asked for."""
        return CORE_TIMER in addresses or ENABLE in addresses

    def _put(self, at: int, words: Sequence[int]) -> None:
        for step, word in enumerate(words):
            self._words[at + step] = word

    def _flash(self, at: int) -> list[int]:
        """Return two registers of the constants of a range: slopes, centre, offset."""
        number, byte = divmod(at - FLASH["T7"], _FLASH_REGISTERS)
        ranges = RANGES_V["T7"]
        if not 0 <= number < len(ranges):
            return [0xFFFF, 0xFFFF]
        slope = ranges[number] * OVER / CENTRE
        return words_of_real((slope, -slope, CENTRE, 0.0)[byte // 4])
