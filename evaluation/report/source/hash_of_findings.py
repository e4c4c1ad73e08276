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
        An evaluation document; the paths of its runs are left out.

    Returns
    -------
    str
        64 hex digits, of the canonical JSON.
    """
    return content_hash(without_paths({key: document[key] for key in _EVALUATED if key in document}))


def without_paths(found: Any) -> Any:
    """Return what an evaluation found, wherever the run files lie: without the path of any run.

    Parameters
    ----------
    found : JSON value
        An evaluation document or a part of it.

    Returns
    -------
    JSON value
        The same without each ``path``, of the runs and of those named again before and after or under
        proof load.
    """
    if isinstance(found, Mapping):
        return {key: without_paths(value) for key, value in found.items() if key != "path"}
    if isinstance(found, list | tuple):
        return [without_paths(value) for value in found]
    return found
