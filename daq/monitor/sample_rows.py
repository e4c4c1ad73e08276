"""Samples on their way to a screen: collected between two packets, thinned out, with their extremes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import StreamFacts

MOST_ROWS = 100
"""Rows of one packet at most: a screen shows no more, and 20 packets a second are 2000 rows."""
SHOWN = ("stroke", "force")
"""Signals that are drawn; ``position`` stands in for a stroke that nobody measures."""


def finite(value: float | None, digits: int = 4) -> float | None:
    """Return a number that JSON can hold, None for one that it cannot."""
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


def channels_of(streams: Iterable[StreamFacts]) -> list[dict[str, Any]]:
    """Return what is recorded: every channel of the streams, and the stroke that several draw wires give.

    Returns
    -------
    list of dict
        ``name``, ``quantity``, ``unit``, ``delay_s``, in the stand file's order.
    """
    found: list[dict[str, Any]] = [
        {"name": one.name, "quantity": one.quantity, "unit": one.unit, "delay_s": one.delay_s}
        for facts in streams
        for one in facts.channels
    ]
    names = {one["name"] for one in found}
    wires = [one for one in found if one["quantity"] == "stroke"]
    if wires and "stroke" not in names:
        delay_s = sum(float(one["delay_s"]) for one in wires) / len(wires)
        found.insert(0, {"name": "stroke", "quantity": "stroke", "unit": "mm", "delay_s": delay_s})
    return found


class RowBuffer:
    """Collects the controller's blocks until the next packet."""

    def __init__(self) -> None:
        self._blocks: list[ScaledBlock] = []

    def add(self, block: ScaledBlock) -> None:
        """Keep a block; it is not copied."""
        self._blocks.append(block)

    def drop(self) -> int:
        """Forget everything; return how many samples that were."""
        dropped = sum(len(block) for block in self._blocks)
        self._blocks.clear()
        return dropped

    def take(self) -> tuple[dict[str, Any], dict[str, list[float | None]]]:
        """Return (and forget) the rows and every signal's least and greatest value.

        Returns
        -------
        tuple of dict and dict
            Rows: ``t0_us`` (time stamp of the first), ``t`` [0.1 ms behind it], ``s`` (stroke, µm) and ``f``
            (force, N), all whole numbers, at most ``MOST_ROWS``, evenly chosen; empty if there are none.
            Extremes: by signal, over **every** sample, in the signal's unit.
        """
        blocks, self._blocks = [block for block in self._blocks if len(block)], []
        if not blocks:
            return {}, {}
        signals = set.intersection(*(set(block.values) for block in blocks))
        joined = {name: np.concatenate([block.values[name] for block in blocks]) for name in signals}
        time_us = np.concatenate([block.time_us for block in blocks])
        extremes = {
            name: [finite(np.min(value)), finite(np.max(value))] for name, value in sorted(joined.items())
        }
        return _rows(time_us, joined.get("stroke", joined.get("position")), joined.get("force")), extremes


def _rows(
    time_us: NDArray[np.int64], stroke_mm: NDArray[np.float64] | None, force_kN: NDArray[np.float64] | None
) -> dict[str, Any]:
    if stroke_mm is None or force_kN is None:
        return {}
    step = -(-len(time_us) // MOST_ROWS)
    whole = np.flatnonzero(np.isfinite(stroke_mm) & np.isfinite(force_kN))[::step]
    if not len(whole):
        return {}
    first_us = int(time_us[whole[0]])
    return {
        "t0_us": first_us,
        "t": ((time_us[whole] - first_us) // 100).tolist(),
        "s": np.rint(stroke_mm[whole] * 1000.0).astype(np.int64).tolist(),
        "f": np.rint(force_kN[whole] * 1000.0).astype(np.int64).tolist(),
    }
