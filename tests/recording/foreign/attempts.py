"""One import in a test: read, or refused with one message and nothing written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.runfile.run import Run


def read(path: Path, **options: Any) -> tuple[Run, tuple[str, ...]]:
    made = import_file(path, path.parent / "out", ImportOptions(kind="harmonic", **options))
    return open_run(made.path), made.warnings


def refused(path: Path, **options: Any) -> str:
    with pytest.raises(BadInput) as caught:
        read(path, **options)
    assert not (path.parent / "out").exists()
    message = caught.value.message()
    assert message.startswith((str(path.parent), "--"))
    return message


def mapping(path: Path, *lines: str) -> Path:
    """Write a mapping file beside a record."""
    written = path.with_suffix(".mapping.toml")
    written.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return written
