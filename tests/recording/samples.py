"""Runs to record in these tests: every count is a function of its sequence number, so it can be checked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel
from bufferstand.recording.content import Anchor, Event, Segment, StreamContent
from bufferstand.recording.journal.records import JournalEnd, Record
from bufferstand.recording.journal.segments import ChainReader

FORCE_KN_PER_COUNT = 2.0**-20 * 100.0
STROKE_MM_PER_COUNT = 500.0 / 65536.0
DELAY_S = 0.0008


def channels() -> list[Channel]:
    return [
        Channel(
            name="force",
            quantity="force",
            unit="kN",
            delay_s=DELAY_S,
            calibration=Calibration(coefficients=(0.25, FORCE_KN_PER_COUNT)),
        ),
        Channel(
            name="stroke_1",
            quantity="stroke",
            unit="mm",
            calibration=Calibration(coefficients=(0.0, STROKE_MM_PER_COUNT)),
        ),
        Channel(
            name="stroke_2",
            quantity="stroke",
            unit="mm",
            delay_s=0.0002,
            calibration=Calibration(coefficients=(1.0, STROKE_MM_PER_COUNT)),
        ),
    ]


def metadata(run_id: str = "run-1", **run: Any) -> dict[str, Any]:
    sensor = Channel(name="temperature_1", quantity="temperature", unit="°C", place="plate 3")
    return {
        "format": "bufferstand/run",
        "format_version": 1,
        "run": {
            "id": run_id,
            "kind": "harmonic",
            "started_utc": "2026-03-01T08:00:00+00:00",
            "operator": "Ä. Müller",
            "campaign": "c",
            "step_index": 3,
            **run,
        },
        "software": {"name": "bufferstand", "version": "0"},
        "specimen": {"id": "B-17", "kind": "buffer"},
        "step": {"name": "sine", "prestress_mm": 40.0, "amplitude_mm": 10, "frequency_Hz": 1.5},
        "streams": {
            "controller": {
                "clock": "device",
                "rate_Hz": 1000.0,
                "device": "ring",
                "channels": [channel.model_dump(mode="json") for channel in channels()],
            },
            "temperature_1": {
                "clock": "host",
                "rate_Hz": 1,
                "device": "28-1",
                "channels": [sensor.model_dump(mode="json")],
            },
        },
    }


def time_us(sequence: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.asarray(5_000_000_000 + 1000 * sequence, dtype=np.int64)


def counts(sequence: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    return {
        "force": (sequence * 7919 % 1_000_003 - 500_000).astype(np.int32),
        "stroke_1": (sequence * 104_729 % 65_521).astype(np.uint16),
        "stroke_2": (sequence * 1299_709 % 65_519).astype(np.uint16),
    }


def block(first: int, rows: int = 20) -> tuple[str, int, NDArray[np.int64], dict[str, NDArray[Any]]]:
    sequence = np.arange(first, first + rows, dtype=np.int64)
    return "controller", first, time_us(sequence), counts(sequence)


def content(rows: int = 100) -> dict[str, StreamContent]:
    sequence = np.arange(rows, dtype=np.int64)
    slow = np.arange(5, dtype=np.int64)
    return {
        "controller": StreamContent(time_us(sequence), counts(sequence), (Segment(0, 0, 0),)),
        "temperature_1": StreamContent(9_000_000_000 + 1_000_000 * slow, {"temperature_1": 20.0 + slow / 4}),
    }


EVENTS = (Event(9000.0, "started", "waveform", {"cycle": 1}), Event(9001.5, "guard", "Überschreitung", {}))
ANCHORS = (
    Anchor(5_000_000_000, 9000.0005, "2026-03-01T08:00:00+00:00"),
    Anchor(5_001_000_000, 9001.02, "2026-03-01T08:00:01+00:00"),
)


@dataclass(frozen=True)
class Scan:
    """All that a reader finds in a journal."""

    header: Any
    records: list[Record]
    stop: JournalEnd
    why: str
    more_follows: bool
    missing: int
    frames: int
    valid_bytes: int


def scan(journal: Path) -> Scan:
    """Read a whole journal through all its segments."""
    with ChainReader(journal) as reader:
        records = [record for batch in reader.batches() for record in batch]
        frames, valid_bytes, _ = reader.read_so_far
        return Scan(
            reader.header,
            records,
            reader.stop,
            reader.why,
            reader.more_lies_behind(),
            reader.missing,
            frames,
            valid_bytes,
        )


def flipped(path: Path, bit: int) -> None:
    """Turn one bit of a (read-only) file."""
    data = bytearray(path.read_bytes())
    data[bit // 8] ^= 1 << (bit % 8)
    path.chmod(0o644)
    path.write_bytes(bytes(data))
