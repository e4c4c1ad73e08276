"""The form in which the page gets a span: extremes in buckets of time, for a chart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.sample_rows import finite

MOST_POINTS = 1000
"""Of an answer: more than a screen has columns for a chart."""


def answer(
    units: Mapping[str, str],
    numbers: NDArray[np.int64] | None = None,
    width_s: float | None = None,
    values: Mapping[str, NDArray[np.float64]] | None = None,
    ends_s: tuple[float | None, float | None] = (None, None),
    digits: int = 0,
) -> dict[str, Any]:
    """Return what a chart of a span shows; with the units alone, that of a record without samples.

    Parameters
    ----------
    units : mapping of str to str
        Of all channels that there are, by name.
    numbers : NDArray[int64], optional
        Of the span's buckets, shape (n,); number k begins at k times the width.
    width_s : float, optional
        Of a bucket [s].
    values : mapping of str to NDArray[float64], optional
        Least and greatest values by channel, shape (2, n) each; NaN where nothing was read.
    ends_s : (float, float), optional
        Where all that there is begins and ends [s].
    digits : int
        Of the times.

    Returns
    -------
    dict
        ``channels`` with ``name`` and ``unit``; ``t`` (middle of each bucket, s), ``values`` by channel
        (``low``, ``high``; None where nothing was read), ``width_s``, ``first_s`` and ``last_s``.
    """
    middles = (
        [] if numbers is None or width_s is None else np.round((numbers + 0.5) * width_s, digits).tolist()
    )
    return {
        "channels": [{"name": name, "unit": unit} for name, unit in units.items()],
        "t": middles,
        "values": {
            name: {"low": [finite(v) for v in low], "high": [finite(v) for v in high]}
            for name, (low, high) in (values or {}).items()
        },
        "width_s": width_s,
        "first_s": ends_s[0],
        "last_s": ends_s[1],
    }
