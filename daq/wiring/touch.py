"""The force while first contact is touched off: the first rise that it ever makes in a campaign.

The controller creeps to a small force of its own reading and turns. The samples must show that force rise,
with the piston, no steeper than the machine's frame allows, and fall as the piston goes back: a sign, a
scale and a delay are seen at less than 2 kN.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.wiring.doubt import Doubt, Kind, channel_setting
from daq.wiring.facts import STIFFEST_FRAME_KN_PER_MM, WiringGuard
from foundation.likeness import likeness

Floats = NDArray[np.float64]

SMOOTHED_S = 0.02
"""Force and position are averaged over so long [s]."""
FALLS, RISES = 0.35, 0.35
"""A force that falls by this share of the touch's has the wrong sign; one that rises by less is another."""
STEEPER = 4.0
"""It rises over the piston's way by no more than so many times the machine's stiffness."""
STEP_MM = 0.01
"""A rise over less of the way cannot be told: an encoder has such steps."""
LATE_S, LATEST_S = 0.25, 3.0
"""It is late from this on; more than that is not looked for [s]."""
CAME_MM = 0.03
"""The piston came by this at least."""
SIGMAS = 5.0


def doubt_of_touch(
    time_s: Floats,
    force_kN: Floats,
    position_mm: Floats,
    guard: WiringGuard,
    *,
    asked_kN: float,
    turned: bool,
    own_kN: float | None,
) -> Doubt | None:
    """Return what a touch says against the force, None if nothing.

    Parameters
    ----------
    time_s, force_kN, position_mm : NDArray, shape (n,)
        From rest on, of one clock, moved by the delays that are stated.
    guard : WiringGuard
    asked_kN : float
        Force over that at rest at which the controller was to turn.
    turned : bool
        Whether it turned there, by its own reading.
    own_kN : float or None
        Its own reading at last, for the message.
    """
    if force_kN.size < 50:
        return None
    width = max(1, round(SMOOTHED_S * (force_kN.size - 1) / float(time_s[-1] - time_s[0])))
    kernel = np.full(width, 1.0 / width)
    force, place = (np.convolve(values, kernel, mode="valid") for values in (force_kN, position_mm))
    time = time_s[width // 2 :][: force.size]
    level = float(np.median(force[: max(10, force.size // 10)]))
    noise = 1.4826 * float(np.median(np.abs(np.diff(force_kN)))) / np.sqrt(2.0 * width)
    high, low = float(force.max()) - level, float(force.min()) - level
    least = max(FALLS * asked_kN, SIGMAS * noise)
    own = "" if own_kN is None else f" (its own reading is {own_kN:+.2f} kN now)"
    if low < -least and -low > 2.0 * high:
        text = f"force fell by {-low:.2f} kN as the piston touched the specimen{own}: its sign is turned"
        return _doubt("sign", "calibration", text, low, 0.0, "kN")
    if turned and high < max(RISES * asked_kN, SIGMAS * noise):
        look = likeness(high / asked_kN) if high > SIGMAS * noise else ""
        text = (
            f"force rose by {max(high, 0.0):.2f} kN only where the controller turned at "
            f"{asked_kN:.2f} kN of its "
            f"own{own}: another scale, another signal, or late" + (f" ({look})" if look else "")
        )
        return _doubt("scale", "calibration", text, high, asked_kN, "kN")
    if high <= least:
        return None
    return _steep(force - level, place, high, guard) or _late(time, force - level, place, high)


def _steep(force: Floats, place: Floats, high: float, guard: WiringGuard) -> Doubt | None:
    """Return a doubt where the force rises more steeply than any frame lets it."""
    top = int(np.argmax(force))
    begin = int(np.flatnonzero(force[: top + 1] < 0.2 * high)[-1]) if force[0] < 0.2 * high else 0
    rise_mm = float(place[top] - place[begin])
    frame = guard.frame_kN_per_mm or STIFFEST_FRAME_KN_PER_MM
    slope = (float(force[top]) - float(force[begin])) / max(rise_mm, STEP_MM)
    if top - begin < 3 or slope <= STEEPER * frame:
        return None
    stated = "as stated" if guard.frame_kN_per_mm else "as the stiffest has"
    text = (
        f"force rose by {slope:.0f} kN per mm of the piston at first contact, though the machine "
        "itself gives way "
        f"by 1 mm under {frame:.0f} kN, {stated}: its scale is too large"
    )
    return _doubt("scale", "calibration", text, slope, STEEPER * frame, "kN/mm")


def _late(time: Floats, force: Floats, place: Floats, high: float) -> Doubt | None:
    """Return a doubt where the force rises and falls later than the piston comes and goes."""
    above = np.flatnonzero(force > 0.5 * high)
    up, down = int(above[0]), int(above[-1])
    came_mm = float(place[up:].max() - place[: max(up, 1)].min())
    if down >= len(force) - 1 or came_mm < CAME_MM:
        return None  # it was never seen to fall, or the piston tells nothing
    lags = np.arange(0.0, LATEST_S, 0.01)
    apart = np.interp(time[up] - lags, time, place) - np.interp(time[down] - lags, time, place)
    even = np.flatnonzero(apart <= 0.0)
    late_s = float(lags[int(even[0])]) if len(even) else LATEST_S
    if late_s < LATE_S:
        return None
    text = (
        f"force rose and fell {late_s:.2f} s after the piston came to first contact and left it: it is late"
    )
    return _doubt("delay", "delay_s", text, late_s, LATE_S, "s")


def _doubt(kind: Kind, key: str, text: str, value: float, limit: float, unit: str) -> Doubt:
    return Doubt(kind, "force", "controller", channel_setting("force", key), text, value, limit, unit)
