"""Signs: compression is positive, loading raises the force, and a specimen takes up energy."""

from __future__ import annotations

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.run_view import RunView, Samples

MOSTLY = 2.0
"""A channel is mostly negative where it reaches so many times as far below zero as above."""
FALLS = -0.5
"""Loading makes the force fall where their correlation is below this; of a loop without stiffness it is 0."""
TURNED = 0.02
"""A loop runs the wrong way round where its area is below minus this share of its stroke times its force …"""
MOST_CYCLES = 0.8
"""… in this share of the cycles."""
_LOOKED_AT = 20_000
_MOST = (0.01, 0.99)


def turned_signs(look: RunView) -> list[Finding]:
    """Return the channels whose sign is turned.

    A draw gear that is pulled, and a damper that works both ways, are none. Both turned at once look like a
    specimen that is pulled, which a buffer is not.

    Parameters
    ----------
    look : Look
    """
    negative = [channel.quantity for channel in (look.force, look.stroke) if _is_negative(channel)]
    falls, backwards = force_falls(look), _runs_backwards(look)
    if falls and len(negative) == 1:
        (name,) = negative
        return [_finding(look, name, f"{name} is mostly negative, and falls with loading")]
    if backwards or (falls and look.facts.specimen.get("kind") == "buffer"):
        name = negative[0] if len(negative) == 1 else "force"
        why = "the loops run the wrong way round (the specimen gives off energy)"
        if not falls and name == "force":
            why += (
                "; as loading raises the force, it may come later than the stroke that makes it: look at the "
                "delay_s of both"
            )
        return [_finding(look, name, why if backwards else "loading makes the force fall")]
    if len(negative) == 2 and not falls and look.facts.specimen.get("kind") == "buffer":
        why = "force and stroke are mostly negative, and a buffer takes no tension"
        return [_finding(look, name, why) for name in negative]
    return []


def _is_negative(channel: Samples) -> bool:
    low, high = (channel.share(share) for share in _MOST)
    return low < 0.0 and -low > MOSTLY * max(high, 0.0)


def force_falls(look: RunView) -> bool:
    """Say whether the force falls as the stroke rises."""
    every = -(-look.record.force_kN.size // _LOOKED_AT)
    force, stroke = look.record.force_kN[::every], look.record.stroke_mm[::every]
    force, stroke = force - np.mean(force), stroke - np.mean(stroke)
    spread = float(np.sqrt(np.dot(force, force) * np.dot(stroke, stroke)))
    return spread > 0.0 and float(np.dot(force, stroke)) < FALLS * spread


def _runs_backwards(look: RunView) -> bool:
    _, _, _, lower_kN, upper_kN, absorbed_J, _, _, range_mm, _, _ = look.whole_figures.T
    box_J = range_mm * (upper_kN - lower_kN)
    turned = absorbed_J[box_J > 0.0] < -TURNED * box_J[box_J > 0.0]
    return bool(turned.size) and float(np.mean(turned)) >= MOST_CYCLES


def _finding(look: RunView, name: str, why: str) -> Finding:
    text = (
        f"{name} has the wrong sign: {why}; compression is positive: import the record again with "
        f"--invert {name}, or mend the wiring or the calibration"
    )
    start_s, end_s = float(look.force.time_s[0]), float(look.force.time_s[-1])
    return Finding("sign", name, start_s, end_s, look.all_cycles, None, "", text, "spoils", whole_record=True)
