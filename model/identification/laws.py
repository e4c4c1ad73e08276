"""The parameters that runs can determine; options name them before anything heavy is imported."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Law:
    """A parameter beside the curves.

    Attributes
    ----------
    name, unit, symbol : str
        Name with unit as in the model file; unit and symbol for people.
    kind : "linear" or "log"
        Whether the vector holds its value or its natural logarithm.
    start, low, high : float
        First guess and bounds of the value.
    range : float
        By how much it may differ from the first guess before any run says so: an absolute figure, or a
        difference of logarithms. A run that does not halve it does not identify the parameter.
    off : float
        What stands in the model if the runs do not identify it.
    """

    name: str
    unit: str
    symbol: str
    kind: Literal["linear", "log"]
    start: float
    low: float
    high: float
    range: float
    off: float

    def to_vector(self, value: float) -> float:
        """Return what the vector holds of a value."""
        return math.log(value) if self.kind == "log" else value

    def to_value(self, entry: float) -> float:
        """Return the value of what the vector holds."""
        return math.exp(entry) if self.kind == "log" else entry


LAWS = (
    Law("transition_length_mm", "mm", "L", "log", 4.0, 0.3, 40.0, 1.0, 4.0),
    Law("sensitivity_per_K", "1/K", "c_ts", "linear", 0.005, 0.0, 0.03, 0.01, 0.0),
    Law("depth_mm", "mm", "alpha", "log", 15.0, 1.0, 200.0, 1.0, 20.0),
    Law("loss_sensitivity_per_K", "1/K", "c_eta", "linear", 0.001, 0.0, 0.02, 0.003, 0.0),
    Law("capacity_J_per_K", "J/K", "C", "log", 15000.0, 300.0, 3e6, 1.5, 15000.0),
    Law("loss_W_per_K", "W/K", "lambda", "log", 8.0, 0.05, 500.0, 1.5, 8.0),
    Law("sensor_lag_s", "s", "sensor lag", "log", 15.0, 0.1, 2000.0, 1.5, 15.0),
    Law("beta", "", "beta", "linear", 0.03, 0.0, 0.6, 0.06, 0.0),
    Law("tau_s", "s", "tau", "log", 6.0, 0.01, 600.0, 2.0, 6.0),
    Law("spectrum_per_decade", "", "b", "linear", 0.02, 0.0, 0.4, 0.05, 0.0),
)
"""Every parameter that is not a point of a curve, in the order of the vector."""

NAMES = tuple(law.name for law in LAWS)
