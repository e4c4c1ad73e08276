"""What a user of the evaluation can choose from: options name it before anything heavy is imported."""

from __future__ import annotations

from typing import Literal

from bufferstand.foundation import BadInput

DecisionRule = Literal["simple", "guard-band"]
"""How a value near a limit is judged (docs/evaluation-document.md)."""
ForceCell = Literal["moving-side", "fixed-side"]
"""Where the load cell is: it pushes the moving mass, or stands behind the specimen."""
DRAWS = 2000
"""Monte Carlo draws a run, unless another number is asked for."""
FEWEST_DRAWS = 100
"""Of fewer, a standard deviation is known to worse than 7 %, and of one it would be 0."""
REFERENCE_LOSS = 0.001
"""Largest loss factor that a steel spring as reference is taken to have, unless its user states another."""


def check_draws(draws: int) -> int:
    """Return a number of draws.

    Raises
    ------
    BadInput
        If so few would state uncertainties that are none.
    """
    if draws < 0 or 0 < draws < FEWEST_DRAWS:
        raise BadInput(
            f"{draws} draws tell no uncertainty",
            remedy=f"say 0 (no uncertainties) or at least {FEWEST_DRAWS}",
        )
    return draws
