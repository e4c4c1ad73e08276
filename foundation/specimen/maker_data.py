"""``[catalogue]`` of a specimen file: what the maker states of a spring that nobody has identified yet."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.foundation.settings import Settings, Within, WrongKeyError


def _as_pairs(value: object) -> object:
    if not isinstance(value, list | tuple):
        return value
    return tuple(tuple(pair) if isinstance(pair, list) else pair for pair in value)


class Catalogue(Settings):
    """The static characteristic of a data sheet, and as much of the rest as is known."""

    points: Annotated[
        tuple[tuple[float, float], ...],
        BeforeValidator(_as_pairs),
        Within(0.0, 10_000.0, "strokes of 10 m and forces of 10 MN are no buffer's, and it cannot pull"),
    ] = Field(min_length=2)
    """Pairs of stroke and force of the loading curve, such as ``[[0.0, 10.0], [25.0, 60.0], [105.0,
    590.0]]``; the first is at stroke 0 with the preload, and both rise.
    """
    absorbed_share: (
        Annotated[
            float, Field(gt=0, lt=1), Within(0.001, 0.999, "every spring absorbs some, and none absorbs all")
        ]
        | None
    ) = None
    """Absorbed over stored energy of a full stroke. Without it heat is not known."""
    heat_capacity_J_per_K: (
        Annotated[
            float,
            Field(gt=0),
            Within(100.0, 1e7, "100 J/K are 50 g of rubber, 10 MJ/K are 5 t: no spring of a buffer"),
        ]
        | None
    ) = None
    """Of the spring. Without it temperatures are not known [J/K]."""
    force_margin: Annotated[
        float, Field(ge=1.0), Within(1.0, 3.0, "a spring of three times the force is another spring")
    ] = 1.15
    """By this factor the force may lie above the curve (batch, speed, cold)."""

    @model_validator(mode="after")
    def _a_curve(self) -> Self:
        if self.points[0][0] != 0.0:
            raise WrongKeyError(
                f"points begin at {self.points[0][0]:g} mm; the first is [0.0, preload_kN]", "points"
            )
        if self.points[0][1] < 0.0:
            raise WrongKeyError("the force at 0 mm is below 0; it is the preload, 0 or more", "points")
        for number, (before, after) in enumerate(pairwise(self.points), start=2):
            if not (after[0] > before[0] and after[1] > before[1]):
                raise WrongKeyError(
                    f"points: point {number} [{after[0]:g}, {after[1]:g}] is not beyond [{before[0]:g}, "
                    f"{before[1]:g}]; stroke and force must both rise",
                    "points",
                )
        return self
