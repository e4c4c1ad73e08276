"""What the registers of a T7 or T8 do: settings, readings, streams and their refusals.

Error codes: ``ljm_constants.json`` 2025.12.18, ``errors``. A refused request gets a Modbus exception, and
``LAST_ERR_DETAIL`` the code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from tests.peers.labjack import registers as at
from tests.peers.labjack.calibration import Converter
from tests.peers.labjack.stream import (
    COMMAND_RESPONSE,
    DEFAULT_BUFFER,
    ETHERNET,
    LARGEST_BUFFER,
    MOST_PER_PACKET,
    Habits,
    Stream,
    StreamPlan,
)

Signal = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Volts at an input for true times [s]."""

CORE_TIMER_HZ = {7: 40e6, 8: 100e6}
"""Half the core speed; of the T8 it is not in what was read."""
SAMPLES_PER_S = {7: 100_000.0, 8: 320_000.0}
"""Most samples a second over all channels (T8: 40 000 of each of 8)."""
STREAM_CLOCK_HZ = 80e6
"""The scan rate is this over a whole number: an assumption, by which a rate read back differs from the one
written."""
ILLEGAL_ADDRESS, ILLEGAL_VALUE = 2, 3
BITS_16 = {2500: (0, 8), 2501: (8, 8), 2502: (16, 4), 2503: (20, 3)}
"""States of digital lines that can be streamed: FIO, EIO, CIO, MIO; first line, lines."""


class DeviceError(Exception):
    """The device refuses: a code of its own, and the Modbus exception."""

    def __init__(self, code: int, exception: int = 4) -> None:
        super().__init__(f"LabJack error {code}")
        self.code, self.exception = code, exception


class LabJack:
    """Registers of one device.

    Parameters
    ----------
    product : {7, 8}
    inputs : mapping of int to Signal
        By number of the AIN; others read 0 V.
    now_s : callable
        True time since the start [s].
    drift : float
        By how much its clock is faster than the true one.
    habits : Habits
    """

    def __init__(
        self,
        product: int,
        inputs: Mapping[int, Signal],
        now_s: Callable[[], float],
        drift: float = 0.0,
        habits: Habits | None = None,
    ) -> None:
        self._map = at.register_map()
        self._values: dict[str, float] = {one.name: 0 for one in self._map.values()}
        self._values |= at.STARTS_WITH
        self._values |= {
            "PRODUCT_ID": product,
            "HARDWARE_VERSION": 1.35 if product == 7 else 1.1,
            "FIRMWARE_VERSION": 1.0292 if product == 7 else 1.0035,
            "SERIAL_NUMBER": 470012345 if product == 7 else 480012345,
        }
        self._values |= {f"AIN{number}_NEGATIVE_CH": 199 for number in range(at.AINS)}
        self._settings = {one.name for one in at.STREAM_SETTINGS}
        self._inputs = inputs
        self._now_s = now_s
        self._drift = drift
        self._habits = habits or Habits(channel_interval_us=15.0 if product == 7 else 0.0)
        self.converter = Converter(product)
        self.product = product
        self.stream: Stream | None = None
        self.outputs: list[tuple[float, int, int]] = []
        """Digital lines that were written: true time [s], line, level."""

    @property
    def is_streaming(self) -> bool:
        """Whether a stream runs."""
        return self.stream is not None and self.stream.running

    def read(self, address: int, words: int) -> bytes:
        """Return registers as they go over the wire; raise DeviceError."""
        if address == at.STREAM_DATA_CR:
            return self._read_stream(words)
        if address == at.FLASH_READ:
            return self._read_flash(words)
        found, end = b"", address + words
        while address < end:
            register = self._map.get(address)
            if register is None:
                raise DeviceError(ILLEGAL_ADDRESS, ILLEGAL_ADDRESS)
            if address + register.words > end:
                raise DeviceError(2313)
            found += register.pack(self._value(register.name, address))
            address += register.words
        return found

    def write(self, address: int, raw: bytes) -> None:
        """Take registers; raise DeviceError at the first that is refused."""
        place = 0
        while place < len(raw):
            register = self._map.get(address)
            if register is None:
                raise DeviceError(ILLEGAL_ADDRESS, ILLEGAL_ADDRESS)
            if not register.writable:
                raise DeviceError(ILLEGAL_ADDRESS, ILLEGAL_ADDRESS)
            piece = raw[place : place + 2 * register.words]
            if len(piece) < 2 * register.words:
                raise DeviceError(2313)
            self._set(register, register.unpack(piece))
            address, place = address + register.words, place + 2 * register.words

    def _value(self, name: str, address: int) -> float:
        if name.startswith("AIN") and name[3:].isdigit():
            return self._volts(address // 2)
        if name == "STREAM_ENABLE":
            return float(self.is_streaming)
        if name in ("CORE_TIMER", "SYSTEM_TIMER_20HZ"):
            hertz = CORE_TIMER_HZ[self.product] if name == "CORE_TIMER" else 20.0
            return int(self._now_s() * (1.0 + self._drift) * hertz) % (1 << 32)
        return self._values[name]

    def _set(self, register: at.Register, value: float) -> None:
        name = register.name
        if name == "STREAM_ENABLE":
            self._enable() if value else self._disable()
            return
        is_set_up = name in self._settings or name.startswith("STREAM_SCANLIST")
        if is_set_up and self.is_streaming:
            raise DeviceError(2605)
        if name == "STREAM_SCANRATE_HZ" and value > 0.0:  # a read gives the actual rate
            value = STREAM_CLOCK_HZ / max(1.0, round(STREAM_CLOCK_HZ / value))
        if name.endswith("_RANGE"):
            if not self.converter.has_range(value):
                raise DeviceError(2370)
            value = self.converter.nearest(value)
        if name == "AIN_ALL_RANGE":
            self._values |= {f"AIN{number}_RANGE": value for number in range(at.AINS)}
        if name.startswith("DIO"):
            self.outputs.append((self._now_s(), int(name[3:]), int(value)))
        self._values[name] = value

    def _disable(self) -> None:
        if not self.is_streaming or self.stream is None:
            raise DeviceError(2620)
        self.stream.running = False
        self.stream = None

    def _enable(self) -> None:
        if self.is_streaming:
            raise DeviceError(2605)
        plan = self._plan()
        sampled = [self._column(address, number) for number, address in enumerate(plan.addresses)]

        def sample(times: NDArray[np.float64]) -> NDArray[np.uint16]:
            return np.column_stack([column(times) for column in sampled])

        start_s = self._now_s()
        self.stream = Stream(plan, sample, start_s, self._drift, self._habits)
        ticks = self.stream.scan_time_s(0) * (1.0 + self._drift) * CORE_TIMER_HZ[self.product]
        self._values["STREAM_START_TIME_STAMP"] = int(ticks) % (1 << 32)

    def _plan(self) -> StreamPlan:
        """Return what was set up, or refuse it by the document's code."""
        value = {name: self._values[name] for name in self._settings}
        count = int(value["STREAM_NUM_ADDRESSES"])
        target, size = int(value["STREAM_AUTO_TARGET"]), int(value["STREAM_BUFFER_SIZE_BYTES"])
        packet = int(value["STREAM_SAMPLES_PER_PACKET"])
        names = [f"STREAM_SCANLIST_ADDRESS{number}" for number in range(min(count, at.SCAN_LIST_LENGTH))]
        addresses = tuple(int(self._values[name]) for name in names)
        rate_Hz = value["STREAM_SCANRATE_HZ"]
        refusals = (
            (2600, count == 0),
            (2607, count > at.SCAN_LIST_LENGTH),
            (2625, any(not self._streamable(address) for address in addresses)),
            (2608, rate_Hz <= 0.0 or rate_Hz * count > SAMPLES_PER_S[self.product]),
            (2611, value["STREAM_DATATYPE"] != 0),
            (2606, value["STREAM_RESOLUTION_INDEX"] > 8),
            (2612, target not in (ETHERNET, COMMAND_RESPONSE)),
            (2615, size > LARGEST_BUFFER or size & (size - 1) != 0),
            (2618, target == ETHERNET and not 1 <= packet <= MOST_PER_PACKET),
        )
        for code, refused in refusals:
            if refused:
                raise DeviceError(code)
        return StreamPlan(
            rate_Hz,
            addresses,
            packet,
            size or DEFAULT_BUFFER,
            target,
            int(value["STREAM_NUM_SCANS"]),
            recovers=not value["STREAM_AUTORECOVER_DISABLE"],
        )

    def _streamable(self, address: int) -> bool:
        most = at.AINS if self.product == 7 else 8
        return (address % 2 == 0 and 0 <= address < 2 * most) or address in BITS_16

    def _column(self, address: int, number: int) -> Callable[[NDArray[np.float64]], NDArray[np.uint16]]:
        """Return how the 16 bits of one place of the scan list come about."""
        later_s = number * self._habits.channel_interval_us * 1e-6
        if address in BITS_16:
            first, lines = BITS_16[address]
            level = sum(int(self._values[f"DIO{first + bit}"]) << bit for bit in range(lines))
            return lambda times: np.full(len(times), level, dtype=np.uint16)
        signal = self._inputs.get(address // 2)
        cal = self.converter.cal(self._values[f"AIN{address // 2}_RANGE"])
        if signal is None:
            rest = cal.bits(np.zeros(1))[0]
            return lambda times: np.full(len(times), rest, dtype=np.uint16)
        return lambda times: cal.bits(signal(times + later_s))

    def _volts(self, number: int) -> float:
        if self.is_streaming:
            raise DeviceError(2605)
        signal = self._inputs.get(number)
        return float(signal(np.array([self._now_s()]))[0]) if signal else 0.0

    def _read_stream(self, words: int) -> bytes:
        if self.stream is None:
            raise DeviceError(2620)
        if self.stream.plan.target != COMMAND_RESPONSE:
            raise DeviceError(2603)
        if words < 5:
            raise DeviceError(2313)
        self.stream.advance(self._now_s())
        return self.stream.answer(words)

    def _read_flash(self, words: int) -> bytes:
        if words % 2:
            raise DeviceError(2315)
        pointer = int(self._values["INTERNAL_FLASH_READ_POINTER"])
        found = self.converter.read_flash(pointer, 2 * words)
        if found is None:
            raise DeviceError(2350)
        self._values["INTERNAL_FLASH_READ_POINTER"] = pointer + 2 * words
        return found

    def fail(self, error: DeviceError) -> None:
        """Keep the code of what was refused last."""
        self._values["LAST_ERR_DETAIL"] = error.code
