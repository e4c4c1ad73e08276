"""The opening of a session: everything is put together and looked at, and nothing has moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from bufferstand.daq.acquisition import Acquisition, rides_of
from bufferstand.daq.campaign.connected_stand import ConnectedStand
from bufferstand.daq.campaign.display import CampaignDisplay
from bufferstand.daq.campaign.loop_passes import LoopPasses
from bufferstand.daq.campaign.recheck import StandRecheck
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign.start_temperature import begins_with_a_wait
from bufferstand.daq.campaign_folder import CampaignMetadata, another, how_reached, mixing
from bufferstand.daq.guards import ACTIONS, Action, GuardPanel, GuardSet, Trip, guards_for
from bufferstand.daq.guards.kinds import DEFAULT_TILT_MM, TemperatureGuard
from bufferstand.daq.guards.wiring import doubt_trip
from bufferstand.daq.motions import Halt, MotionRunner, SafeStop, SafeStopSettings, SampleObserver
from bufferstand.daq.operator import StopLevel, StopRequest, Watcher
from bufferstand.daq.stand import (
    apart_trouble,
    await_free,
    delivery_remark,
    delivery_trouble,
    disk_trouble,
    expired_calibrations,
    first_look,
    forces_doubt,
    look_at_use,
    specimen_gaps,
    stroke_trouble,
    use_trouble,
    wires_doubt,
    zero_trouble,
)
from bufferstand.daq.zero import Zeroing, ZeroLimits, keep_zero, zero_to_take
from bufferstand.drivers import Stand
from bufferstand.foundation import Clock
from bufferstand.foundation.channels import Zero
from bufferstand.protocols.campaign_file import GuardTable
from bufferstand.protocols.planning import Plan, limits_of
from bufferstand.protocols.prediction import Predictor
from bufferstand.protocols.steps import PlannedStep

CALL_TIMEOUTS, CALL_MORE_S = 6.0, 1.0
"""No call to the controller takes longer than so many ``timeout_s`` and so much more [s]."""


def trip_at(clock: Clock, guard: str, reason: str, *, device_fault: bool = True) -> Trip:
    """Return a trip of now that comes from no sample."""
    return Trip(guard, Action.STOP, reason, clock.now_s(), device_fault=device_fault)


def guards_of(plan: Plan, step: PlannedStep, base: GuardSet, *, waiting: bool) -> GuardSet:
    """Return the guards with a step's own temperature limits; ``waiting`` for the specimen to cool or not."""
    limits = limits_of(step, plan.campaign.limits)
    stop_C, resume_C = limits.temperature_stop_C, limits.temperature_resume_C
    guards = base.changed(TemperatureGuard, lambda one: one.stopping_at(stop_C, resume_C))
    return guards.cooling() if waiting else guards


def expired_today(stand: Stand) -> list[str]:
    """Return what is to be said about calibrations that have expired by today."""
    return expired_calibrations(stand, date.today())  # noqa: DTZ011 - the lab's day


@dataclass(frozen=True)
class Opening:
    """What a session is put together from.

    Parameters
    ----------
    plan : Plan
        Its limits, and its speed of release.
    stand, clock
        The stand and its time.
    facts : CampaignFacts
        Of specimen, operator and watchdog.
    settings : RunSettings
        Pace, patience, whether the stand waits for its reader.
    table : GuardTable
        ``[guards]`` in force.
    request : StopRequest
        The operator's wish.
    notes : Path
        The campaign's folder.
    showing : Showing
    passes : Passes
        Serves what is put together.
    watcher : Watcher or None
        Who sees every block.
    predictor : Predictor or None
        What the plan expects of the specimen, against which its signals are held.
    """

    plan: Plan
    stand: Stand
    clock: Clock
    facts: CampaignMetadata
    settings: RunSettings
    table: GuardTable
    request: StopRequest
    notes: Path
    showing: CampaignDisplay
    passes: LoopPasses
    watcher: Watcher | None
    predictor: Predictor | None = None

    def assemble(self, steps: Sequence[PlannedStep]) -> ConnectedStand:
        """Connect, and put together what works on the stand; guards judge the first of ``steps``.

        Raises
        ------
        Halt
            If the stand is in use, or is not the one on which the campaign was begun: nothing was written to
            the controller then but the number of a request.
        DeviceFault
            If a device does not answer.
        """
        identity = self.stand.controller.connect()
        reached = how_reached(
            self.stand, started_here=self.facts.started_here, waits=self.settings.says_it_waits
        )
        if why := mixing(reached, self.facts.began_simulated) or another(
            identity, self.facts.began_controller, self.facts.accepted_serial, simulated=reached.simulated
        ):
            raise Halt(trip_at(self.clock, "controller", why))
        self.demand_free(wait=self.settings.awaits_stand)
        self.stand.controller.skip_backlog()  # guards judge the present, not what led to an earlier stop
        for sensor in self.stand.sensors:
            sensor.start()
        base = guards_for(
            self.plan.campaign.limits,
            self.plan.limits,
            self.stand,
            ambient=self.facts.ambient(),
            table=self.table,
            stand_tilt_mm=self._stand_table().get("tilt_max_mm"),
            plan=self.plan,
            predictor=self.predictor,
            speed=self.settings.speed,
        )
        guards = guards_of(self.plan, steps[0], base, waiting=begins_with_a_wait(steps[0])) if steps else base
        panel = GuardPanel(guards.first_look(), wall_s=self.clock.wall_s())
        acquisition = Acquisition(
            self.stand, self.clock, panel, pace=self.settings.pace, waited_for=self.settings.waited_for
        )
        if self.watcher is not None:
            acquisition.observers.append(self.watcher.take)
        anew = StandRecheck(acquisition, identity, self.free_trouble)
        acquisition.continuity.awake.take_anew = anew.look
        acquisition.continuity.awake.longest_call_s = CALL_TIMEOUTS * self._timeout_s + CALL_MORE_S
        rides = rides_of(acquisition, self.facts.watchdog_s, self.table, anew.look)
        acquisition.continuity.rides = rides
        acquisition.feeding = False  # the actuator may be another's: a feed would hide that one's death
        release_mm_per_s = self.plan.campaign.content.motion.release_speed_mm_per_s
        driver = MotionRunner(
            acquisition,
            self.request,
            self.passes.tick,
            self.settings.patience,
            release_speed_mm_per_s=release_mm_per_s,
        )
        self.passes.serve(acquisition, driver)
        safe_stop = SafeStop(
            self.stand.controller,
            self.clock,
            SafeStopSettings(release_mm_per_s, self.facts.watchdog_s),
            pump=self.passes.tick,
            eyes=SampleObserver(acquisition, self.plan.stand_limits.force_max_kN),
            emergency=lambda: panel.action is Action.EMERGENCY,
        )
        zeroing = self._zeroing(acquisition, driver)
        anew.doubt_zero = zeroing.doubt
        anew.leave = safe_stop.leave
        return ConnectedStand(
            identity, reached, base, guards, panel, acquisition, driver, safe_stop, zeroing, rides
        )

    def demand_free(self, *, wait: bool = False) -> None:
        """Demand that nobody else has the stand, and nothing moves; nothing is written to the controller.

        Parameters
        ----------
        wait : bool
            Wait for what a killed program has left to come to rest.

        Raises
        ------
        Halt
            If the stand is in use, or the operator wants to wait no longer.
        DeviceFault
            If the wire fails.
        """
        controller, most_kN = self.stand.controller, self.table.zero_force_max_kN
        if not wait:
            why = use_trouble(controller, self.clock, most_kN)
        else:
            why = await_free(
                controller,
                self.clock,
                most_kN,
                interrupted=lambda: self.request.level > StopLevel.NONE,
                say=self.showing.message,
                show=self.showing.waiting,
            )
            if not why and self.request.level > StopLevel.NONE:
                left = look_at_use(controller, most_kN)
                seen = "" if left is None else f"; the stand was last seen so: {left.shown}, {left.what}"
                why = f"stopped by the operator: {self.request.reason}{seen}"
                raise Halt(trip_at(self.clock, "operator", why, device_fault=False))
        if why:
            raise Halt(trip_at(self.clock, "controller", why))

    def free_trouble(self) -> str:
        """Wait for what a killed program has left; return why the stand is not to be had, empty if it is.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        try:
            self.demand_free(wait=True)
        except Halt as halt:
            return halt.trip.reason
        return ""

    @property
    def _timeout_s(self) -> float:
        """The longest wait for one reply, by the stand file [s]."""
        return float((self.facts.stand.get("controller") or {}).get("timeout_s") or 0.0)

    def look(self, alive: ConnectedStand, steps: Sequence[PlannedStep]) -> None:
        """Look at everything that can be looked at while nothing moves; say it, or refuse.

        A zero is taken over, if one is to be.

        Raises
        ------
        Halt
            If the disk is too small, the wire too slow, a guard has tripped, or a channel at rest is off.
        """
        for text in self.plan.not_guarded:
            self.showing.message(f"NOT GUARDED: {text}")
        for text in (*expired_today(self.stand), specimen_gaps(self.plan.specimen)):
            if text:
                self.showing.message(f"WARNING: {text}")
        if why := disk_trouble(self.notes, steps):
            raise Halt(trip_at(self.clock, "disk", why))
        if alive.acquisition.stand.controller.facts.clock == "host":
            self._judge_wire(alive)  # known since connecting; of a wire too slow no sample may ever come
        if text := self._outage_text(alive):
            self.showing.message(text)
        rest = first_look(alive.acquisition, alive.driver.pump)
        self._judge_wire(alive)
        if remark := delivery_remark(alive.acquisition):
            self.showing.message(f"WARNING: the controller: {remark}")
        self.demand_free()  # what another program moves meanwhile is not at rest
        self._judge_rest(alive.zeroing, rest)

    def _outage_text(self, alive: ConnectedStand) -> str:
        """Return how long an outage is ridden out; empty for a stand that waits for its reader."""
        timeout_s = (self.facts.stand.get("controller") or {}).get("timeout_s")
        if timeout_s is None or self.settings.waited_for:
            return ""
        return alive.rides.leeway.sentence(timeout_s)

    def _judge_wire(self, alive: ConnectedStand) -> None:
        """Refuse a wire that cannot carry the samples, unless the stand waits for its reader."""
        waits = self.settings.waited_for or self.settings.says_it_waits
        if not waits and (why := delivery_trouble(alive.acquisition, alive.driver.pump)):
            raise Halt(trip_at(self.clock, "lag", why))

    def keep(self, zero: Zero) -> None:
        """Keep a zero in the campaign's folder."""
        try:
            keep_zero(self.notes, zero)
        except OSError as error:
            self.showing.message(f"{self.notes}: the zero could not be kept: {error.strerror}")

    def _judge_rest(self, zeroing: Zeroing, rest: Mapping[str, float]) -> None:
        """Take a zero over, if one is to be; refuse to begin where the channels at rest are far off it."""
        table = self.plan.campaign.content.zero
        zero, why = zero_to_take(table, self.notes, self.facts.stored_zero, self.plan.specimen.id)
        if why:
            raise Halt(trip_at(self.clock, "zero", why, device_fault=False))
        if zero is not None:
            zeroing.use(zero)
            self.keep(zero)
            self.showing.message(f"zero taken over from {zero.found:%Y-%m-%d %H:%M} UTC: {zero.sentence()}")
        touched = table.touch and zero is None
        if why := stroke_trouble(rest, zero, table, touched=touched):
            doubt = wires_doubt(rest, zero, table)
            action = ACTIONS[self.table.action.wiring]
            if doubt is not None and action is not Action.NOTE:
                raise Halt(doubt_trip(doubt, action, self.clock.now_s()))
            raise Halt(trip_at(self.clock, "zero", why, device_fault=False))
        if touched and (why := apart_trouble(rest, self._apart_mm())):
            raise Halt(trip_at(self.clock, "zero", why, device_fault=False))
        self._judge_force(rest, zero, touched=touched)

    def _judge_force(self, rest: Mapping[str, float], zero: Zero | None, *, touched: bool) -> None:
        """Refuse to begin under a force, or where one of two shows one that the other one does not."""
        most_kN, action = self.table.zero_force_max_kN, ACTIONS[self.table.action.wiring]
        force_kN = rest.get("force", 0.0) - (0.0 if zero is None else zero.value("force"))
        why, refused = zero_trouble(force_kN, most_kN, tared=touched)
        doubt = forces_doubt(rest, zero, most_kN)
        trip = None if doubt is None else doubt_trip(doubt, action, self.clock.now_s())
        if refused and trip is not None and action is not Action.NOTE:
            raise Halt(trip)
        if refused:
            raise Halt(trip_at(self.clock, "zero", why, device_fault=False))
        for text in (why, "" if trip is None else trip.reason):
            if text:
                self.showing.message(f"WARNING: {text}")

    def _zeroing(self, acquisition: Acquisition, driver: MotionRunner) -> Zeroing:
        content = self.plan.campaign.content
        return Zeroing(
            acquisition,
            driver,
            content.zero,
            ZeroLimits(
                self.table.zero_force_max_kN,
                self._apart_mm(),
                content.motion.release_speed_mm_per_s,
            ),
            say=self.showing.message,
            catch_up=self.passes.catch_up,
            specimen=self.plan.specimen.id,
            operator=self.facts.operator or content.campaign.operator,
        )

    def _apart_mm(self) -> float:
        """Return by how much the two draw wires may differ at first contact [mm]."""
        tilt_mm = self.table.tilt_max_mm or self._stand_table().get("tilt_max_mm") or DEFAULT_TILT_MM
        return self.plan.campaign.content.zero.wires_apart_max_mm or tilt_mm

    def _stand_table(self) -> Mapping[str, float]:
        return self.facts.stand.get("stand") or {}
