"""Two channels that show one and the same signal: a wire on the wrong input, a register read twice."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SETTING, doubt
from bufferstand.evaluation.record import PISTON, Signals

SAME = 0.005
"""The force differs from a stroke in figures by less than this share of its range: it is that stroke."""
ALIEN = 0.1
"""A wire that is off the piston by this share of its way is the one that shows the force."""
LEAST = 5.0


def force_is_a_stroke(look: RunView, signals: Signals) -> list[Finding]:
    """Return whether force and one of the strokes show the same figures, kN for mm.

    Parameters
    ----------
    look : Look
    signals : Signals
    """
    force = signals.by_name["force"]
    span = float(np.ptp(force))
    if span < LEAST:
        return []
    for name in (*signals.strokes, *PISTON):
        other = signals.get(name)
        if other is None or float(np.std(force - other)) > SAME * span:
            continue
        if abs(float(np.mean(force - other))) > 0.05 * span:
            continue
        text = (
            f"force shows the same figures as {name}, kN for mm: one of them is on the input of the "
            f"other; look at the plugs, and at both channels in {SETTING} and the register profile"
        )
        position = signals.get("position")
        if name in signals.strokes and position is not None and _is_alien(other, position):
            return [doubt(look, "exchanged", name, None, "", text)]
        return [doubt(look, "exchanged", "force", None, "", text)]
    return []


def _is_alien(stroke: FloatArray, position: FloatArray) -> bool:
    """Say whether a wire does not follow the piston, and so is the one that shows the force."""
    return float(np.std(stroke - position)) > ALIEN * float(np.ptp(position))
