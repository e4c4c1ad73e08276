"""Writing a text file, and saying so if that cannot be done."""

from __future__ import annotations

from pathlib import Path

from bufferstand.foundation.errors import BadInput


def write_text(path: Path, text: str) -> None:
    """Write a file with line feeds, and make its folder if there is none.

    Raises
    ------
    BadInput
        If it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise BadInput(
            f"cannot be written: {error.strerror or error}", file=path, remedy="choose another place"
        ) from None
