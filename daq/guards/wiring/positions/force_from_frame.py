"""Checks the force by the compliance of the machine: piston and draw wires differ by ``F / k``.

Where two draw wires go together, and with the piston as under a small force, it is the large one that is read
that is wrong, or the stiffness that is stated: not both wires by one and the same error.
"""

from __future__ import annotations

from collections.abc import Mapping

from bufferstand.daq.guards.wiring.doubt import SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.recent_state import RecentState
from bufferstand.daq.guards.wiring.settings import FRAME_SHARES

TOGETHER = 0.5
"""Wires go together within this share of what they may be off the piston by."""
AHEAD = 0.25
"""… and ahead of it by no more than this share: seating, and a zero."""
STIFFNESS = "[limits] machine_stiffness_kN_per_mm"
"""Where the machine's stiffness is stated."""


def force_instead(
    scene: RecentState, behind: Mapping[str, float], least: float, close: float, unit: str
) -> SignalDoubt | None:
    """Return the doubt of a force under which the machine would give way by more, None where it is a wire's.

    Parameters
    ----------
    scene : Scene
    behind : mapping of str to float
        How far each draw wire is behind the piston, in millimetres or as a share of the way.
    least : float
        How far it must be at least under the force that is read.
    close : float
        Within this they agree.
    unit : str
        Of all three, for the message.
    """
    force_kN, frame = scene.now("force"), scene.guard.frame_kN_per_mm
    values = behind.values()
    if force_kN is None or not values:
        return None
    together = max(values) - min(values) < TOGETHER * close
    under_less = min(values) > -AHEAD * close and max(values) < least - TOGETHER * close
    if not (together and under_less):
        return None
    mean = sum(values) / len(values)
    text = (
        f"force reads {force_kN:.1f} kN, under which the machine gives way by {least:.3g}{unit} at least "
        + (f"(stated are {frame:g} kN/mm, and {FRAME_SHARES[0]:g} times the way allowed)" if frame else "")
        + f"; by piston and {' and '.join(behind)} it does by {mean:.3g}{unit}: the force's scale is too "
        "large, or a stiffness is stated that the machine has not"
    )
    # Of one wire its own scale may as well be what is wrong.
    sensor = "force" if len(behind) > 1 else ", ".join(("force", *behind))
    setting = f"{channel_setting(sensor, 'calibration')}, or {STIFFNESS}"
    return SignalDoubt("scale", sensor, "controller", setting, text, mean, least, unit.strip())
