"""A campaign whose records hold more than cycles: a zero that is off, a hold, settling, and runs again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.recording.content import Anchor, StreamContent
from bufferstand.recording.runfile.file import write_run
from tests.evaluation.signals import Floats, StaticTest
from tests.evaluation_report.make_runs import (
    FORCE_KN_PER_COUNT,
    KELVIN_PER_COUNT,
    START,
    STROKE_MM_PER_COUNT,
    Made,
    metadata,
)

Columns = tuple[Floats, Floats, Floats]
Run = tuple[str, str, Columns, Mapping[str, Any]]
PRELOAD_LOST_KN = 3.0
ZERO_OFF_MM = 1.0
RELAXES_KN = 12.0
"""In each decade of time from 0.1 s on."""
SETTLES = 0.1
"""The loop is so much wider at first."""


def hold() -> Columns:
    """Return a stroke to 60 mm that is held for 100 s, in which the force relaxes."""
    time = np.arange(0.0, 130.0, 0.02)
    stroke = np.interp(time, (0.0, 5.0, 15.0, 115.0, 125.0, 130.0), (0.0, 0.0, 60.0, 60.0, 0.0, 0.0))
    decades = np.log10(np.maximum(np.clip(time - 15.0, 0.0, 100.0), 0.1) / 0.1)
    random = np.random.default_rng(1)
    force = (10.0 + 5.0 * stroke) * (stroke > 0.0) - RELAXES_KN * decades * stroke / 60.0
    return (
        time,
        stroke + 0.005 * random.standard_normal(time.size),
        force + 0.1 * random.standard_normal(time.size),
    )


def settling() -> Columns:
    """Return 30 cycles of 1 Hz whose loop narrows with a time constant of five cycles."""
    time = np.arange(30 * 300 + 1) / 300.0
    angle = 2.0 * np.pi * time - 0.5 * np.pi
    stroke = 50.0 + 20.0 * np.sin(angle)
    wide = 0.6 * (1.0 + SETTLES * np.exp(-time / 5.0))
    random = np.random.default_rng(2)
    force = 200.0 + 4.0 * (stroke - 50.0) + wide * 20.0 * np.cos(angle)
    return time, stroke, force + 0.1 * random.standard_normal(time.size)


def static(preload_kN: float, zero_mm: float = 0.0) -> Columns:
    """Return three strokes to 102 mm behind an approach of 2 mm; the stroke reads by ``zero_mm`` more."""
    test = StaticTest(preload_kN=preload_kN)
    time, stroke, force = test.columns()
    approach_s = np.arange(200) / test.rate_Hz
    random = np.random.default_rng(3)
    before_mm = -2.0 + approach_s + 0.01 * random.standard_normal(approach_s.size)
    force = np.where((time < 2.0) & (stroke < 0.2), 0.1 * random.standard_normal(time.size), force)
    return (
        np.concatenate([approach_s, time + approach_s[-1] + 1.0 / test.rate_Hz]),
        np.concatenate([before_mm, stroke]) + zero_mm,
        np.concatenate([0.1 * random.standard_normal(approach_s.size), force]),
    )


def proof(cycles: int) -> Columns:
    """Return load cycles to 50 mm and 200 kN, of 10 s each."""
    time = np.arange(1000 * cycles + 201) / 100.0
    moves = (time >= 1.0) & (time < 1.0 + 10.0 * cycles)
    stroke = 50.0 * (1.0 - np.abs(np.mod(time - 1.0, 10.0) / 5.0 - 1.0)) * moves
    random = np.random.default_rng(4)
    noise_mm, noise_kN = random.standard_normal((2, time.size)) * [[0.01], [0.1]]
    return time, stroke + noise_mm, 4.0 * stroke + noise_kN


def write_eventful_campaign(folder: Path, runs: Sequence[Run] = ()) -> Path:
    """Write a campaign below ``folder``: static, a hold, settling, proof loads, static again; or ``runs``.

    Parameters
    ----------
    folder : Path
    runs : sequence of (str, str, (array, array, array), mapping), optional
        Name and kind of a run, its time [s], stroke [mm] and force [kN], and what its step states.
    """
    (folder / "runs").mkdir(parents=True)
    started = START
    for index, (name, kind, columns, step) in enumerate(runs or _RUNS, start=1):
        time, stroke, force = columns
        seconds = np.arange(0.0, time[-1] + 1.0)
        ended = started + timedelta(seconds=float(time[-1]))
        counts = {
            "force": np.round(force / FORCE_KN_PER_COUNT).astype(np.int32),
            "stroke_1": np.round(stroke / STROKE_MM_PER_COUNT).astype(np.int32),
            "stroke_2": np.round(stroke / STROKE_MM_PER_COUNT).astype(np.int32),
        }
        warm = np.full(seconds.size, round(20.0 / KELVIN_PER_COUNT), dtype=np.int32)
        at_us = np.round(seconds * 1e6).astype(np.int64)
        streams = {"controller": StreamContent(np.round(time * 1e6).astype(np.int64), counts)}
        streams |= {t: StreamContent(at_us, {t: warm}) for t in ("temperature_1", "temperature_2")}
        anchors = [
            Anchor(0, 0.0, started.isoformat()),
            Anchor(int(1e6 * time[-1]), float(time[-1]), ended.isoformat()),
        ]
        document = metadata(Made(name), index, started, ended, "KX-0815")
        document["run"]["kind"], document["step"] = kind, {"name": name, **step}
        for channel in document["streams"]["controller"]["channels"]:
            if channel["quantity"] == "stroke":
                channel["uncertainty"]["zero"] = 0.1
        write_run(folder / "runs" / f"{index:02d}-{name}.h5", document, streams, (), anchors)
        started = ended + timedelta(minutes=3.0)
    return folder


_RUNS: tuple[Run, ...] = (
    ("static-before", "static", static(15.0), {}),
    ("hold", "static", hold(), {"kind": "hold"}),
    ("settling", "harmonic", settling(), {}),
    ("proof-1", "proof", proof(3), {"proof_load": "F1"}),
    ("proof-2", "proof", proof(2), {"proof_load": "F1"}),
    ("static-after", "static", static(15.0 - PRELOAD_LOST_KN, ZERO_OFF_MM), {}),
)
