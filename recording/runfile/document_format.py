"""What makes a metadata document one of this format, and unaltered; what it says is not looked at."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import content_hash

FORMAT = "bufferstand/run"
FORMAT_VERSION = 1


def check_format(document: Any, file: Path) -> None:
    """Refuse a document that is of another kind or newer than this software.

    Raises
    ------
    BadInput
        If it is no metadata document of a run or its format version is not understood.
    """
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise BadInput(
            "not a run file of bufferstand",
            file=file,
            place="metadata",
            remedy="foreign records are read by “bufferstand import”",
        )
    version = document.get("format_version")
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise BadInput(f"format version {version!r} is none", file=file, place="metadata: format_version")
    if version > FORMAT_VERSION:
        raise BadInput(
            f"format version {version} is newer than this software understands ({FORMAT_VERSION})",
            file=file,
            place="metadata: format_version",
            remedy="update bufferstand",
        )


def content_hash_of(document: Mapping[str, Any]) -> str:
    """Return the hash of a document without the hash that it states of itself.

    As it lists the hash of every dataset, it stands for the whole content of the run.

    Raises
    ------
    ValueError, TypeError
        If it has no canonical JSON form.
    """
    return content_hash({key: value for key, value in document.items() if key != "content_sha256"})


def is_unaltered(document: Mapping[str, Any]) -> bool:
    """Tell whether a document is the one whose hash it states."""
    try:
        return bool(document.get("content_sha256") == content_hash_of(document))
    except (ValueError, TypeError):  # what no writer of ours can have written
        return False
