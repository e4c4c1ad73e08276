"""What a step asks for, as a text by which two plans are compared."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

DIGITS = 9
"""Numbers that agree to so many digits are the same: another way to write a rate."""


def asked_text(asked: Mapping[str, Any] | None, *, compensate: bool | None) -> str:
    """Return what a step asks for; empty where nobody has kept it, as earlier versions.

    Parameters
    ----------
    asked : mapping or None
        :attr:`bufferstand.protocols.steps.PlannedStep.asked`.
    compensate : bool or None
        Whose strokes are asked for.
    """
    return canonical_text([asked, compensate]) if asked else ""


def canonical_text(content: object) -> str:
    """Return data as JSON, keys in order, numbers to :data:`DIGITS` digits."""
    return json.dumps(_rounded(json.loads(json.dumps(content))), sort_keys=True)


def _rounded(content: Any) -> Any:
    if isinstance(content, list):
        return [_rounded(one) for one in content]
    if isinstance(content, dict):
        return {key: _rounded(one) for key, one in content.items()}
    if isinstance(content, int | float) and not isinstance(content, bool):
        return float(f"{content:.{DIGITS}g}")
    return content
