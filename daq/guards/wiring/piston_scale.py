"""Compares the position with its command over a whole stretch: scale, sign, zero.

The live judge (:mod:`bufferstand.daq.guards.wiring.positions.piston`) needs some millimetres of an even
motion. Over a stretch that is looked at afterwards half a millimetre tells a scale of one half from that of
one."""

from __future__ import annotations

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.exchanged_inputs import goes_as, swapped
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch
from bufferstand.foundation.numbers import likeness

TRAVEL_MM = 0.2
"""So far it was told to go at least."""
SETTLED_S = 0.4
"""What a motion begins with is left out [s]: a valve's overlap, a servo's lag."""
SLOPE_OFF, OFF_MM = 0.08, 0.06
"""Position over command is 1 to within this, and this way over the travel: noise, and a lag that changes."""
STANDS_S, STANDS_MM, OFFSET_MM = 0.2, 0.05, 1.0
"""Where command and position have stood for so long, to within this, they agree to within that."""
STILL = 0.15
"""A position that goes less than this share of its way stands still."""
MOVED_MM, PRESSED_KN = 0.5, 3.0
"""That a piston has moved although its position stands is seen by a wire, or by a force, that did this."""


def misled(  # noqa: PLR0911 - one return for each thing that can be wrong
    stretch: SampleStretch, *, follows: bool
) -> SignalDoubt | None:
    """Return what is wrong with the position by its command, None if nothing is seen.

    Parameters
    ----------
    stretch : Stretch
        From rest on.
    follows : bool
        Whether it is slow enough that any actuator follows: of another one no scale is told.
    """
    smooth = stretch.smoothed()
    told, at, force = smooth.told, smooth.values.get("position"), smooth.values.get("force")
    if told is None or at is None or len(smooth) < 10:
        return None
    rows = _one_way(smooth.time_s, told)
    travel_mm = float(abs(told[rows][-1] - told[rows][0])) if rows.stop - rows.start > 5 else 0.0
    if travel_mm < TRAVEL_MM:
        return _offset(smooth, told, at)
    slope = float(np.polyfit(told[rows], at[rows], 1)[0])
    if abs(slope - 1.0) <= SLOPE_OFF + OFF_MM / travel_mm:
        return _offset(smooth, told, at)
    went = (
        f"the piston's position went {slope * travel_mm:+.2f} mm where it was told to go {travel_mm:.2f} mm"
    )
    if force is not None and abs(slope) < 3.0 * STILL and goes_as(force[rows], told[rows]):
        return swapped("position", f"{went}, and force changed by as many kN", slope)
    if abs(slope) < STILL:
        moved = follows and _moved(smooth, force)
        return _doubt("still", f"{went}: it stands still", slope) if moved else None
    if slope < -0.3:
        return _doubt("sign", f"{went}: its sign is turned", slope)
    if not follows:
        return None
    look = likeness(slope)
    return _doubt("scale", f"{went}, {slope:.2f} times as far" + (f", {look}" if look else ""), slope)


def _one_way(time: Floats, told: Floats) -> slice:
    """Return the rows of the last long way in one direction, without its beginning."""
    step = np.diff(told, prepend=told[0])
    moving = np.flatnonzero(np.abs(told - told[0]) > 0.02)
    if not len(moving):
        return slice(0, 0)
    begin = int(moving[0])
    sign = np.sign(told[begin] - told[0])
    turn = begin + int(np.argmax(sign * told[begin:]))
    back = np.flatnonzero(sign * step[begin:turn] < -1e-6)
    begin += int(back[-1]) + 1 if len(back) else 0
    return slice(int(np.searchsorted(time, time[begin] + SETTLED_S)), turn + 1)


def _offset(smooth: SampleStretch, told: Floats, at: Floats) -> SignalDoubt | None:
    """Return a doubt where both stand, in different places."""
    rows = slice(0, int(np.searchsorted(smooth.time_s, smooth.time_s[0] + STANDS_S)))
    if smooth.time_s[-1] - smooth.time_s[0] < STANDS_S or rows.stop < 3:
        return None
    if max(float(np.ptp(told[rows])), float(np.ptp(at[rows]))) > STANDS_MM:
        return None
    off_mm = float(np.mean(at[rows] - told[rows]))
    if abs(off_mm) < OFFSET_MM:
        return None
    text = (
        f"the piston's position reads {float(np.mean(at[rows])):+.2f} mm at rest, where the controller "
        f"holds it at {float(np.mean(told[rows])):+.2f} mm: its zero is off"
    )
    return _doubt("zero", text, off_mm)


def _moved(smooth: SampleStretch, force: Floats | None) -> bool:
    ways = [float(np.ptp(smooth.values[name])) for name in smooth.wires]
    pressed = [] if force is None else [float(np.ptp(force))]
    return max(ways, default=0.0) > MOVED_MM or max(pressed, default=0.0) > PRESSED_KN


def _doubt(kind: Kind, text: str, value: float) -> SignalDoubt:
    setting = channel_setting("position", "calibration")
    return SignalDoubt(
        kind, "position", "controller", setting, text, value, None, "mm" if kind == "zero" else ""
    )
