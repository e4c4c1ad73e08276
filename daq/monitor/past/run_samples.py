"""The samples of a run block by block, every channel by its name, and the stroke that its draw wires give."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording.runfile import Run, mean_stroke

Floats = NDArray[np.float64]


def units_of(run: Run) -> dict[str, str]:
    """Return the units of all channels of a run, and of the stroke that its draw wires give, by name."""
    units = {one.name: one.unit for stream in run.streams.values() for one in stream.channels.values()}
    return units if "stroke" in units or not _wires(list(units)) else {"stroke": "mm", **units}


def _wires(names: Sequence[str]) -> list[str]:
    """Return those channels whose mean is the stroke."""
    return [name for name in STROKE_CHANNELS if name in names]


def run_blocks(
    run: Run, names: Sequence[str], rows: int, only: Sequence[int] | None = None
) -> Iterator[tuple[Floats, dict[str, Floats]]]:
    """Return channels of one stream of a run block by block, with the stroke that its draw wires give.

    Parameters
    ----------
    run : Run
    names : sequence of str
        Channels of one stream.
    rows : int
        Of a block.
    only : sequence of int, optional
        As :meth:`~bufferstand.recording.runfile.Run.blocks`.

    Returns
    -------
    iterator of NDArray[float64] and dict
        Run time [s], and values by channel.

    Raises
    ------
    BadInput
        As :meth:`~bufferstand.recording.runfile.Run.blocks`.
    """
    wires = _wires(names)
    for block in run.blocks(names, rows, only):
        values = {name: one.value for name, one in block.items()}
        if wires and "stroke" not in values:
            values["stroke"] = mean_stroke([block[name] for name in wires]).value
        yield block[names[0]].time_s, values
