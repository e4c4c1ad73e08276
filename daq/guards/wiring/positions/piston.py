"""Compares the piston with its command: direction, way, and standstill.

What is allowed: it follows late (an actuator of some hertz, a valve's overlap), which at constant speed is a
constant distance, so that the slope of position against command shows the scale whatever the lag. A valve
that gives no more flow under force is slower than its command: near the stand's force the slope is not
looked at.
"""

from __future__ import annotations

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.positions.piston_delay import (
    BACK_S,
    explained_late_s,
    follows,
    late_piston,
    since_s,
)
from bufferstand.daq.guards.wiring.recent_state import (
    SLOW_MM_PER_S,
    Floats,
    RecentState,
    RepeatedFinding,
    slope_of,
)
from bufferstand.foundation.numbers import likeness

LATE_S = 0.4
"""The piston is where its command was within so long before [s]: 0.2 s of overlap, 0.1 s of servo lag and an
actuator of 3 Hz."""
APART_MM, APART_SHARE = 0.6, 0.04
"""… to within this, and this share of the way: zero and linearity of its encoder are 0.1 mm."""
SLOPE_OFF = 0.08
"""Position against command at constant speed: 1 to within this; a slow actuator that meets a preload on the
way falls behind by half a millimetre."""
TRAVEL_MM = 3.0
"""The slope is taken over so much of a constant motion at least."""
EVEN = 0.06
"""A speed is constant within this share."""
TIMES_MM, TIMES_OFF = 0.1, 0.2
"""Over so much of a way a scale that is so far off is told from a zero [mm]."""
SETTLED_S = 0.4
"""What a motion begins with is left out of its slope [s]."""
LOADED = 0.3
"""Above this share of the stand's force a valve may fall behind."""
LOOKS, APART_LOOKS = 2, 6
"""So many looks (50 ms each) must say it: a piston that stands 10 mm off is first a following error."""


class PistonJudge:
    """Holds the position against the command."""

    def __init__(self) -> None:
        self._lasting, self._far = RepeatedFinding(LOOKS), RepeatedFinding(APART_LOOKS)
        self.suspected = False
        """Whether the position was off at the last look: nothing is compared with it then."""

    @property
    def begun(self) -> bool:
        """Whether something has begun to look wrong, and more looks will tell."""
        return self._lasting.begun or self._far.begun

    def look(self, scene: RecentState) -> SignalDoubt | None:
        """Return what is wrong with the position, None if nothing is."""
        command, position = scene.points.column("command"), scene.points.column("position")
        if command is None or position is None:
            return None
        rows = scene.points.last(LATE_S + 0.1)
        if len(rows) < 2 or rows[-1, 0] - rows[0, 0] < LATE_S:
            return None
        return self._apart(scene, rows, command, position) or self._slope(scene, command, position)

    def _apart(self, scene: RecentState, rows: Floats, command: int, position: int) -> SignalDoubt | None:
        """Return a doubt where the position is nowhere that its command has been."""
        told = rows[:, command]
        fastest = float(np.max(np.abs(np.diff(told)) / np.diff(rows[:, 0])))
        if fastest > SLOW_MM_PER_S:
            self._far.sure("apart", False)
            self.suspected = False
            return None
        low, high = float(told.min()), float(told.max())
        at_mm = float(np.mean(rows[-scene.points.new :, position]))
        beyond_mm = max(low - at_mm, at_mm - high)
        most_mm = APART_MM + APART_SHARE * max(abs(low), abs(high))
        self.suspected = beyond_mm > most_mm
        if not self._far.sure("apart", self.suspected):
            return None
        now_mm = float(told[-1])
        ratio = self._times(scene, command, position, now_mm, at_mm)
        turned = ratio < -0.3
        look = likeness(ratio) if ratio > 0.0 else ""
        text = f"the piston's position reads {at_mm:.2f} mm where it was told {now_mm:.2f} mm"
        back = scene.points.last(BACK_S)
        late_s = since_s(back[:, 0], back[:, command], at_mm)
        if follows(back, command, position, late_s):
            return late_piston(text, late_s)
        text += ": its sign is turned" if turned else f" ({look})" if look else ""
        kind: Kind = "sign" if turned else "scale" if ratio else "zero"
        return _doubt(kind, text, beyond_mm, most_mm)

    @staticmethod
    def _times(scene: RecentState, command: int, position: int, now_mm: float, at_mm: float) -> float:
        """Return how many times its way the piston seems to go, 0 where that does not explain its place."""
        rows = scene.points.last(6.0)
        if len(rows) and float(np.ptp(rows[:, command])) > TIMES_MM:
            slope = slope_of(rows, position, command)
            if abs(slope - 1.0) > TIMES_OFF and abs(at_mm - slope * now_mm) < 0.5 * abs(at_mm - now_mm):
                return slope
        ratio = at_mm / now_mm if abs(now_mm) > 1.0 else 0.0
        return ratio if abs(now_mm) > 3.0 or abs(ratio + 1.0) < TIMES_OFF else 0.0

    def _slope(self, scene: RecentState, command: int, position: int) -> SignalDoubt | None:
        rows = _even_stretch(scene.points.last(6.0), command)
        force = scene.now("force")
        if rows is None or (force is not None and abs(force) > LOADED * scene.guard.force_max_kN):
            self._lasting.sure("slope", False)
            return None
        slope = slope_of(rows, position, command)
        # A slow actuator falls behind as it meets the preload, or stands as it begins and makes up for it
        # then: not all the way through, as a wrong scale is.
        halves = [slope_of(half, position, command) for half in np.array_split(rows, 2)]
        off = min(one - 1.0 if slope > 1.0 else 1.0 - one for one in (*halves, slope))
        if not self._lasting.sure("slope", off > SLOPE_OFF):
            return None
        back = scene.points.last(BACK_S)
        if len(back) and (late_s := explained_late_s(back[:, 0], back[:, command], back[:, position])):
            return late_piston(
                f"the piston's position goes {slope:.3f} times the way that it is told", late_s
            )
        look = likeness(slope)
        text = (
            f"the piston's position goes {slope:.3f} times the way that it is told "
            f"(over {np.ptp(rows[:, command]):.1f} mm)" + (f", {look}" if look else "")
        )
        return _doubt("sign" if slope < -0.3 else "scale", text, slope, 1.0 + SLOPE_OFF)


def _doubt(kind: Kind, text: str, value: float, limit: float) -> SignalDoubt:
    setting = channel_setting("position", "calibration")
    return SignalDoubt(kind, "position", "controller", setting, text, value, limit, "mm")


def _even_stretch(rows: Floats, command: int) -> Floats | None:
    """Return the last part of some rows over which the command has moved evenly, if it is long enough."""
    if len(rows) < 20:
        return None
    lag = 10
    speeds = (rows[lag:, command] - rows[:-lag, command]) / (rows[lag:, 0] - rows[:-lag, 0])
    last = float(speeds[-1])
    if not 0.2 <= abs(last) <= SLOW_MM_PER_S:
        return None
    uneven = np.flatnonzero(np.abs(speeds - last) > max(EVEN * abs(last), 0.12))
    first = int(uneven[-1]) + 1 + lag if len(uneven) else 0
    even = rows[first:]
    if len(even) < 2:
        return None
    if first:
        even = even[even[:, 0] > even[0, 0] + SETTLED_S]
    if len(even) < 10 or abs(float(even[-1, command] - even[0, command])) < TRAVEL_MM:
        return None
    return even
