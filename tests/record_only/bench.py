"""A stand that others move, as its instruments feel it: a sine on a spring with a known loss, in real time.

Kelvin-Voigt: F = F₀ + K′ (x − x₀) + K″ ẋ / ω, so that a cycle absorbs π K″ A², whatever the frequency.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.amplifiers.gsv2.simulated import Gsv2Device
from bufferstand.recording.journal import ChainReader, DataRecord
from tests.drivers.amplifiers import FarEnd
from tests.house.house_page import ROOT
from tests.peers.labjack.emulator import LabJackEmulator
from tests.peers.labjack.stream import Habits

MEAN_MM, AMPLITUDE_MM, FREQUENCY_HZ = 60.0, 20.0, 1.0
FORCE_KN, STORAGE, LOSS = 150.0, 4.0, 0.8
ABSORBED_J = math.pi * LOSS * AMPLITUDE_MM**2
OMEGA = 2.0 * math.pi * FREQUENCY_HZ
GSV_KN = 7.885695443832332e-05
"""What a count of the sample stand's GSV-2 is worth [kN]."""
GSV_HZ = 250.0
Array = NDArray[np.float64]


def stroke_mm(time_s: Array) -> Array:
    return np.asarray(MEAN_MM - AMPLITUDE_MM * np.cos(OMEGA * time_s))


def force_kN(time_s: Array, loss: float = LOSS) -> Array:  # noqa: N802
    turn = OMEGA * time_s
    swing = -STORAGE * AMPLITUDE_MM * np.cos(turn) + loss * AMPLITUDE_MM * np.sin(turn)
    return np.asarray(FORCE_KN + swing)


def labjack(drift: float = 0.0, loss: float = LOSS, inputs: int = 3) -> LabJackEmulator:
    """Return a T7: AIN0 force 63 kN/V, AIN1 and AIN2 draw wires 50 mm/V, further ones at rest."""
    felt: dict[int, Callable[[Array], Array]] = {
        0: lambda t: force_kN(t, loss) / 63.0,
        1: lambda t: stroke_mm(t) / 50.0,
        2: lambda t: (stroke_mm(t) + 0.05) / 50.0,
    }
    felt |= {number: lambda t, number=number: 0.0 * t + 0.1 * number for number in range(3, inputs)}  # type: ignore[misc]
    return LabJackEmulator(felt, drift=drift, habits=Habits(channel_interval_us=0.0))


def channel(name: str, quantity: str, unit: str, per_volt: float, more: str = "") -> str:
    calibration = (
        f'{{ id = "{name}", coefficients = [0.0, {per_volt!r}], certificate = "bench", '
        'date = "2026-01-15", valid_until = "2099-01-15" }'
    )
    return (
        f'{{ name = "{name}", quantity = "{quantity}", unit = "{unit}", calibration = {calibration}, '
        f"uncertainty = {{ accuracy_percent = 0.1, zero = 0.05{more} }} }}"
    )


def stand_text(far: LabJackEmulator, *, force_here: bool = True, inputs: int = 3, keys: str = "") -> str:
    """Return the stand file of a laboratory: force on AIN0 (or elsewhere), draw wires on AIN1 and AIN2."""
    text = f"""
[stand]
id = "vendor"
name = "A stand that its maker's controller moves"
laboratory = "bench"

[limits]
force_max_kN = 600.0
stroke_max_mm = 150.0

[[acquisition]]
kind = "labjack"
model = "T7"
host = "127.0.0.1"
port = {far.port or 1}
stream_port = {far.stream_port or 1}
{keys}
"""
    if "rate_Hz" not in keys:
        text += "rate_Hz = 1000.0\n"
    placed = [("AIN1", channel("stroke_1", "stroke", "mm", 50.0, ", linearity = 0.1"))]
    placed += [("AIN2", channel("stroke_2", "stroke", "mm", 50.0, ", linearity = 0.1"))]
    if force_here:
        placed.insert(0, ("AIN0", channel("force", "force", "kN", 63.0)))
    placed += [
        (f"AIN{number}", channel(f"pressure_{number}", "pressure", "bar", 1.0)) for number in range(3, inputs)
    ]
    for terminal, described in placed:
        text += f'\n[[acquisition.input]]\nterminal = "{terminal}"\nchannel = {described}\n'
    return text


AMPLIFIER = f"""
[[amplifier]]
protocol = "gsv2"
port = "wire"
rate_Hz = {GSV_HZ}
range_kN = 630.0
channel = {channel("force", "force", "kN", GSV_KN, ", u_delay_s = 2e-4")}
"""

SPECIMEN = """
[specimen]
id = "buffer-7"
kind = "buffer"
max_stroke_mm = 105.0
elastic_system = "elastomer"
"""


@contextmanager
def amplifier(folder: Path, now_s: Callable[[], float], loss: float = LOSS) -> Iterator[FarEnd]:
    """Have a GSV-2 on a serial line that measures the force of the same stand."""
    far = FarEnd(folder / "wire", Gsv2Device(GSV_HZ, frame="binary5"))
    ended = threading.Event()

    def measure() -> None:
        begun_s, done = now_s(), 0
        while not ended.wait(0.002):
            due = math.floor((now_s() - begun_s) * GSV_HZ)
            if due > done:
                times = begun_s + np.arange(done, due) / GSV_HZ
                far.give(*np.rint(force_kN(times, loss) / GSV_KN).astype(int).tolist())
                done = due

    thread = threading.Thread(target=measure)
    thread.start()
    try:
        yield far
    finally:
        ended.set()
        thread.join()
        far.close()


def command(*words: str | Path) -> list[str]:
    return [sys.executable, "-P", "-m", "bufferstand", *map(str, words)]


def call(*words: str | Path, status: int = 0, patience_s: float = 300.0) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    done = subprocess.run(
        command(*words), capture_output=True, text=True, timeout=patience_s, cwd=ROOT, check=False
    )
    assert done.returncode == status, done.stderr + done.stdout
    return done


def begun(words: Sequence[str | Path]) -> subprocess.Popen[str]:
    """Start a recording, and wait until it records."""
    process = subprocess.Popen(
        command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    )
    assert process.stderr is not None
    for line in process.stderr:
        if re.search(r"recording into", line):
            return process
    raise AssertionError(f"it did not begin: {process.wait()}")


def until_recorded(journal: Path, rows: int, patience_s: float = 60.0) -> int:
    """Wait until a journal holds so many rows of the acquisition device; return how many it holds then."""
    end_s = time.monotonic() + patience_s
    with ChainReader(journal) as reader:
        found = 0
        while found < rows:
            assert time.monotonic() < end_s
            found += sum(
                len(record.time_us)
                for record in reader.poll()
                if isinstance(record, DataRecord) and record.stream == "acquisition"
            )
            time.sleep(0.05)
    return found
