"""A position that is later than the piston: the draw wires follow its command, and it does not.

Nothing measures before it happens. A wire that is ahead of the position is right therefore, and the position
is late, where the command went there, too; one that is behind the position is late itself.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.recent_state import SLOW_MM_PER_S, Floats, RecentState, RepeatedFinding

BACK_S = 2.5
"""So far back a leader is looked at [s]."""
LATELY_S = 0.15
"""A signal moves if it has gone half of its leader's way in so long [s]."""
PATIENCE_S, PATIENCE_MM = 1.1, 12.0
"""What stands still may only be late: it is waited for so long, or this way of the piston [s, mm]."""
BEHIND_S = 0.15
"""A position is behind its command from this on, where the wires are not: a wire's own delay is less [s]."""
NEARER = 0.5
"""The wires are off the command by less than this share of what the position is."""
LOOKS = 3
MOVED_MM = 0.4
"""What has moved by less is not late, it stands still [mm]."""
LAGS_S = np.arange(0.06, 1.5, 0.02)
ZERO_MM, EXPLAINS = 0.6, 0.6
"""Delays that are tried for a wire, with zeros that are off by this [mm]; one explains what it does if it
leaves this share of what offset and scale leave."""


def since_s(time_s: Floats, leader: Floats, level: float) -> float:
    """Return how long ago a leader was at a level for the last time [s]; infinite where it never was.

    Parameters
    ----------
    time_s, leader : NDArray, shape (n,)
    level : float
    """
    above = leader > level
    crossed = np.flatnonzero(above[1:] != above[:-1])
    if not len(crossed):
        return float("inf")
    at = int(crossed[-1])
    share = (level - float(leader[at])) / float(leader[at + 1] - leader[at])
    return float(time_s[-1] - time_s[at] - share * (time_s[at + 1] - time_s[at]))


def follows(rows: Floats, leader: int, follower: int, late_s: float) -> bool:
    """Return whether a follower goes now as its leader went so long ago.

    Parameters
    ----------
    rows : NDArray, shape (n, channels)
        Time [s] in column 0.
    leader, follower : int
        Columns.
    late_s : float
    """
    if not np.isfinite(late_s) or len(rows) < 10:
        return False
    time = rows[:, 0]
    now_s = float(time[-1])
    own = float(rows[-1, follower]) - float(np.interp(now_s - LATELY_S, time, rows[:, follower]))
    then = np.interp([now_s - late_s - LATELY_S, now_s - late_s], time, rows[:, leader])
    gone = float(then[1] - then[0])
    return abs(gone) > 0.1 and 0.7 < own / gone < 1.4


def explained_late_s(time_s: Floats, leader: Floats, follower: Floats) -> float | None:
    """Return by how much a follower is late, None where an offset or a scale explains it as well [s].

    Parameters
    ----------
    time_s, leader, follower : NDArray, shape (n,)
        Both count from the same zero, to within :data:`ZERO_MM`.
    """
    if len(time_s) < 20 or float(np.ptp(np.quantile(follower, (0.02, 0.98)))) < MOVED_MM:
        return None
    square = float(np.dot(leader, leader))
    scale = float(np.dot(leader, follower)) / square if square > 0.0 else 0.0
    others = min(float(np.std(follower - leader)), float(np.sqrt(np.mean((follower - scale * leader) ** 2))))
    best_mm, best_s = others, 0.0
    for late_s in LAGS_S:
        left = follower - np.interp(time_s - late_s, time_s, leader)
        left = left[time_s > time_s[0] + late_s]
        if len(left) < 20:
            break
        left -= min(max(float(np.mean(left)), -ZERO_MM), ZERO_MM)
        left_mm = float(np.sqrt(np.mean(left**2)))
        if left_mm < best_mm:
            best_mm, best_s = left_mm, float(late_s)
    return best_s if best_mm < EXPLAINS * others and best_s > 0.0 else None


class BehindJudge:
    """Holds the position against command and draw wires together."""

    def __init__(self) -> None:
        self._lasting = RepeatedFinding(LOOKS)
        self._since_s: float | None = None

    @property
    def suspected(self) -> bool:
        """Whether the position was behind at the last look: nothing is compared with it then."""
        return self._since_s is not None

    def look(
        self, scene: RecentState, now: Mapping[str, float], *, contact: Mapping[str, float], close_mm: float
    ) -> SignalDoubt | None:
        """Return a doubt of the position, None if there is none.

        Parameters
        ----------
        scene : Scene
        now, contact : mapping of str to float
            What position, command, wires and force read now, and the first three at first contact.
        close_mm : float
            Within this wires and position agree [mm].
        """
        rows = scene.points.last(BACK_S)
        if not len(rows):
            rows = scene.points.last(0.5)
        so = self._so(scene, rows, now, contact, close_mm)
        now_s = float(scene.points.table[-1, 0])
        if not so:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = now_s
        if not self._lasting.sure("behind", so) or self._since_s is None:
            return None
        command, position = scene.points.column("command"), scene.points.column("position")
        if command is None or position is None:
            return None
        at_mm = now["position"]
        late_s = since_s(rows[:, 0], rows[:, command], at_mm)
        moves = follows(rows, command, position, late_s)
        if not moves and now_s - self._since_s < PATIENCE_S:
            return None
        wires = [now[name] - contact[name] for name in scene.points.wires if name in now]
        seen = (
            f"the piston's position reads {at_mm:.2f} mm where it was told {now['command']:.2f} mm, and the "
            f"draw wires have gone {sum(wires) / len(wires):.2f} mm with the command"
        )
        return late_piston(seen, late_s if moves else None)

    @staticmethod
    def _so(
        scene: RecentState,
        rows: Floats,
        now: Mapping[str, float],
        contact: Mapping[str, float],
        close_mm: float,
    ) -> bool:
        wires = [name for name in scene.points.wires if name in now and name in contact]
        column = scene.points.column("command")
        if "position" not in contact or "command" not in contact or not wires or column is None:
            return False
        at_mm, told_mm = (now[name] - contact[name] for name in ("position", "command"))
        speed = float(np.ptp(rows[-20:, column])) / 0.19 if len(rows) >= 20 else 0.0
        apart_mm = told_mm - at_mm
        if speed > SLOW_MM_PER_S or abs(apart_mm) < max(close_mm, BEHIND_S * speed):
            return False
        way = 1.0 if apart_mm > 0.0 else -1.0
        force_kN = scene.guard.believable_kN(now.get("force", 0.0), max(at_mm, told_mm), scene.specimen_C)
        least_mm, most_mm = scene.guard.given_way_mm(force_kN)
        for name in wires:
            gone = now[name] - contact[name]
            ahead_mm = min(way * (gone + give - at_mm) for give in (least_mm, most_mm))
            left_mm = [way * (told_mm - gone - give) for give in (least_mm, most_mm)]
            nearer = any(abs(one) < NEARER * abs(apart_mm) for one in left_mm)
            if ahead_mm < close_mm or not nearer or gone < 0.5:
                return False
        return True


def late_piston(seen: str, late_s: float | None) -> SignalDoubt:
    """Return the doubt of a position that is late.

    Parameters
    ----------
    seen : str
        What was seen.
    late_s : float or None
        By so much [s]; None where it has not moved at all yet.
    """
    key, how = "delay_s", f"it comes {late_s or 0.0:.2f} s late"
    if late_s is None:
        key, how = "calibration and delay_s", "it stands still, or comes much too late"
    setting = channel_setting("position", key)
    kind: Kind = "still" if late_s is None else "delay"
    return SignalDoubt(kind, "position", "controller", setting, f"{seen}: {how}", late_s, BEHIND_S, "s")
