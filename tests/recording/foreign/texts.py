"""Text records of a few lines."""

from __future__ import annotations

from pathlib import Path

from bufferstand.recording.runfile.run import Run

HEADER = "time [s],stroke [mm],force [kN]"


def write(tmp_path: Path, text: str | bytes, name: str = "record.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def lines(*rows: str) -> str:
    return "".join(f"{row}\n" for row in rows)


def values(run: Run, channel: str) -> list[float]:
    return [float(value) for value in run.series(channel).value]
