"""One hash for what an evaluation found, wherever and by whatever libraries it was made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bufferstand.foundation.files import content_hash

_EVALUATED = (
    "decision_rule",
    "runs",
    "trends",
    "temperature_comparisons",
    "before_after",
    "proof_load_totals",
    "conformity",
)
"""What of an evaluation document says what was found; the rest says where files lay, and what computed it."""


def evaluation_hash(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what an evaluation found, whatever folder and libraries it was made with.

    Parameters
    ----------
    document : mapping
        An evaluation document; of each run its path is left out.

    Returns
    -------
    str
        64 hex digits, of the canonical JSON.
    """
    found = {key: document[key] for key in _EVALUATED if key in document}
    return content_hash({**found, "runs": runs_without_paths(found)})


def runs_without_paths(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the runs of an evaluation document, wherever their files lie: each without its path."""
    return [
        {**entry, "run": {key: value for key, value in entry["run"].items() if key != "path"}}
        for entry in document.get("runs") or []
    ]
