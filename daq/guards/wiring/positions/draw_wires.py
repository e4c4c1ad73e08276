"""Compares the draw wires with the piston: they move as far, less the compliance of the machine.

In contact ``position − F / k − wire`` is a constant: 0 from a first contact that was touched off, unknown
without. What is allowed: a machine that gives way by 0.4 to 2 times what is stated, some tenths for seating
and the wires' own linearity, and 20 ms of the speed for delays that nobody states. Before contact the wires
hang on the specimen and stand, or follow the plate; after a compression the specimen comes back late. So
only what is in contact is looked at: the first compression, and later what carries force.

A delay shows where the speed changes: there ``position − F / k − wire`` has a part that goes with the speed.
A wire that stands still as the piston comes to the specimen may only be late, and is waited for a moment.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.positions.force_from_frame import force_instead
from bufferstand.daq.guards.wiring.positions.piston_delay import PATIENCE_MM, PATIENCE_S, BehindJudge
from bufferstand.daq.guards.wiring.positions.wire_delay import (
    LOADED_KN,
    ContactPositions,
    LateWires,
    late_wires,
)
from bufferstand.daq.guards.wiring.recent_state import SLOW_MM_PER_S, RecentState, RepeatedFinding, slope_of
from bufferstand.foundation.numbers import likeness

BEFORE_MM = 1.2
"""A wire reads no more than this before first contact, where strokes count from it; an elastomer that was
compressed hours ago has crept by less."""
CLOSE_MM, UNCOUNTED_MM, SHARE, DELAY_S = 0.8, 0.8, 0.05, 0.02
"""In contact wire and piston agree within these: a constant, as much more where no contact was touched off, a
share of the way (drum, tilt of the plate), and a time of the speed."""
MET_MM, MET_KN = 0.7, 3.0
"""Where no contact was touched off, it is where a wire has moved by this, or a force has risen by this."""
AGAINST_MM = 0.6
"""A wire does not go back by so much as the first contact is passed."""
REST_S = 0.3
"""What the wires read at rest is taken over so long [s]."""
FINE_MM = 6.0
"""A wire that was right over so much of the way has no wrong scale [mm]."""
SLOPE_MM, SLOPE_FROM_MM, SLOPE_OFF = 5.0, 1.0, 0.045
"""Wire against piston over so much of the first compression, from so far behind the contact on: 1, less what
the machine gives way, to within this."""
STILL_SLOPE, COMES_SHARE = 0.15, 0.35
"""A wire that goes less of the piston's way now stands still; one that has gone less of it in all may be
late."""
LOOKS = 2


class WireJudge:
    """Holds each draw wire against the piston."""

    def __init__(self) -> None:
        self._lasting = RepeatedFinding(LOOKS)
        self._contact: ContactPositions | None = None
        self._rest: dict[str, float] | None = None
        self._farthest_mm = 0.0
        self._late = LateWires()
        self._fine_mm: dict[str, float] = {}
        self._behind = BehindJudge()
        self._come: set[str] = set()
        self._met_s: float | None = None

    @property
    def begun(self) -> bool:
        """Whether something has begun to look wrong, and more looks will tell."""
        return self._lasting.begun or self._behind.suspected

    @property
    def rest_mm(self) -> Mapping[str, float]:
        """Return what each channel read at rest as judging began; empty where that is not known."""
        return self._rest or {}

    def look(self, scene: RecentState) -> SignalDoubt | None:
        """Return what is wrong with a wire, None if nothing is."""
        way, wires = scene.way, scene.points.wires
        if way is None or not wires:
            return None
        names = ("command", "position", *wires, "force")
        now = {name: value for name in names if (value := scene.now(name)) is not None}
        contact = self._met(scene, now, way)
        if contact is None:
            return None
        at_mm = now[way] - contact.position_mm
        doubt = self._piston_behind(scene, now, contact, at_mm)
        if doubt or self._behind.suspected:
            return doubt
        return self._with_the_piston(scene, now, contact, at_mm)

    def _with_the_piston(
        self, scene: RecentState, now: Mapping[str, float], contact: ContactPositions, at_mm: float
    ) -> SignalDoubt | None:
        """Return what is wrong with a wire where the position goes with the command."""
        speed, wires = scene.speed_mm_per_s(scene.way or ""), scene.points.wires
        first = at_mm > self._farthest_mm - 0.3 and speed > -0.1
        self._farthest_mm = max(self._farthest_mm, at_mm)
        against: dict[str, float] = {}
        if not scene.counted and at_mm < MET_MM + 3.0 and speed > 0.3:
            against = self._against(scene, now)
        if self._met_s is None and at_mm > 0.3:
            self._met_s = float(scene.points.table[-1, 0])
        if at_mm <= 0.3:
            self._met_s = None
            self._come.clear()
        if at_mm <= 0.3 and not against:
            return self._before(scene, now, at_mm) if scene.counted else None
        if not first and not self._loaded(scene, now):
            self._lasting.sure("apart", False)
            return None
        off = self._off(scene, now, contact, at_mm, speed) | against
        if at_mm > FINE_MM / 2.0:
            self._fine_mm.update({name: at_mm for name in wires if name not in off})
            self._come.update(name for name in wires if name not in off)
        doubt = self._apart(scene, off, now, contact, at_mm)
        if doubt is None and first:
            doubt = self._slope(scene, contact, at_mm, speed)
            doubt = doubt or self._late.at_even_speed(
                scene, now, contact, at_mm, speed, self._given_mm(scene, now, at_mm)[1]
            )
        return doubt or self._late.where_it_changes(scene, contact, at_mm)

    # --- where it is met ----------------------------------------------------------------------------

    def _met(self, scene: RecentState, now: Mapping[str, float], way: str) -> ContactPositions | None:
        if self._contact is not None:
            return self._contact
        wires = scene.points.wires
        if scene.counted:
            self._contact = ContactPositions(0.0, dict.fromkeys(wires, 0.0), 0.0)
            return self._contact
        if self._rest is None:
            rows = scene.points.last(REST_S)
            if scene.points.span_s >= REST_S and len(rows):
                self._rest = {name: float(rows[:, 1 + i].mean()) for i, name in enumerate(scene.points.names)}
            return None
        moved_mm = max(abs(now[name] - self._rest[name]) for name in wires)
        risen_kN = abs(now.get("force", 0.0) - self._rest.get("force", 0.0))
        if moved_mm < MET_MM and risen_kN < MET_KN:
            if scene.speed_mm_per_s(way) == 0.0:  # it stands: what it reads at rest is that of now
                self._rest = None
            return None
        self._contact = ContactPositions(now[way], {name: now[name] for name in wires}, now.get("command"))
        return self._contact

    def _piston_behind(
        self, scene: RecentState, now: Mapping[str, float], contact: ContactPositions, at_mm: float
    ) -> SignalDoubt | None:
        """Return a doubt of the position that is behind the wires, which go with the command."""
        if scene.way != "position" or contact.command_mm is None:
            return None
        met = {"position": contact.position_mm, "command": contact.command_mm, **contact.wires_mm}
        speed = scene.speed_mm_per_s("command")
        return self._behind.look(scene, now, contact=met, close_mm=_close_mm(scene, at_mm, speed))

    def _before(self, scene: RecentState, now: Mapping[str, float], at_mm: float) -> SignalDoubt | None:
        """Return a doubt where a wire does not read its zero before the first compression."""
        if self._farthest_mm > 1.0:
            return None
        beyond = {
            name: now[name]
            for name in scene.points.wires
            if not min(at_mm, 0.0) - BEFORE_MM <= now[name] <= BEFORE_MM
        }
        if not self._lasting.sure("before", bool(beyond)):
            return None
        names = ", ".join(beyond)
        reads = " and ".join(f"{name} {value:+.2f} mm" for name, value in beyond.items())
        text = f"before first contact {reads}, where the zero that was found says 0"
        value = max(beyond.values(), key=abs)
        return _doubt("zero", names, "calibration (hooked in anew since the zero?)", text, value, BEFORE_MM)

    @staticmethod
    def _loaded(scene: RecentState, now: Mapping[str, float]) -> bool:
        forces = [now["force"]] if "force" in now else []
        forces += [scene.force_2_kN] if scene.force_2_kN is not None else []
        return bool(forces) and min(forces) > LOADED_KN

    # --- how far it goes ----------------------------------------------------------------------------

    @staticmethod
    def _given_mm(scene: RecentState, now: Mapping[str, float], at_mm: float) -> tuple[float, float]:
        """Return the least and the most that the machine gives way now [mm]."""
        force_kN = scene.guard.believable_kN(now.get("force", 0.0), at_mm, scene.specimen_C)
        return scene.guard.given_way_mm(force_kN)

    def _off(
        self,
        scene: RecentState,
        now: Mapping[str, float],
        contact: ContactPositions,
        at_mm: float,
        speed: float,
    ) -> dict[str, float]:
        """Return by how much each wire is off that is off by too much; positive: it lags behind [mm]."""
        least_mm, most_mm = self._given_mm(scene, now, at_mm)
        close_mm = _close_mm(scene, at_mm, speed)
        off: dict[str, float] = {}
        for name in scene.points.wires:
            behind_mm = at_mm - (now[name] - contact.wires_mm[name])
            beyond_mm = max(behind_mm - most_mm, 0.0) + min(behind_mm - least_mm, 0.0)
            if abs(beyond_mm) > close_mm:
                off[name] = beyond_mm
        return off

    def _against(self, scene: RecentState, now: Mapping[str, float]) -> dict[str, float]:
        """Return the wires that go back as the piston goes forward: the tilt that this makes is none."""
        rest = self._rest or {}
        gone = {name: now[name] - rest.get(name, now[name]) for name in scene.points.wires}
        return {name: -moved_mm for name, moved_mm in gone.items() if moved_mm < -AGAINST_MM}

    def _apart(
        self,
        scene: RecentState,
        off: Mapping[str, float],
        now: Mapping[str, float],
        contact: ContactPositions,
        at_mm: float,
    ) -> SignalDoubt | None:
        if not self._lasting.sure("apart", bool(off)):
            return None
        wires = scene.points.wires
        if self._may_come(scene, now, contact, off, at_mm):
            return None
        least_mm, close_mm = self._given_mm(scene, now, at_mm)[0], _close_mm(scene, at_mm, 0.0)
        behind = {one: at_mm - (now[one] - contact.wires_mm[one]) for one in wires}
        if force := force_instead(scene, behind, least_mm, close_mm, " mm"):
            return force
        name = max(off, key=lambda one: abs(off[one]))
        went_mm = now[name] - contact.wires_mm[name]
        if scene.exchanged(name, at_mm):
            text = (
                f"force reads {now['force']:.1f} kN where the piston goes {at_mm:.1f} mm, and {name} "
                f"{went_mm:.1f} mm"
            )
            setting = f"{channel_setting('force', 'registers')} and {channel_setting(name, 'registers')}"
            return _doubt(
                "swapped", f"force, {name}", setting, f"{text}: they are exchanged", off[name], CLOSE_MM
            )
        alike = max(off.values()) - min(off.values()) < 0.3 * abs(off[name])
        together = len(off) == len(wires) > 1 and alike
        sensor = ", ".join(wires) if together else name
        expected_mm = at_mm - sum(self._given_mm(scene, now, at_mm)) / 2.0
        who = f"{'both' if len(wires) == 2 else 'all'} draw wires go" if together else f"{name} goes"
        if not scene.counted and at_mm < MET_MM + 3.0 and name in (against := self._against(scene, now)):
            went_mm = -against[name]
            expected_mm = at_mm = max(at_mm, abs(went_mm))
        shown = f"{who} {went_mm:.2f} mm where the piston goes {at_mm:.2f} mm"
        slope = self._lately(scene, contact, name)
        if (late_s := self._late.explains(scene, contact, name)) is not None:
            return late_wires(sensor, late_s)
        kind, fault = _kind(went_mm / expected_mm, slope, right_before=self._fine_mm.get(name, 0.0) > FINE_MM)
        return _scaled_doubt(kind, sensor, f"{shown}{fault}", off[name], CLOSE_MM, together=together)

    def _may_come(
        self,
        scene: RecentState,
        now: Mapping[str, float],
        contact: ContactPositions,
        off: Mapping[str, float],
        at_mm: float,
    ) -> bool:
        """Return whether the wires that are off have not moved yet, or only just, and may only be late."""
        met_s = float(scene.points.table[-1, 0]) if self._met_s is None else self._met_s
        if at_mm > PATIENCE_MM or float(scene.points.table[-1, 0]) - met_s > PATIENCE_S:
            return False
        for name in off:
            slope, went_mm = self._lately(scene, contact, name), now[name] - contact.wires_mm[name]
            if name in self._come or abs(went_mm) > COMES_SHARE * at_mm or slope < -STILL_SLOPE:
                return False
        return True

    def _lately(self, scene: RecentState, contact: ContactPositions, name: str) -> float:
        """Return how far a wire went lately per way of the piston; not a number where that stood."""
        column, way = scene.points.column(name), scene.points.column(scene.way or "")
        rows = scene.points.last(0.2)
        if column is None or way is None or not len(rows):
            return float("nan")
        pressed = rows[rows[:, way] > contact.position_mm + 0.4]
        return (
            slope_of(pressed, column, way)
            if len(pressed) > 5 and np.ptp(pressed[:, way]) > 0.3
            else float("nan")
        )

    def _slope(  # noqa: PLR0911 - one return for each thing that can be wrong, or that keeps from a look
        self, scene: RecentState, contact: ContactPositions, at_mm: float, speed: float
    ) -> SignalDoubt | None:
        """Return a doubt where the first compression shows another scale, whatever the zeros are."""
        way, force = scene.points.column(scene.way or ""), scene.points.column("force")
        rows = scene.points.last(6.0)
        if way is None or not len(rows) or not 1.0 < speed < SLOW_MM_PER_S:
            self._lasting.sure("slope", False)
            return None
        back = np.flatnonzero(np.diff(rows[:, way]) < -0.1)
        rows = rows[int(back[-1]) + 1 if len(back) else 0 :]
        rows = rows[rows[:, way] > contact.position_mm + SLOPE_FROM_MM]
        travel_mm = float(np.ptp(rows[:, way])) if len(rows) else 0.0
        if travel_mm < SLOPE_MM:
            self._lasting.sure("slope", False)
            return None
        stiff = 0.0 if force is None else max(0.0, slope_of(rows, force, way)) * travel_mm
        stiff = scene.guard.believable_kN(stiff, at_mm, scene.specimen_C) / travel_mm
        least, most = scene.guard.given_way_mm(stiff)
        found, behind = {}, {}
        for name in scene.points.wires:
            column = scene.points.column(name)
            slope = 1.0 if column is None else slope_of(rows, column, way)
            behind[name] = 1.0 - slope
            if not 1.0 - most - SLOPE_OFF < slope < 1.0 - least + SLOPE_OFF:
                found[name] = slope / (1.0 - 0.5 * (least + most))
        gone = {name: scene.now(name) or 0.0 for name in found}
        if found and self._may_come(scene, gone, contact, found, at_mm):
            return None
        if not self._lasting.sure("slope", bool(found)):
            return None
        if instead := force_instead(scene, behind, least, SLOPE_OFF, " mm per mm of the way"):
            return instead
        together = len(found) == len(scene.points.wires) > 1
        name = max(found, key=lambda one: abs(found[one] - 1.0))
        ratio, sensor = found[name], ", ".join(found)
        if (late_s := self._late.explains(scene, contact, name)) is not None:
            return late_wires(sensor, late_s)
        look = likeness(ratio)
        text = (
            f"{sensor} {'go' if len(found) > 1 else 'goes'} {ratio:.3f} times the way of the piston over "
            f"{travel_mm:.1f} mm"
        )
        return _scaled_doubt(
            "scale", sensor, text + (f", {look}" if look else ""), ratio, 1.0 + SLOPE_OFF, together=together
        )


def _close_mm(scene: RecentState, at_mm: float, speed: float) -> float:
    """Return within which wire and piston agree [mm]."""
    own_mm = CLOSE_MM + SHARE * abs(at_mm) + DELAY_S * abs(speed)
    return own_mm if scene.counted else own_mm + UNCOUNTED_MM


def _kind(ratio: float, lately: float, *, right_before: bool) -> tuple[Kind, str]:
    """Return what is wrong with a wire that goes ``ratio`` of its way, and ``lately`` this.

    One that was right over some way before has no wrong scale: it has come off, or slipped.
    """
    if abs(ratio) < STILL_SLOPE or abs(lately) < STILL_SLOPE:
        how = ": it stands still, it may have come off or its drum sticks"
        return "still", how if right_before else f"{how}, or it comes much too late"
    if right_before:
        return "slipped", ": it was right before, and has slipped or come off"
    if ratio < -0.3:
        return "sign", ": its sign is turned"
    if abs(lately - 1.0) < 0.12:
        return "zero", ": its zero is off, or it slipped or was hooked in anew"
    known = ratio if np.isnan(lately) else lately
    look = likeness(known)
    return "scale", f", {known:.2f} times as far" + (f", {look}" if look else "")


def _scaled_doubt(
    kind: Kind, sensor: str, text: str, value: float, limit: float, *, together: bool
) -> SignalDoubt:
    """Return a doubt of how far wires go; where all are alike, it may be the piston's own scale."""
    setting = channel_setting(sensor, "calibration and delay_s" if kind == "still" else "calibration")
    if together and kind == "scale":
        text += "; or the piston's own scale is wrong, in position and command alike"
        setting += f", or {channel_setting('position', 'calibration')}"
    return _doubt(kind, sensor, setting, text, value, limit)


def _doubt(
    kind: Kind, sensor: str, setting: str, text: str, value: float, limit: float, unit: str = "mm"
) -> SignalDoubt:
    if not setting.startswith("["):
        setting = channel_setting(sensor, setting)
    return SignalDoubt(kind, sensor, "controller", setting, text, value, limit, unit)
