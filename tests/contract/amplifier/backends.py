"""Every way to an amplifier, behind one face: what the test makes it measure must come out of the sensor."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np

from bufferstand.drivers.amplifiers.aed.amplifier import AedAmplifier
from bufferstand.drivers.amplifiers.aed.simulated import AedDevice
from bufferstand.drivers.amplifiers.gsv2.amplifier import Gsv2Amplifier
from bufferstand.drivers.amplifiers.gsv2.simulated import FULL_SCALE, Gsv2Device
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.instruments.catalogue import Kind, kind_of, kinds
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.register_maps.amplifier_map import load_amplifier_map
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.machine.instruments import InstrumentValues
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from tests.drivers.amplifiers import FarEnd, RegisterAmplifier, amplifier_settings
from tests.drivers.conftest import SAMPLE_STAND

LINES = """
id = "lines"
edition = 1
title = "an amplifier that speaks lines"
end = "\\r\\n"
start = "G"
stop = "H"
reply = 'V(?P<value>[+-][0-9.]+)'
example = "V+1234567"
decimals = 0
digits = 8
overload = [{ text = "V OL", what = "its input is overdriven; look at transducer, cable and range" }]

[[source]]
document = "made up for this test"
edition = "1"
place = "here"
"""
LIMITS = "plausible = { overload = 640.0 }"


class Backend(Protocol):
    """An amplifier under test."""

    sensor: Sensor

    def give(self, *counts: int) -> None:
        """Let it measure values, one after the other."""
        ...

    def saturate(self) -> None:
        """Let its input be overdriven once."""
        ...

    def close(self) -> None:
        """Take the far end away."""
        ...


class InProcess:
    """The simulated stand's amplifier in virtual time."""

    def __init__(self, folder: Path) -> None:
        amplifier_settings(
            folder, 'protocol = "gsv2"\nport = "a"\nrate_Hz = 250.0\nrange_kN = 630.0\n', extra=LIMITS
        )
        self._stand = open_in_process(
            load_stand(folder / "stand.toml"),
            model=SAMPLE_STAND.parent / "models" / "category-a-elastomer.toml",
        )
        self.sensor = self._stand.stand.sensors[0]
        self._now_s = 0.0

    def give(self, *counts: int) -> None:
        times = self._now_s + np.arange(1, len(counts) + 1) / 250.0
        self._now_s = float(times[-1])
        self._stand.device.instruments[0].frames.append(
            InstrumentValues(times, np.array(counts, dtype=np.int64))
        )

    def saturate(self) -> None:
        self.give(FULL_SCALE)

    def close(self) -> None:
        self._stand.stand.close()


class OnPty:
    """A simulated amplifier on a serial line, and its driver."""

    def __init__(self, folder: Path, protocol: str, table: str) -> None:
        rate_Hz = 250.0 if protocol == "gsv2" else 100.0
        text = (
            f'protocol = "{protocol}"\nport = "wire"\nbaud = 38400\n'
            f"rate_Hz = {rate_Hz}\nrange_kN = 630.0\n{table}\n"
        )
        settings = amplifier_settings(folder, text, extra=LIMITS)
        device = Gsv2Device(250.0, frame=settings.gsv2.frame) if protocol == "gsv2" else AedDevice()
        self._far = FarEnd(folder / "wire", device)
        kind = Gsv2Amplifier if protocol == "gsv2" else AedAmplifier
        self.sensor: Sensor = kind(folder / "wire", settings, WallClock())

    def give(self, *counts: int) -> None:
        self._far.give(*counts)

    def saturate(self) -> None:
        self._far.give(0, overload=True)

    def close(self) -> None:
        self._far.close()


class OverModbus:
    """A simulated amplifier with registers on TCP or on a pty, and its driver."""

    def __init__(self, folder: Path, *, line: bool) -> None:
        registers = load_amplifier_map("dms-float", folder)
        self._server = RegisterAmplifier(registers, 1000.0, folder / "wire" if line else None)
        where = "" if line else f', host = "127.0.0.1", tcp_port = {self._server.port}'
        text = (
            'protocol = "modbus"\nrate_Hz = 200.0\nrange_kN = 630.0\n'
            f'modbus = {{ map = "dms-float"{where} }}\n' + ('port = "wire"\nbaud = 115200\n' if line else "")
        )
        amplifier_settings(folder, text, extra=LIMITS)
        sensor = build_sensors(load_stand(folder / "stand.toml"), WallClock())[0]
        assert sensor is not None
        self.sensor = sensor

    def give(self, *counts: int) -> None:
        for count in counts:
            before = self._server.requests
            self._server.measure(float(count))
            while self._server.requests <= before + 1:  # each value is asked for before the next one is made
                time.sleep(0.001)

    def saturate(self) -> None:
        self._server.measure(0.0, status=2)

    def close(self) -> None:
        self._server.close()


class OfKind:
    """A kind of another package on its simulated device, as its stand file entry leads to it."""

    def __init__(self, folder: Path, kind: Kind) -> None:
        text = f'protocol = "{kind.name}"\nport = "wire"\nrate_Hz = 100.0\nrange_kN = 630.0\n'
        settings = amplifier_settings(folder, text, extra=LIMITS)
        device = kind.simulated(settings)
        assert device is not None
        self._far = FarEnd(folder / "wire", device)
        self.sensor = build_sensors(load_stand(folder / "stand.toml"), WallClock())[0]

    def give(self, *counts: int) -> None:
        self._far.give(*counts)

    def saturate(self) -> None:
        self._far.give(0, overload=True)

    def close(self) -> None:
        self._far.close()


class SpeakingLines:
    """A simulated amplifier that speaks lines by a laboratory's own description, and its driver."""

    def __init__(self, folder: Path) -> None:
        (folder / "lines.toml").write_text(LINES, encoding="utf-8")
        settings = amplifier_settings(
            folder,
            'protocol = "ascii-line"\nport = "wire"\nbaud = 38400\nrate_Hz = 50.0\nrange_kN = 630.0\n'
            'line = { description = "lines.toml" }\n',
            extra=LIMITS,
        )
        device = kind_of(settings).simulated_in(settings, folder)
        assert device is not None
        self._far = FarEnd(folder / "wire", device)
        self.sensor = build_sensors(load_stand(folder / "stand.toml"), WallClock())[0]

    def give(self, *counts: int) -> None:
        self._far.give(*counts)

    def saturate(self) -> None:
        self._far.give(0, overload=True)

    def close(self) -> None:
        self._far.close()


BACKENDS: dict[str, Callable[[Path], Backend]] = {
    "in-process": InProcess,
    "gsv2-5-bytes": lambda folder: OnPty(folder, "gsv2", ""),
    "aed-binary": lambda folder: OnPty(folder, "aed", "aed = { output = 8 }"),
    "aed-text": lambda folder: OnPty(folder, "aed", "aed = { output = 9 }"),
    "modbus-tcp": lambda folder: OverModbus(folder, line=False),
    "modbus-rtu": lambda folder: OverModbus(folder, line=True),
    "ascii-line": SpeakingLines,
}
OURS = {"gsv2", "aed", "modbus", "ascii-line"}
BACKENDS |= {
    kind.name: partial(OfKind, kind=kind)
    for kind in kinds()
    if kind.table == "amplifier" and kind.name not in OURS
}
