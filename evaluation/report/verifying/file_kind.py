"""What kind of file is to be verified."""

from __future__ import annotations

from pathlib import Path

_MAGIC = b"%PDF-"


def is_report(path: Path) -> bool:
    """Say whether a file is a PDF, by its name or by how it begins."""
    if path.suffix.lower() == ".pdf":
        return path.is_file()
    try:
        with path.open("rb") as stream:
            return stream.read(len(_MAGIC)) == _MAGIC
    except OSError:
        return False
