"""Whether a page shows the statement: an own template sets the whole document, and could hide it."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

DOTS_PER_INCH = 72.0
"""A dot a point: enough to see letters of the size of the statement."""
_VERDICT_PT = 34.0 / 25.4 * 72.0
"""Width of the column of the verdict [pt], as in ``report.typ``."""
_CONTRAST = 80.0
"""Least difference of grey (of 255) between letters and their ground; the shipped ones have 120 and more."""
_INKED = 0.01
"""Least share of the dots that letters darken (or brighten, on a dark ground); the shipped ones do 5 %."""


def statement_shown(corners: Sequence[Mapping[str, Any]], pages: Sequence[bytes]) -> bool:
    """Say whether verdict and sentence of a report's first statement can be seen on its first page.

    Parameters
    ----------
    corners : sequence of mapping
        Upper left and lower right corner of each statement (``page``, and ``x``, ``y`` such as ``"51.2pt"``,
        from the upper left of the page), as the typesetter placed them; of these the first two count.
    pages : sequence of bytes
        The pages as PNG, with :data:`DOTS_PER_INCH`.

    Returns
    -------
    bool
        False where it is not set at all, lies elsewhere, or has no letters that stand out from their ground:
        hidden, of the colour of the ground, or covered.
    """
    if len(corners) < 2:
        return False
    first, last = corners[:2]
    left, top, right, bottom = (
        round(float(str(corner[key]).removesuffix("pt"))) for corner in (first, last) for key in ("x", "y")
    )
    if first["page"] != 1 or last["page"] != 1 or not pages:
        return False
    page = _grey(pages[0])
    height, width = page.shape
    if not (0 <= left < right <= width and 0 <= top < bottom <= height):
        return False
    # The page may be set smaller to hold all of it; the column of the verdict is less wide then.
    middle = left + round(min(_VERDICT_PT, 0.3 * (right - left)))
    return all(_has_letters(part) for part in (page[top:bottom, left:middle], page[top:bottom, middle:right]))


def _grey(png: bytes) -> NDArray[np.float64]:
    from PIL import Image  # noqa: PLC0415 - slow to import, and rarely needed

    return np.asarray(Image.open(io.BytesIO(png)).convert("L"), dtype=np.float64)


def _has_letters(part: NDArray[np.float64]) -> bool:
    """Say whether some of a part stands out from what most of it is."""
    if not part.size:
        return False
    ground = float(np.median(part))
    return float(np.mean(np.abs(part - ground) > _CONTRAST)) >= _INKED
