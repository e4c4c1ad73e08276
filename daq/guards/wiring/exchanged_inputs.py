"""Force and a way with each other's inputs: the “way” leaps as only a force does, and the “force” does not.

A piston at some mm/s meets a frame of 150 kN/mm: the force leaps by kilonewtons within hundredths of a
millimetre. A channel of a way that does so carries a force. Whether it is exchanged with the force, and has
not slipped, the second force tells, else that the force goes by millimetres as the piston does.
"""

from __future__ import annotations

import numpy as np

from bufferstand.daq.guards.wiring.doubt import SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch, noise_of

LEAPS_MM, LEAPS_TIMES = 0.6, 3.0
"""A way goes farther than the piston by no more than this, and so many times its way."""
WITHIN_S = (0.02, 0.05, 0.1, 0.3)
"""… within any of these times."""
COMES_S = 0.2
"""Where the piston is only known by its command, it may have begun to move so long before [s]."""
LITTLE = 0.35
"""The force rises by less than this share of the leap, where it is no force."""
MUCH = 0.5
"""… and the second force by more than this share."""
AS_FAR = (0.7, 1.3)
"""A force that goes as the piston does changes by so many kN per mm."""
WAY_MM, LOOKED_AT_MM = 0.15, 0.4
"""That is seen over so much of the way, and looked at over the last so much [mm]."""
SIGMAS = 4.0
GROWS = 0.6
"""A leap of which no more than this share comes within the shortest time is a force that rises."""
AS_ONE_MM, AS_ONE_SHARE, GONE_MM = 0.7, 0.9, 1.0
"""A force that is the position is within this of the command for this share of the time (the piston follows
late), and shows so over so much of a way [mm]."""
STRIDE, STEP_MM = 10, 0.1
"""A way is looked at over so many points, where it is so much at least [mm]."""
CLOCKS_S = 0.1
"""The second force's clock is known to this [s]."""
ALIKE = 0.98
"""… and is in step with it by this correlation."""


def exchanged(stretch: SampleStretch, least_mm: float = LEAPS_MM) -> SignalDoubt | None:
    """Return a doubt where the force and a way have each other's values, None where nothing says so.

    Parameters
    ----------
    stretch : Stretch
        Up to where it leaps.
    least_mm : float
        A leap of less is none [mm].
    """
    smooth = stretch.smoothed()
    force = smooth.values.get("force")
    if force is None or len(smooth) < 5:
        return None
    for name in (*smooth.wires, "position"):
        found = _leap(smooth, name, least_mm)
        if found is None:
            continue
        leap_mm, way_mm, rows = found
        rise_kN = float(np.ptp(force[rows]))
        if rise_kN < LITTLE * leap_mm and _force_is_elsewhere(smooth, name, rows, leap_mm):
            went = f"{name} leaps by {leap_mm:.1f} mm where the piston goes {way_mm:.2f} mm"
            return swapped(name, f"{went}, and force by {rise_kN:.2f} kN", leap_mm)
    return None


def swapped(name: str, text: str, value: float | None = None) -> SignalDoubt:
    """Return the doubt of a force that is exchanged with a way."""
    setting = f"{channel_setting('force', 'registers')} and {channel_setting(name, 'registers')}"
    return SignalDoubt(
        "swapped", f"force, {name}", "controller", setting, f"{text}: they are exchanged", value, None, "mm"
    )


def with_the_position(rows: Floats, told: int, position: int, force: int) -> tuple[SignalDoubt | None, str]:
    """Return what a force that reads as the piston is told says, beside a doubt of the position.

    Parameters
    ----------
    rows : NDArray, shape (n, channels)
        The last seconds.
    told, position, force : int
        The columns of command, position and force.

    Returns
    -------
    Doubt or None
        That both are exchanged, once the force has gone the command's way.
    str
        Else what is to be added where it only stands at the command's value; empty where it does not.
    """
    way, kN = rows[:, told], rows[:, force]
    off = float(np.quantile(np.abs(kN - way), AS_ONE_SHARE)) if len(rows) else np.inf
    if _steps_as(rows[:, position], way):  # it has leapt, or is off: it is a way all the same
        return None, ""
    if off > AS_ONE_MM or float(np.max(np.abs(way))) < 2.0 * AS_ONE_MM:
        return None, ""
    reads = f"force reads {kN[-1]:.1f} kN where the piston was told {way[-1]:.1f} mm"
    if float(np.ptp(way)) > GONE_MM and goes_as(kN, way):
        text = f"{reads}, and goes as many kN as it is told mm, which the position does not"
        return swapped("position", text, off), ""
    return None, f"; {reads}: if it stays so in motion, they are exchanged"


def _steps_as(position: Floats, told: Floats) -> bool:
    """Return whether a position goes mostly as it is told, whatever it does for a moment."""
    gone, own = (values[STRIDE:] - values[:-STRIDE] for values in (told, position))
    moves = np.abs(gone) > STEP_MM
    return bool(moves.any()) and AS_FAR[0] < float(np.median(own[moves] / gone[moves])) < AS_FAR[1]


def goes_as(force: Floats, way: Floats) -> bool:
    """Return whether a force changes by as many kN as a way does by mm, and in step with it."""
    if len(way) < 5 or float(np.ptp(way)) < WAY_MM or float(np.ptp(force)) == 0.0:
        return False
    slope = float(np.polyfit(way, force, 1)[0])
    return AS_FAR[0] < slope < AS_FAR[1] and float(np.corrcoef(way, force)[0, 1]) > ALIKE


def _leap(smooth: SampleStretch, name: str, least_mm: float) -> tuple[float, float, slice] | None:
    """Return how far a way leapt where the piston did not, how far that went, and the rows; None if not."""
    own, piston = smooth.values.get(name), smooth.values.get("position")
    before_s = 0.0
    if name == "position" or piston is None:
        piston, before_s = smooth.told, COMES_S
    if own is None or piston is None:
        return None
    best: tuple[float, float, slice] | None = None
    for span_s in WITHIN_S:
        starts = np.searchsorted(smooth.time_s, smooth.time_s - span_s)
        leaps = np.abs(own - own[starts])
        end = int(np.argmax(leaps))
        since = int(np.searchsorted(smooth.time_s, smooth.time_s[end] - span_s - before_s))
        way_mm, leap_mm = float(np.ptp(piston[since : end + 1])), float(leaps[end])
        beyond = leap_mm > LEAPS_TIMES * way_mm + least_mm
        if beyond and (best is None or leap_mm > best[0]):
            best = leap_mm, way_mm, slice(int(starts[end]), end + 1)
    return best


def _force_is_elsewhere(smooth: SampleStretch, name: str, rows: slice, leap_mm: float) -> bool:
    """Return whether there was a force where a way leapt, or the “force” is a way: it has not slipped."""
    since_s = float(smooth.time_s[rows.start]) - CLOCKS_S
    if np.count_nonzero(smooth.second_s < since_s) > 2:
        before = smooth.second_kN[smooth.second_s < since_s]
        then = smooth.second_kN[smooth.second_s >= since_s]
        noise_kN = SIGMAS * noise_of(before)
        return len(then) > 0 and float(then.max()) - float(np.median(before)) > MUCH * leap_mm + noise_kN
    if _grows(smooth.time_s, smooth.values[name], leap_mm):
        return True
    piston = smooth.told if smooth.told is not None else smooth.values.get("position")
    if piston is None:
        return False
    far = np.flatnonzero(np.abs(piston - piston[-1]) > LOOKED_AT_MM)
    first = int(far[-1]) if len(far) else 0
    return goes_as(smooth.values["force"][first:], piston[first:])


def _grows(time: Floats, own: Floats, leap_mm: float) -> bool:
    """Return whether a way leaps little by little, as a force rises: what slips does so at once."""
    at_once = np.abs(own - own[np.searchsorted(time, time - WITHIN_S[0])])
    return float(at_once.max()) < GROWS * leap_mm
