"""Draw wires that are late: behind the piston by speed times delay.

At a change of speed ``position − F / k − wire`` has a part that goes with the speed; at an even speed in the
first compression it is a constant; and what a wire has shown of its last seconds is what the piston did
before. Nothing measures before it happens: where all wires are ahead of the position, that is the late one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bufferstand.daq.guards.wiring.doubt import SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.positions.piston_delay import BACK_S, explained_late_s, late_piston
from bufferstand.daq.guards.wiring.recent_state import SLOW_MM_PER_S, RecentState, RepeatedFinding, slope_of

LATE_S, LATE_MM = 0.045, 0.4
"""A wire is late from this on [s], where that makes so much of the way [mm]."""
STEADY_LATE_S, STEADY_LATE_MM, STEADY_GIVE = 0.06, 0.42, 1.4
"""At constant speed in the first compression, with what the machine gives way by times the stated."""
GROWN = 0.5
"""A delay is there from the start: what was less than this share of it grows with the force or the way."""
LEAST_SPEED = 4.0
"""Speeds must differ by this for a delay to show [mm/s]."""
DELAY_WINDOW_S, DELAY_EVERY_S = 4.0, 0.5
LOADED_KN = 5.0
"""In contact, after the first compression [kN]."""
LOOKS = 2


@dataclass
class ContactPositions:
    """Where the first contact was: the piston, and each wire there [mm]."""

    position_mm: float
    wires_mm: Mapping[str, float]
    command_mm: float | None = None


class LateWires:
    """Looks for draw wires that are late."""

    def __init__(self) -> None:
        self._lasting = RepeatedFinding(LOOKS)
        self._due_s = -np.inf
        self._least_s: dict[str, float] = {}

    def at_even_speed(
        self,
        scene: RecentState,
        now: Mapping[str, float],
        contact: ContactPositions,
        at_mm: float,
        speed: float,
        most_mm: float,
    ) -> SignalDoubt | None:
        """Return a doubt where a wire stays behind by what a delay makes at constant speed.

        ``most_mm`` is the most that the machine gives way now.
        """
        rows, way = scene.points.last(0.3), scene.points.column(scene.way or "")
        if not scene.counted or way is None or len(rows) < 10 or at_mm < 1.5 or speed < LEAST_SPEED:
            self._lasting.sure("steady", False)
            return None
        early, late = rows[: len(rows) // 2], rows[len(rows) // 2 :]
        speeds = [float(np.ptp(part[:, way]) / np.ptp(part[:, 0])) for part in (early, late)]
        even = abs(speeds[0] - speeds[1]) < 0.1 * speed and speed < SLOW_MM_PER_S
        most_mm *= STEADY_GIVE / 2.0 if scene.guard.frame_kN_per_mm is not None else 1.0
        late_s: dict[str, float] = {}
        for name in scene.points.wires:
            behind_mm = at_mm - (now[name] - contact.wires_mm[name]) - most_mm - 0.01 * at_mm
            column = scene.points.column(name)
            goes = even and column is not None and 0.93 < slope_of(rows, column, way) < 1.05
            if not goes:
                continue
            least_s = self._least_s[name] = min(self._least_s.get(name, np.inf), behind_mm / speed)
            grown = least_s < GROWN * behind_mm / speed  # as what gives way under a force does, and no delay
            if behind_mm > STEADY_LATE_MM and behind_mm / speed > STEADY_LATE_S and not grown:
                late_s[name] = behind_mm / speed
        if not self._lasting.sure("steady", bool(late_s)):
            return None
        return late_wires(", ".join(late_s), max(late_s.values()))

    def where_it_changes(
        self, scene: RecentState, contact: ContactPositions, at_mm: float
    ) -> SignalDoubt | None:
        """Return a doubt where a wire is behind the piston by a part that goes with the speed."""
        now_s = float(scene.points.table[-1, 0])
        if now_s < self._due_s or at_mm < 1.0:
            return None
        self._due_s = now_s + DELAY_EVERY_S
        rows, column = scene.points.last(DELAY_WINDOW_S), scene.points.column(scene.way or "")
        force = scene.points.column("force")
        if column is None or len(rows) < 50:
            return None
        time = rows[:, 0]
        speed = np.gradient(rows[:, column], time)
        carries = rows[:, column] > contact.position_mm + 0.5
        if force is not None:
            carries &= rows[:, force] > LOADED_KN
        if np.count_nonzero(carries) < 50 or np.ptp(speed[carries]) < LEAST_SPEED:
            return None
        loads = [rows[carries, force]] if force is not None else []
        system = np.stack([np.ones(np.count_nonzero(carries)), speed[carries], *loads], axis=1)
        late: dict[str, float] = {}
        for name in scene.points.wires:
            own = scene.points.column(name)
            if own is None:
                continue
            behind = rows[carries, column] - rows[carries, own]
            found = np.linalg.lstsq(system, behind, rcond=None)[0]
            late_s = float(found[1])
            so = abs(late_s) > LATE_S and 0.5 * abs(late_s) * float(np.ptp(speed[carries])) > LATE_MM
            if self._lasting.sure(f"late {name}", so):
                late[name] = late_s
        if not late:
            return None
        late_s = max(late.values(), key=abs)
        stated_s = max(scene.guard.delays_s.get(name, 0.0) for name in late)
        ahead = late_s < 0.0 and scene.way == "position" and len(late) == len(scene.points.wires)
        if ahead and stated_s < 0.5 * abs(late_s):  # nothing measures before it happens
            return late_piston(f"{' and '.join(late)} go {-late_s * 1e3:.0f} ms before the position", -late_s)
        return late_wires(", ".join(late), late_s)

    @staticmethod
    def explains(scene: RecentState, contact: ContactPositions, name: str) -> float | None:
        """Return by how much a wire is late, where nothing else explains its last seconds [s]."""
        rows, column = scene.points.last(BACK_S), scene.points.column(name)
        way, force = scene.points.column(scene.way or ""), scene.points.column("force")
        if way is None or column is None or not len(rows):
            return None
        given = 0.0 if force is None else 0.5 * sum(scene.guard.given_way_mm(1.0)) * rows[:, force]
        leader = np.maximum(rows[:, way] - contact.position_mm, 0.0) - np.maximum(given, 0.0)
        return explained_late_s(rows[:, 0], leader, rows[:, column] - contact.wires_mm[name])


def late_wires(sensor: str, late_s: float) -> SignalDoubt:
    """Return the doubt of wires that are late, early where that is negative [s]."""
    how = "behind" if late_s > 0.0 else "ahead of"
    text = f"{sensor} is {abs(late_s) * 1e3:.0f} ms {how} the piston"
    return SignalDoubt(
        "delay", sensor, "controller", channel_setting(sensor, "delay_s"), text, late_s, LATE_S, "s"
    )
