"""The recorded channels of a run by what they measure: pressure, acceleration, every force there is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation import INSIDE_UNIT, BadInput, to_inside
from bufferstand.foundation.channels import CHANNEL_UNITS
from bufferstand.recording.runfile import Run


@dataclass(frozen=True, eq=False)
class RecordedChannel:
    """A channel as it was recorded: calibrated, its delay taken off, in the unit of its quantity.

    Parameters
    ----------
    name, quantity, unit, place : str
        ``pressure_1``, ``pressure``, ``bar``, and where it is measured.
    time_s : array, shape (N,)
        On the run's time.
    value : array, shape (N,)
        NaN where there is no value.
    """

    name: str
    quantity: str
    unit: str
    place: str
    time_s: FloatArray
    value: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return its values at other instants [s], straight between its own; NaN before and behind them."""
        there = np.isfinite(self.time_s) & np.isfinite(self.value)
        if not np.any(there):
            return np.full(time_s.shape, np.nan)
        value = np.interp(time_s, self.time_s[there], self.value[there], left=np.nan, right=np.nan)
        return np.asarray(value, dtype=np.float64)


def channels_of_quantity(run: Run, quantity: str) -> tuple[RecordedChannel, ...]:
    """Return the channels of a run that measure a quantity, by name; empty if none does.

    Raises
    ------
    BadInput
        If there is no such quantity, or a dataset is damaged.
    """
    if quantity not in CHANNEL_UNITS:
        raise BadInput(
            f"no channel measures “{quantity}”",
            file=run.path,
            remedy=f"it is one of {', '.join(CHANNEL_UNITS)}",
        )
    kept = "stroke" if quantity in ("position", "command") else quantity
    found = []
    for stream in run.streams.values():
        for channel in stream.channels.values():
            if channel.quantity == quantity and stream.rows:
                series = run.series(channel.name)
                value = np.asarray(to_inside(series.value, kept, series.unit), dtype=np.float64)
                facts = channel.name, quantity, INSIDE_UNIT[kept], channel.place
                found.append(RecordedChannel(*facts, series.time_s, value))
    return tuple(sorted(found, key=lambda one: one.name))
