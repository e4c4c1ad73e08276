"""Far ends of serial lines for the tests of amplifiers: simulated devices on ptys, fed by hand."""

from __future__ import annotations

import re
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import numpy as np

from drivers.interfaces import SampleBlock, Sensor, SensorFault
from drivers.simulated.amplifier_devices import WireDevice
from drivers.simulated.device import Frames
from drivers.simulated.serial_pty import AmplifierPty
from drivers.stand_file import AmplifierSettings, load_stand
from tests.drivers.conftest import SAMPLE_STAND

PATIENCE_S = 20.0


def amplifier_settings(folder: Path, table: str, *, extra: str = "") -> AmplifierSettings:
    """Return the settings of a stand file whose ``[amplifier]`` keys (up to its channel) are replaced."""
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    text = re.sub(
        r"\[amplifier\]\n.*?\n\n\[amplifier.channel\]",
        f"[amplifier]\n{table}\n[amplifier.channel]",
        text,
        flags=re.S,
    )
    text = text.replace('name = "force_2"\n', f'name = "force_2"\n{extra}\n')
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    settings = load_stand(path).amplifier
    assert settings is not None
    return settings


class FarEnd:
    """A simulated amplifier on a pty, pumped by a thread; values are given by the test."""

    def __init__(self, link: Path, device: WireDevice, rate_Hz: float = 250.0) -> None:
        self._frames: deque[Frames] = deque()
        self.device = device
        self.pty = AmplifierPty(link, self._frames, rate_Hz, device)
        self.heard = b""
        self.told: dict[str, int | bool] = {}
        self._end = threading.Event()
        self._guard = threading.Lock()
        receive = self.pty.receive

        def overhear() -> bytes:
            data = receive()
            self.heard += data
            return data

        self.pty.receive = overhear  # type: ignore[method-assign]
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def give(self, *counts: int, overload: bool = False, drop: int = 0) -> None:
        """Let the amplifier measure values, and send them with its next pump."""
        with self._guard:
            self._frames.append(Frames(np.zeros(len(counts)), np.array(counts, dtype=np.int64)))
            self.pty.pump(overload=overload, drop=drop)

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        self.pty.close()

    def _run(self) -> None:
        while not self._end.wait(0.002):
            with self._guard:
                self.pty.pump()


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
