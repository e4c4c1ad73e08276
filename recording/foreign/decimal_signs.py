"""Is it a decimal sign, or does it separate thousands? “1,234” beside “950” may be 1.234 or 1234."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.record import Floats

Texts = Callable[[NDArray[np.int64]], Iterable[str]]
"""Gives the cells of a column, by index."""
_GROUPS = 1000.0
_ENOUGH = 100
"""Cells of a block that may end in a zero: if zeros are left out, they are of one of them."""
_ROUNDING = 1e-6
"""Far above the rounding of numbers below a million."""


class DecimalSignEvidence:
    """Looks through one column for what tells a decimal sign from a separator of thousands.

    It may be the latter if every number that holds the sign has three digits behind it and one to three
    before it, the first of which is not 0, while others hold none and none of them has four digits.

    Parameters
    ----------
    sign : str
        The sign that is taken for the decimal sign.
    """

    def __init__(self, sign: str) -> None:
        self._sign = sign
        self._grouped = grouped_number(sign)
        self._cleared = False
        self._without = False
        self._first: tuple[int, str] | None = None

    @property
    def suspect(self) -> tuple[int, str] | None:
        """Get the first number that may have thousands (row and text); None if the sign is a decimal sign."""
        return self._first if self._without and not self._cleared else None

    def look(self, values: Floats, rows: NDArray[np.int64], texts: Texts, *, sign_there: bool = True) -> None:
        """Look at some more numbers of the column.

        Parameters
        ----------
        values : NDArray[float64]
            Read with the sign as decimal sign; NaN where there is none; shape (n,).
        rows : NDArray[int64]
            The number of each one's row, shape (n,).
        texts : callable
            Gives the cells as they stand, of the indices that are asked for; called only where values do not
            tell.
        sign_there : bool
            Whether the sign may be in one of them.
        """
        if self._cleared:
            return
        known = np.flatnonzero(np.isfinite(values))
        size = abs(values[known])
        if (size >= _GROUPS).any():
            self._cleared = True
            return
        whole = size == np.round(size)
        thousandths = np.round(size * _GROUPS)
        if (size[~whole] < 1.0).any() or (abs(size * _GROUPS - thousandths) > _ROUNDING).any():
            self._cleared = True
        elif not sign_there:
            self._without = self._without or bool(len(known))
        else:
            asked = known[_telling(whole, thousandths)]
            self._look_at_texts(rows[asked], texts(asked))

    def _look_at_texts(self, rows: NDArray[np.int64], texts: Iterable[str]) -> None:
        for row, text in zip(rows.tolist(), texts, strict=True):
            if self._sign not in text:
                self._without = self._without or text.strip("+-").isdigit()
            elif self._grouped.fullmatch(text) is None:
                self._cleared = True
                return
            elif self._first is None:
                self._first = (row, text)


def _telling(whole: NDArray[np.bool_], thousandths: Floats) -> NDArray[np.bool_]:
    """Return which cells to look at: where there may be no sign, or fewer than three digits behind it."""
    telling = whole.copy()
    telling[np.flatnonzero(~whole)[:1]] = True
    telling[np.flatnonzero(~whole & (thousandths % 10.0 == 0.0))[:_ENOUGH]] = True
    return telling


def perhaps_thousands(text: str, sign: str, path: Path, place: str) -> BadInput:
    """Return the message for a number that may be meant a thousand times larger."""
    return BadInput(
        f"“{text}” may be {text.replace(sign, '')}, with “{sign}” between thousands, or have the decimal "
        f"sign “{sign}”",
        file=path,
        place=place,
        remedy="state “decimal” in a mapping file, or export without thousands separators",
    )


def grouped_number(sign: str) -> re.Pattern[str]:
    """Return what a number below a million looks like with its thousands set apart."""
    return re.compile(rf"[+-]?[1-9]\d{{0,2}}{re.escape(sign)}\d{{3}}")
