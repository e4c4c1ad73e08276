"""A limit that a step breaks: the message, and the nearby values that would keep it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bufferstand.protocols.limits import TOLERANCE, Bound

BELOW_ZERO = "prestress_mm − amplitude_mm >= 0"
"""Name of the limit that keeps the actuator in contact (paper § 3.1: no force impacts)."""

HYDRAULICS = "force_speed"
"""Name of the limit that the hydraulics set: how fast the piston can be at how much force."""

KNOWN = "known force"
"""Name of the limit that a curve's end sets: beyond it no force is known."""

RESOLUTION = 0.01
"""Steps in which admissible values are proposed [mm, mm/s]; frequencies in tenths of it [Hz]."""


@dataclass(frozen=True)
class BrokenLimit:
    """A limit that a step breaks.

    Parameters
    ----------
    limit : str
        Name of the limit.
    problem : str
        What is asked, and what is allowed by whom.
    nearest : dict of str to float
        Keys of the step to change, with their nearest admissible values; empty if there are none.
    advice : str
        What to do where no other value helps.
    """

    limit: str
    problem: str
    nearest: dict[str, float]
    advice: str = ""

    def remedy(self) -> str:
        """Return the nearest admissible values, or what else to do, as a sentence."""
        if self.advice:
            return self.advice
        if not self.nearest:
            return "no value of this step's keys is admissible: check the limits and the spring model"
        values = ", ".join(f"{key} = {value:.10g}" for key, value in self.nearest.items())
        return f"nearest admissible{', taken together' if len(self.nearest) > 1 else ''}: {values}"


def within(part: str, found: BrokenLimit, keys: Mapping[str, str]) -> BrokenLimit:
    """Return a breach of one part of a step, named, with the keys as the step has them."""
    nearest = {f"{keys.get(key, key)} ({part})": value for key, value in found.nearest.items()}
    return BrokenLimit(found.limit, f"{part}: {found.problem}", nearest)


def said(what: str, value: float, bound: Bound) -> tuple[str, str]:
    """Return the name of a bound that a value is above, and that as a sentence."""
    return bound.name, f"{what} = {value:.4g} {bound.unit} is above {bound.text()}"


def too_fast(what: str, force_kN: float, allowed_mm_per_s: float) -> str:
    """Return the sentence that the hydraulics do not deliver a speed at a force."""
    return (
        f"{what} at {force_kN:.4g} kN is more than the hydraulics deliver there: {allowed_mm_per_s:.4g} mm/s "
        f"({HYDRAULICS} of the stand)"
    )


def over(key: str, value: float, bound: Bound) -> BrokenLimit | None:
    """Return the breach of a key that is above a bound, with the bound as its nearest value."""
    if bound.allows(value):
        return None
    return BrokenLimit(*said(key, value, bound), {key: bound.value})


def down(value: float, resolution: float = RESOLUTION) -> float:
    """Round down to the resolution; what is below it stays as it is."""
    if value < resolution:
        return value
    return round(math.floor(value / resolution * (1.0 + TOLERANCE)) * resolution, 6)


def greatest_share(keeps: Callable[[float], bool], size: float) -> float:
    """Return the greatest share of ``size`` (to the resolution) that keeps the limits; 0 if none does.

    ``keeps`` must hold below some share and not above it.
    """
    low, high = min(1.0, RESOLUTION / size), 1.0
    if not keeps(low):
        return 0.0
    while (high - low) * size > RESOLUTION / 4.0:
        middle = (low + high) / 2.0
        low, high = (middle, high) if keeps(middle) else (low, middle)
    return low
