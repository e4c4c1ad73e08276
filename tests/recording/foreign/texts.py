"""Text records of a few lines: written, imported, and what came of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from foundation.errors import BadInput
from recording.foreign.importing import Imported, import_file
from recording.foreign.wanted import ImportOptions
from recording.run import Run
from recording.runfile import open_run

HEADER = "time [s],stroke [mm],force [kN]"


def write(tmp_path: Path, text: str | bytes, name: str = "record.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def lines(*rows: str) -> str:
    return "".join(f"{row}\n" for row in rows)


def read(path: Path, **options: Any) -> tuple[Run, tuple[str, ...]]:
    made: Imported = import_file(path, path.parent / "out", ImportOptions(kind="harmonic", **options))
    return open_run(made.path), made.warnings


def refused(path: Path, **options: Any) -> str:
    with pytest.raises(BadInput) as caught:
        read(path, **options)
    assert not (path.parent / "out").exists()
    message = caught.value.message()
    assert message.startswith(str(path.parent))
    return message


def values(run: Run, channel: str) -> list[float]:
    return [float(value) for value in run.series(channel).value]
