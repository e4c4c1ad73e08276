"""A process that evaluates a long run and says how much memory that took."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loading.long_runs import MemoryBounds
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.recording.content import Segment
from bufferstand.recording.runfile.file import fitting_heads, write_columns
from bufferstand.recording.runfile.layout import ENTRY, Widths, item_values, segment_rows, stream_columns
from tests.recording import samples
from tests.recording.peak_memory import peak_MB

ROWS_AT_ONCE = 1 << 18
RATE_HZ = 1000.0
FORCE_KN, FORCE_AMPLITUDE_KN, LOSS_KN = 200.0, 80.0, 12.0
STROKE_MM, AMPLITUDE_MM = 50.0, 20.0
ABSORBED_J = float(np.pi) * LOSS_KN * AMPLITUDE_MM
STATED = {
    "force": {"uncertainty": ChannelUncertainty(accuracy_percent=0.5, zero=0.3, u_delay_s=2e-5)},
    "stroke": {"uncertainty": ChannelUncertainty(linearity=0.25, zero=0.05, u_delay_s=2e-5)},
}
DTYPES = {"force": "<i4", "stroke_1": "<u2", "stroke_2": "<u2", "speed": "<f8"}


def signals(at_s: NDArray[np.float64], frequency_Hz: float) -> dict[str, NDArray[np.float64]]:
    """Return force [kN], stroke [mm] and speed [mm/s] of an ellipse."""
    angle = 2.0 * np.pi * frequency_Hz * at_s
    sine, cosine = np.sin(angle), np.cos(angle)
    return {
        "force": FORCE_KN + FORCE_AMPLITUDE_KN * sine + LOSS_KN * cosine,
        "stroke": STROKE_MM + AMPLITUDE_MM * sine,
        "speed": 2.0 * np.pi * frequency_Hz * AMPLITUDE_MM * cosine,
    }


def blocks(rows: int, frequency_Hz: float) -> Iterator[tuple[str, NDArray[Any]]]:
    """Return the columns of the stream ``controller``, bit by bit; the force is late by its delay."""
    dice = np.random.default_rng(1)
    force, stroke_1, stroke_2 = samples.channels()
    for first in range(0, rows, ROWS_AT_ONCE):
        sequence = np.arange(first, min(first + ROWS_AT_ONCE, rows), dtype=np.int64)
        at_s = sequence / RATE_HZ
        noise = dice.standard_normal((4, sequence.size))
        values = {
            "force": signals(at_s - force.delay_s, frequency_Hz)["force"] + 0.1 * noise[0],
            "stroke_1": signals(at_s, frequency_Hz)["stroke"] + 0.01 * noise[1],
            "stroke_2": signals(at_s - stroke_2.delay_s, frequency_Hz)["stroke"] + 0.01 * noise[2],
        }
        yield f"{ENTRY}/controller/time_us", samples.time_us(sequence)
        for channel in (force, stroke_1, stroke_2):
            counts = np.round(channel.calibration.counts_of(values[channel.name]))
            yield f"{ENTRY}/controller/{channel.name}", counts.astype(DTYPES[channel.name])
        yield f"{ENTRY}/controller/speed", signals(at_s, frequency_Hz)["speed"] + 0.1 * noise[3]


def write(path: Path, rows: int, frequency_Hz: float) -> None:
    """Write a harmonic run of the stand, in pieces."""
    metadata = samples.metadata("run-1", status="complete")
    force, *wires = (channel.model_copy(update=STATED[channel.quantity]) for channel in samples.channels())
    speed = Channel(name="speed", quantity="speed", unit="mm/s")
    metadata["streams"]["controller"]["channels"] = [
        channel.model_dump(mode="json") for channel in (force, *wires, speed)
    ]
    metadata["step"] = {"prestress_mm": STROKE_MM, "amplitude_mm": AMPLITUDE_MM, "frequency_Hz": frequency_Hz}
    heads = fitting_heads(metadata, {"controller": list(DTYPES)}, path)
    widths = Widths()
    for anchor in samples.ANCHORS:
        widths.take(anchor)
    dtypes = {name: np.dtype(dtype) for name, dtype in DTYPES.items()}
    columns = [
        *widths.columns(),
        *stream_columns("controller", rows, np.dtype("<i8"), dtypes, 1, {"speed": "mm/s"}),
    ]

    def values() -> Iterator[tuple[str, NDArray[Any]]]:
        yield from blocks(rows, frequency_Hz)
        yield f"{ENTRY}/controller/segments", segment_rows([Segment(0, 0, 0)])
        for anchor in samples.ANCHORS:
            yield from item_values(anchor)

    write_columns(path, metadata, heads, columns, values())


def main(path: Path, rows: int, frequency_Hz: float, draws: int, bounds: MemoryBounds) -> None:
    if not path.exists():
        child = os.fork()  # what writing takes does not count
        if child == 0:
            write(path, rows, frequency_Hz)
            os._exit(0)
        os.waitpid(child, 0)
    before, started_s = peak_MB(), time.monotonic()
    run = evaluate_run(*load_run(path, bounds), Options(draws=draws))
    print(
        f"{before:.0f} {peak_MB():.0f} {path.stat().st_size / 1e6:.0f} {len(run.cycles)} "
        f"{run.summary.values['absorbed_energy_J'].value:.6f} {time.monotonic() - started_s:.1f}"
    )


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[5:]]
    main(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]), MemoryBounds(*given))
