"""Raw blocks to values in the units of their names: what the guards and the display look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers import SampleBlock, StreamFacts
from bufferstand.foundation.channels import STROKE_CHANNELS, Branch, Zero, mean_of_strokes, tilt_of_strokes

FORCES = ("force", "force_2")
"""The two ways to the force: the controller's, and an amplifier's of its own."""

DERIVED = ("stroke", "tilt")
"""Signals that are made of a device's draw wires: those of the controller lead, others have none."""


@dataclass(frozen=True)
class ScaledBlock:
    """A block in units, with the signals that are derived from its channels.

    Parameters
    ----------
    stream : str
        Name of the stream.
    first_sequence : int
        Absolute sequence number of row 0.
    time_us : NDArray[int64]
        Time stamps as received [µs], shape (n,).
    values : mapping of str to NDArray[float64]
        Calibrated channels, shape (n,) each; of the controller also ``stroke`` (mean of the draw wires
        there are, mm), ``tilt`` (of two draw wires stroke_1 − stroke_2, of more the largest difference of
        any two, mm) and ``following_error`` (command − position, mm).
    lost : int
        Samples known to be lost before row 0.
    received_s : float
        Host stand time at reception [s].
    missed : int
        Those of ``lost`` that the device never took.
    """

    stream: str
    first_sequence: int
    time_us: NDArray[np.int64]
    values: Mapping[str, NDArray[np.float64]]
    lost: int
    received_s: float
    missed: int = 0

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time_us)


def scale(
    block: SampleBlock, facts: StreamFacts, branches: Mapping[str, Branch] | None = None
) -> ScaledBlock:
    """Return a block with its channels calibrated and the derived signals added.

    Parameters
    ----------
    block : SampleBlock
        As delivered by the device.
    facts : StreamFacts
        What its stream is made of; a channel without counts in the block is left out.
    branches : mapping of str to Branch, optional
        Memory of the rising and falling branch, by channel, from the block before.

    Returns
    -------
    ScaledBlock
        Same rows, same time stamps.
    """
    values = {
        channel.name: channel.calibration.apply(
            block.counts[channel.name], (branches or {}).get(channel.name)
        )
        for channel in facts.channels
        if channel.name in block.counts
    }
    wires = [values[name] for name in STROKE_CHANNELS if name in values]
    if wires and "stroke" not in values:
        values["stroke"] = mean_of_strokes(wires)
    if len(wires) > 1:
        values["tilt"] = tilt_of_strokes(wires)
    if "command" in values and "position" in values:
        values["following_error"] = values["command"] - values["position"]
    return ScaledBlock(
        block.stream,
        block.first_sequence,
        block.time_us,
        values,
        block.lost,
        block.received_s,
        block.missed,
    )


def zeroed(facts: StreamFacts, zero: Zero | None) -> StreamFacts:
    """Return a stream whose channels count from a zero: for scaling now, and for the run's document."""
    if zero is None:
        return facts
    return replace(facts, channels=tuple(zero.apply(channel) for channel in facts.channels))
