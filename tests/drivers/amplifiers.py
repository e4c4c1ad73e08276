"""Far ends of serial lines for the tests of amplifiers: simulated devices on ptys, fed by hand."""

from __future__ import annotations

import asyncio
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bufferstand.drivers.instruments.wire_device import WireDevice
from bufferstand.drivers.interfaces import SampleBlock, Sensor, SensorFault
from bufferstand.drivers.modbus.link import Table
from bufferstand.drivers.register_maps.amplifier_map import AmplifierMap, AmplifierRegister
from bufferstand.drivers.simulated.machine.instruments import InstrumentValues
from bufferstand.drivers.simulated.wires.modbus_amplifier import AmplifierBank
from bufferstand.drivers.simulated.wires.modbus_requests import Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import RtuStandServer
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer
from bufferstand.drivers.simulated.wires.serial_pty import InstrumentPty
from bufferstand.drivers.stand_file.loading import load_stand
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.pump import Pump
from tests.drivers.servers import loop_thread

PATIENCE_S = 120.0
_Got = TypeVar("_Got")


def for_16_bits(text: str) -> str:
    """Return a sample stand file whose second force comes as 16 bits instead of 24."""
    assert "7.885695443832332e-05" in text
    return text.replace("7.885695443832332e-05", f"{7.885695443832332e-05 * 256}")


def amplifier_settings(folder: Path, table: str, *, extra: str = "") -> Any:
    """Return the settings of a stand file whose ``[amplifier]`` keys (up to its channel) are replaced."""
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    text = re.sub(
        r"\[amplifier\]\n.*?\n\n\[amplifier.channel\]",
        f"[amplifier]\n{table}\n[amplifier.channel]",
        text,
        flags=re.S,
    )
    text = text.replace('name = "force_2"\n', f'name = "force_2"\n{extra}\n')
    if "binary3" in table:
        text = for_16_bits(text)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return load_stand(path).amplifier[0]


class FarEnd:
    """A simulated amplifier on a pty, pumped by a thread; values are given by the test."""

    def __init__(self, link: Path, device: WireDevice) -> None:
        self._frames: deque[InstrumentValues] = deque()
        self.device = device
        self.pty = InstrumentPty(link, self._frames, device)
        self.heard = b""
        self.told: dict[str, int | bool] = {}
        self._guard = threading.Lock()
        receive = self.pty.receive

        def overhear() -> bytes:
            data = receive()
            self.heard += data
            return data

        self.pty.receive = overhear  # type: ignore[method-assign]
        self._pump = Pump(self._step, 0.002)

    def give(self, *counts: int, overload: bool = False, drop: int = 0) -> None:
        """Let the amplifier measure values, and send them with its next pump."""
        with self._guard:
            self._frames.append(InstrumentValues(np.zeros(len(counts)), np.array(counts, dtype=np.int64)))
            self.pty.pump(overload=overload, drop=drop)

    def close(self) -> None:
        self._pump.close()
        self.pty.close()

    def _step(self) -> None:
        with self._guard:
            self.pty.pump()


class _CountedBank(AmplifierBank):
    requests = 0

    def read_packed(self, address: int, count: int, table: Table) -> bytes:
        self.requests += 1
        return super().read_packed(address, count, table)


class RegisterAmplifier:
    """A simulated amplifier with registers on TCP, or on a pty; values are given by the test."""

    def __init__(self, registers: AmplifierMap, rate_Hz: float, link: Path | None = None) -> None:
        self._bank = _CountedBank(registers, rate_Hz)
        self.silent = False
        responder = Responder(self._bank, bool, lambda: self.silent)
        self._network = ModbusStandServer(responder, 1)
        self._line = RtuStandServer(responder, 1)
        self._thread = loop_thread()
        self._loop = self._thread.__enter__()
        self.port = self._do(self._serve(link))
        self._closed = False

    @property
    def requests(self) -> int:
        return self._bank.requests

    def stick(self) -> None:
        self._bank.stuck = True

    def measure(self, value: float, status: int = 0) -> None:
        async def act() -> None:
            self._bank.measure(value, status)

        self._do(act())

    def put(self, register: AmplifierRegister, value: float) -> None:
        self._bank.put(register, value)

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._do(self._stop())
            self._thread.__exit__(None, None, None)

    async def _serve(self, link: Path | None) -> int:
        if link is None:
            return await self._network.start("127.0.0.1", 0)
        self._line.start(link)
        return 0

    async def _stop(self) -> None:
        await self._network.stop()
        self._line.stop()

    def _do(self, work: Coroutine[Any, Any, _Got]) -> _Got:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(60)


def until(done: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


class Collector:
    """Everything that a sensor has delivered."""

    def __init__(self, sensor: Sensor) -> None:
        self.sensor = sensor
        self.blocks: list[SampleBlock] = []
        self.faults: list[SensorFault] = []

    def take(self) -> Collector:
        for item in self.sensor.drain():
            if isinstance(item, SampleBlock):
                self.blocks.append(item)
            else:
                self.faults.append(item)
        return self

    @property
    def counts(self) -> list[int]:
        return [int(v) for block in self.blocks for column in block.counts.values() for v in column]

    @property
    def said(self) -> list[str]:
        return [fault.what for fault in self.faults]
