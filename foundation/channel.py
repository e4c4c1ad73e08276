"""A measuring channel as data: what it measures, its calibration, its delay and its uncertainty.

The same facts scale a reading in the acquisition loop and, years later, the raw counts in a run file.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from foundation.settings import Day, Numbers, Settings

Quantity = Literal["force", "stroke", "position", "command", "temperature", "speed"]


class Calibration(Settings):
    """How raw counts become the channel's unit: ``value = Σ coefficients[i] · counts**i``."""

    id: str = "nominal"
    coefficients: Numbers = Field(default=(0.0, 1.0), min_length=1)
    certificate: str = ""
    date: Day | None = None
    valid_until: Day | None = None

    def apply(self, counts: ArrayLike) -> NDArray[np.float64]:
        """Return counts of any shape in the channel's unit, same shape (Horner's scheme)."""
        raw = np.asarray(counts, dtype=np.float64)
        value = np.zeros_like(raw)
        for coefficient in reversed(self.coefficients):
            value = value * raw + coefficient
        return value

    def invert_linear(self, value: float) -> float:
        """Return the counts of a value, for a calibration of first degree (simulated devices).

        Raises
        ------
        ValueError
            If the calibration is not of first degree.
        """
        if len(self.coefficients) != 2 or self.coefficients[1] == 0.0:
            raise ValueError(f"calibration “{self.id}” is not linear")
        return (value - self.coefficients[0]) / self.coefficients[1]


class ChannelUncertainty(Settings):
    """What the certificate and the data sheet say; half-widths of limits unless named standard (``u_``)."""

    accuracy_percent: float | None = Field(default=None, ge=0)
    """Limit of the relative error of the value (class), % of the value."""
    reversibility_percent: float | None = Field(default=None, ge=0)
    """Limit of the difference rising/falling, % of the value."""
    zero: float | None = Field(default=None, ge=0)
    """Limit of the zero error, in the channel's unit."""
    linearity: float | None = Field(default=None, ge=0)
    """Limit of the smooth deviation from the straight line, in the channel's unit."""
    u_delay_s: float | None = Field(default=None, ge=0)
    """Standard uncertainty of the measured delay [s]."""


class Channel(Settings):
    """One channel of a stream of samples.

    The time at which a value was true is its device time stamp minus ``delay_s`` (filter, conversion),
    which is measured for each channel.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    quantity: Quantity
    unit: str
    place: str = ""
    delay_s: float = 0.0
    calibration: Calibration = Calibration()
    uncertainty: ChannelUncertainty = ChannelUncertainty()
