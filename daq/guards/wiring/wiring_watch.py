"""All wiring checks and their memory: a part of the guard panel."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from bufferstand.daq.guards.trips import Trip
from bufferstand.daq.guards.wiring.clock_offset import ClockOffset
from bufferstand.daq.guards.wiring.doubt import SignalDoubt, doubt_trip
from bufferstand.daq.guards.wiring.exchanged_inputs import with_the_position
from bufferstand.daq.guards.wiring.forces import ForceJudge, TwoForcesJudge
from bufferstand.daq.guards.wiring.positions import PistonJudge, WireJudge, leapt
from bufferstand.daq.guards.wiring.recent_state import RecentState
from bufferstand.daq.guards.wiring.sample_points import KEPT_S, SamplePoints
from bufferstand.daq.guards.wiring.sample_stretch import SampleStretch
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.daq.guards.wiring.temperatures import HeatJudge
from bufferstand.daq.guards.wiring.trip_reason import LOOKED_BACK_S, Limited, tripped_by, until_limit
from bufferstand.daq.scaling import ScaledBlock

LEAST_POINTS = 10
"""Why a limit was passed is looked for in so many points before it at least."""
LEAST_SPAN_S = 0.6
"""Force and wires are compared with the piston once that was compared with its command for so long [s]."""


class WiringWatch:
    """Hands what comes in to the judges; each doubt is said once.

    What they have seen of motion is forgotten with every zero (:meth:`rebase`) and while nothing is to be
    judged (``motion`` of :class:`bufferstand.daq.guards.wiring.settings.WiringGuard`); what thermometers
    showed is kept."""

    def __init__(self) -> None:
        self._counted = False
        self._heat = HeatJudge()
        self._said: set[tuple[str, str]] = set()
        self._doubted_s: dict[str, float] = {}
        self._points: SamplePoints | None = None
        self._clock = ClockOffset()
        self._judging = False
        self._begin()

    def _begin(self) -> None:
        self._piston, self._wires = PistonJudge(), WireJudge()
        self._force, self._forces = ForceJudge(), TwoForcesJudge(self._clock)

    def rebase(self, *, counted: bool) -> None:
        """Begin anew: strokes and forces count from another zero, found at first contact or not."""
        self._counted = counted
        self._heat.rebase()
        self._points = None
        self._begin()

    def begin_anew(self) -> None:
        """Forget what was seen, of thermometers, too; the zero stays, and what was said."""
        self._heat, self._points, self._clock = HeatJudge(), None, ClockOffset()
        self._begin()

    def observe(
        self,
        guard: WiringGuard,
        block: ScaledBlock,
        temperatures_C: Mapping[str, float],
        *,
        controller: bool,
        device_clock: bool,
    ) -> list[Trip]:
        """Judge a block of any stream.

        Parameters
        ----------
        guard : WiringGuard
        block : ScaledBlock
        temperatures_C : mapping of str to float
            Last true reading of every thermometer.
        controller : bool
            Whether it is a block of the controller.
        device_clock : bool
            Whether the controller stamps its samples by its own clock.

        Returns
        -------
        list of Trip
            What is doubted now and was not before.
        """
        doubts: Iterable[SignalDoubt | None]
        if block.stream in guard.specimen or block.stream in guard.ambient:
            doubts = [self._heat.take(guard, block, temperatures_C.get(block.stream))]
        elif not controller:
            self._forces.take_second(block, guard.delays_s.get("force_2", 0.0))
            return []
        else:
            motion = self._motion(guard, block, temperatures_C, device_clock=device_clock)
            doubts = self._causes(motion, block.received_s)
        time_us = int(block.time_us[-1]) if len(block) else None
        return self._said_once(guard, doubts, block.received_s, time_us)

    def look_once_more(
        self, guard: WiringGuard, temperatures_C: Mapping[str, float], at_s: float
    ) -> list[Trip]:
        """Judge what has come since the last look: a motion has ended, and the next look may be too late.

        Parameters
        ----------
        guard, temperatures_C
            As of :meth:`observe`.
        at_s : float
            Host stand time [s].
        """
        if guard.motion == "none" or self._points is None or not self._points.take_rest():
            return []
        doubts = self._causes(self._judge(guard, self._points, temperatures_C), at_s)
        return self._said_once(guard, doubts, at_s)

    @property
    def begun(self) -> bool:
        """Whether a judge has begun to doubt, and needs more looks to be sure."""
        judges = (self._piston, self._force, self._forces, self._wires)
        return self._judging and any(judge.begun for judge in judges)

    def _said_once(
        self,
        guard: WiringGuard,
        doubts: Iterable[SignalDoubt | None],
        at_s: float,
        time_us: int | None = None,
    ) -> list[Trip]:
        """Return the trips of doubts of one look that were not said yet."""
        trips = []
        for doubt in doubts:
            if doubt is not None and (doubt.sensor, doubt.kind) not in self._said:
                self._said.add((doubt.sensor, doubt.kind))
                trips.append(doubt_trip(doubt, guard.action, at_s, time_us))
        return trips

    def _causes(self, doubts: Iterable[SignalDoubt | None], at_s: float) -> list[SignalDoubt]:
        """Return the doubts of one look without those that another one explains.

        Exchanged inputs make each of both look wrong; and while the judges' memory holds what was wrong of a
        sensor, whatever else they doubt in which it has a part comes of that.
        """
        causes = []
        found = [doubt for doubt in doubts if doubt is not None]
        for doubt in sorted(found, key=lambda one: one.kind != "swapped"):
            sensors = doubt.sensor.split(", ")
            explained = any(at_s - self._doubted_s.get(one, -np.inf) < KEPT_S for one in sensors)
            if not explained:
                causes.append(doubt)
            self._doubted_s.update(dict.fromkeys(sensors, at_s))
        return causes

    def explained(
        self,
        guard: WiringGuard,
        trip: Trip,
        specimen_C: float | None = None,
        limited: Limited | None = None,
    ) -> Trip:
        """Return the trip of a limit, or where the wiring has led to it, a doubt with it.

        Parameters
        ----------
        guard : WiringGuard
        trip : Trip
            Of a guard that believes its signal.
        specimen_C : float, optional
            Of the warmest thermometer on the specimen [°C].
        limited : str, optional
            What the controller's own limit was of, where that has tripped: it has no value of a sample.
        """
        if self._points is None or guard.motion == "none":
            return trip
        newest = self._points.newest(KEPT_S)
        if len(newest) < LEAST_POINTS:
            return trip
        values = {name: newest[:, column] for column, name in enumerate(self._points.names, start=1)}
        stretch = SampleStretch(newest[:, 0], values, *self._forces.second(LOOKED_BACK_S))
        zeros_mm = {} if self._counted else self._wires.rest_mm
        asked = trip
        if limited is not None:
            stretch = until_limit(stretch, limited)
            greatest_kN = float(stretch.values["force"][-1]) if "force" in values else None
            asked = replace(trip, guard=limited, value=greatest_kN, limit=None)
        doubt = tripped_by(guard, asked, stretch, zeros_mm, specimen_C)
        if doubt is None:
            return trip
        self._doubted_s.update(dict.fromkeys(doubt.sensor.split(", "), trip.at_s))
        own = doubt_trip(doubt, guard.action, trip.at_s, trip.time_us)
        reason = f"{own.reason}; {trip.reason}"
        return replace(own, action=max(own.action, trip.action), reason=reason)

    def _motion(
        self,
        guard: WiringGuard,
        block: ScaledBlock,
        temperatures_C: Mapping[str, float],
        *,
        device_clock: bool,
    ) -> Iterable[SignalDoubt | None]:
        if self._points is None:
            self._points = SamplePoints(guard.delays_s)
        if guard.motion == "none" and self._judging:
            self._begin()  # the judges, not the points: at the next motion these show what was at rest
        self._judging = guard.motion != "none"
        if self._judging:
            yield self._force.pulls(block)
        self._forces.take_first(block, guard.delays_s.get("force", 0.0), device_clock=device_clock)
        if not self._points.take(block):
            return
        self._heat.work(self._points)
        if self._judging:
            yield from self._judge(guard, self._points, temperatures_C)

    def _judge(
        self, guard: WiringGuard, points: SamplePoints, temperatures_C: Mapping[str, float]
    ) -> Iterable[SignalDoubt | None]:
        own = [temperatures_C[name] for name in guard.specimen if name in temperatures_C]
        scene = RecentState(points, guard, self._counted, max(own, default=None), self._forces.latest_kN)
        if guard.motion == "all":
            yield self._forces.look(scene)
        yield self._told(self._piston.look(scene))
        if self._piston.suspected:
            return
        # The piston's own judge needs so long, and is looked at first.
        if guard.motion == "all" and points.span_s >= LEAST_SPAN_S:
            yield self._force.look(scene)
            yield self._told(self._wires.look(scene))

    def _told(self, doubt: SignalDoubt | None) -> SignalDoubt | None:
        """Return a doubt of a way, or what it comes from: an exchange, or a position that leapt."""
        points = self._points
        if doubt is None or points is None or doubt.kind == "swapped":
            return doubt
        told, own, force = (points.column(name) for name in ("command", "position", "force"))
        more = ""
        if doubt.sensor == "position" and told is not None and own is not None and force is not None:
            exchanged, more = with_the_position(points.last(LOOKED_BACK_S), told, own, force)
            if exchanged is not None:
                return exchanged
        return leapt(points) or replace(doubt, text=doubt.text + more)
