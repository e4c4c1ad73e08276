"""One text and one hash for one content, whatever the order in which it was written down."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any


def canonical_json(content: Any) -> str:
    """Return ``content`` as JSON with sorted keys, no spaces and no NaN.

    Raises
    ------
    ValueError
        If a number is NaN or infinite: neither exists in JSON.
    TypeError
        If something in it has no JSON form.
    """
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def content_hash(content: Any) -> str:
    """Return the SHA-256 (hex) of the canonical JSON of ``content``.

    Raises
    ------
    ValueError, TypeError
        As :func:`canonical_json`.
    """
    return hashlib.sha256(canonical_json(content).encode()).hexdigest()


def file_hash(path: Path) -> str:
    """Return the SHA-256 (hex) of a file's bytes.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
