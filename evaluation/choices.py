"""What a user of the evaluation can choose from: options name it before anything heavy is imported."""

from __future__ import annotations

from typing import Literal

DecisionRule = Literal["simple", "guard-band"]
"""How a value near a limit is judged (contracts § 4)."""
ForceCell = Literal["moving-side", "fixed-side"]
"""Where the load cell is: it pushes the moving mass, or stands behind the specimen."""
DRAWS = 2000
"""Monte Carlo draws a run, unless another number is asked for."""
REFERENCE_LOSS = 0.001
"""Largest loss factor that a steel spring as reference is taken to have, unless its user states another."""
