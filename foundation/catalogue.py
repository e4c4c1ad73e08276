"""``[catalogue]`` of a specimen file: what the maker states of a spring that nobody has identified yet."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator

from foundation.settings import Settings


def _as_pairs(value: object) -> object:
    if not isinstance(value, list | tuple):
        return value
    return tuple(tuple(pair) if isinstance(pair, list) else pair for pair in value)


class Catalogue(Settings):
    """The static characteristic of a data sheet, and as much of the rest as is known."""

    points: Annotated[tuple[tuple[float, float], ...], BeforeValidator(_as_pairs)] = Field(min_length=2)
    """Pairs of stroke [mm] and force [kN] of the loading curve, from 0 mm (with the preload) on, rising."""
    absorbed_share: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Absorbed over stored energy of a full stroke; None: not known, and so is the heat."""
    heat_capacity_J_per_K: Annotated[float, Field(gt=0)] | None = None
    """Of the spring; None: not known, and so are temperatures."""
    force_margin: float = Field(default=1.15, ge=1.0)
    """By so much the forces may exceed the curve: batch, rate and cold."""

    @model_validator(mode="after")
    def _a_curve(self) -> Self:
        if self.points[0][0] != 0.0:
            raise ValueError(f"points begin at {self.points[0][0]:g} mm; the first is [0.0, preload_kN]")
        if self.points[0][1] < 0.0:
            raise ValueError("the force at 0 mm is below 0; it is the preload, 0 or more")
        for number, (before, after) in enumerate(pairwise(self.points), start=2):
            if not (after[0] > before[0] and after[1] > before[1]):
                raise ValueError(
                    f"point {number} [{after[0]:g}, {after[1]:g}] is not beyond [{before[0]:g}, "
                    f"{before[1]:g}]; stroke and force must both rise"
                )
        return self
