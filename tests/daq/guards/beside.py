"""What guards may ask beside what they look at, in these tests; and blocks for them to look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bufferstand.daq.scaling import ScaledBlock


@dataclass
class Around:
    """Times, air and thermometers as a test says."""

    at_s: float = 5.0
    wall_s: float = 100.0
    cut_off: bool = False
    ambient_C: float = 20.0
    temperatures: dict[str, float] = field(default_factory=dict)

    def latest_temperatures(self) -> Mapping[str, float]:
        return self.temperatures

    def guard(self, kind: Any) -> Any:  # noqa: ARG002
        return None


def block(
    values: Mapping[str, Any],
    *,
    stream: str = "controller",
    first: int = 0,
    at_us: int = 0,
    step_us: int = 1000,
    **more: Any,
) -> ScaledBlock:
    """Return a block of signals, a sample every so many microseconds from a time on."""
    arrays = {name: np.atleast_1d(np.asarray(one, dtype=float)) for name, one in values.items()}
    rows = max((len(one) for one in arrays.values()), default=0)
    times = at_us + step_us * np.arange(rows, dtype=np.int64)
    return ScaledBlock(stream, first, times, arrays, more.pop("lost", 0), more.pop("received_s", 7.5), **more)
