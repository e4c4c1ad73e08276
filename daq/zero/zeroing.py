"""Stroke 0 of a campaign: touched off before the first stroke, taken over, or as the channels read at rest.

Touching off is done by the controller itself: one slow static cycle that turns at a small force, so that no
delay of the wire adds to the force. Up to
:data:`bufferstand.protocols.campaign_file.zero_table.TOUCH_FORCE_MAX_KN` a buffer is not compressed (its
preload is several times as much), and its first compression is still to come. Where the contact was is found
afterwards from the samples (:mod:`bufferstand.daq.zero.first_contact`), not from what was commanded."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.acquisition import Acquisition, CollectedSamples
from bufferstand.daq.guards import Action, GuardSet, Phase, Trip
from bufferstand.daq.guards.kinds import ChannelGuard
from bufferstand.daq.motions import Halt, MotionRunner
from bufferstand.daq.scaling import FORCES
from bufferstand.daq.zero.first_contact import NoContactError, TouchContact, TouchSamples, find_contact
from bufferstand.daq.zero.limits import ZeroLimits, wires_apart, zero_refusal
from bufferstand.daq.zero.touch_force import SLOW_SHARE
from bufferstand.daq.zero.touch_wiring_check import TouchWiringCheck
from bufferstand.drivers import EndReason
from bufferstand.foundation import Harmonic, RampTo, Release, StaticCycles, duration_text
from bufferstand.foundation.channels import STROKE_CHANNELS, Channel, ChannelZero, Touch, Zero
from bufferstand.protocols.campaign_file import TOUCH_FORCE_MAX_KN, ZeroTable
from bufferstand.protocols.steps import ForceCycles, Motion, RampToForce, TouchOff

FloatArray = NDArray[np.float64]
Forces = Mapping[str, FloatArray]
"""Samples of ``force``, and of ``force_2`` where there is one, shape (n,) each [kN]."""

REST_S = 1.0
"""So long the force is looked at, at rest, before the piston creeps [s]."""
FORCE_OVER_NOISE = 8.0
"""The touch force, where none is given, in standard deviations of the force's noise …"""
LEAST_OVER_NOISE = 6.0
"""… and the least that one that is given may be."""
TOUCH_FORCE_MIN_KN = 0.5
"""The touch force is no less than this where none is given: friction of guides is some tenths [kN]."""
TRIP_OVER_KN = 6.0
"""The force guard trips so far over the touch force while the piston creeps [kN]."""
AT_ZERO_MM = 0.1
"""The piston stands at its zero within this."""
SAID_FROM_MM = 1.0
"""A way back to the piston's zero that is longer than this is said [mm]."""
LEANS_KN = 0.2
"""A piston that reads so much more force at its own zero than retracted touches the specimen there [kN]."""
CLEAR_MM = 1.0
"""So far the piston goes back before it creeps to a contact that lies before its own zero [mm]."""
LATE_S = 1.5
"""A force that has not risen by the end of a touch is waited for so long [s]: it may be late."""
APART_NOTE_SHARE = 0.2
"""From this share of the refusal on, a difference of the draw wires is said."""


class Zeroing:
    """Finds and keeps the zero of a campaign on an open stand.

    Parameters
    ----------
    acquisition : Acquisition
    driver : Driver
    table : ZeroTable
        ``[zero]`` of the campaign.
    limits : ZeroLimits
    say : callable
        Shows a line that must not be missed.
    catch_up : callable
        Makes passes until every sample that was taken is read.
    specimen, operator : str
        For the record.
    """

    def __init__(
        self,
        acquisition: Acquisition,
        driver: MotionRunner,
        table: ZeroTable,
        limits: ZeroLimits,
        *,
        say: Callable[[str], object],
        catch_up: Callable[[], object],
        specimen: str = "",
        operator: str = "",
    ) -> None:
        self._acquisition = acquisition
        self._driver = driver
        self._table = table
        self._limits = limits
        self._say = say
        self._catch_up = catch_up
        self._specimen = specimen
        self._operator = operator
        self._doubts = TouchWiringCheck(acquisition, say)
        self.ended: Callable[[Trip], object] = lambda _: None
        """Called where a force has ended a touch: it unloads, and lets samples come for a moment."""
        self.arrived: Callable[[], object] = lambda: None
        """Called once the piston has come to its own zero, from wherever it stood: narrower limits of the
        device may be set then."""

    @property
    def zero(self) -> Zero | None:
        """Return the zero in force."""
        return self._acquisition.zero

    @property
    def to_come(self) -> bool:
        """Return whether first contact is still to be touched off: the piston is brought to its zero then."""
        return self._table.touch and self.zero is None

    def due(self, motions: Sequence[Motion]) -> bool:
        """Return whether a touch must come before motions: one compresses, and none has been made."""
        if not self.to_come:
            return False
        for motion in motions:
            if isinstance(motion, TouchOff):
                return False
            if isinstance(motion, RampTo | RampToForce | Harmonic | StaticCycles | ForceCycles):
                return True
        return False

    def doubt(self, why: str) -> None:
        """Touch off anew before anything is compressed; a zero that no touch has found stays, and it is said.

        Parameters
        ----------
        why : str
            Why the zero may be none any more.
        """
        if self.zero is None:
            return
        if self._table.touch:
            self.use(None)
            self._say(f"{why}: first contact is touched off anew before the next stroke")
        else:
            self._say(f"WARNING: {why}: the zero of {self.zero.found:%Y-%m-%d %H:%M} UTC is counted from on")

    def use(self, zero: Zero | None) -> None:
        """Count strokes, forces and commands from a zero; from none with None."""
        self._acquisition.take_zero(zero)
        self._driver.commanding.zero_mm = 0.0 if zero is None else zero.value("position")

    def touch(self, motion: TouchOff | None = None) -> Zero:
        """Touch off, and count from there.

        Parameters
        ----------
        motion : TouchOff, optional
            Force and speed where they differ from ``[zero]``.

        Raises
        ------
        Halt
            If there is no contact within the travel, a channel is off beyond its limit, or a guard or the
            operator stops it.
        DeviceFault
            If a motion cannot be started.
        """
        asked = motion or TouchOff()
        speed = asked.speed_mm_per_s or self._table.speed_mm_per_s
        self.use(None)
        clear = self._go_to_piston_zero(asked.force_kN)
        self.arrived()
        samples, force_kN = CollectedSamples(), self._table.touch_force_kN or TOUCH_FORCE_MIN_KN
        self._acquisition.observers.append(samples.take)
        try:
            own_rest_kN = self._look_at_rest()
            rest = samples.column("force")
            at_rest = {name: samples.column(name) for name in FORCES if samples.column(name).size}
            force_kN = self._touch_force_kN(rest, asked.force_kN, at_rest.get("force_2"))
            if clear:
                self._creep(at_rest, own_rest_kN, force_kN, speed)
            else:
                speed *= SLOW_SHARE
                self._creep_from_behind(at_rest, force_kN, speed)
            self._catch_up()
            if self._doubts.is_to_come(samples, force_kN):
                self._stand(LATE_S)
        except Halt as halt:
            if self._doubts.is_by_force(halt):
                self.ended(halt.trip)
            raise self._doubts.explained(halt, samples, force_kN) from None
        finally:
            self._acquisition.observers.remove(samples.take)
        own_clock = self._acquisition.stand.controller.facts.clock == "device"
        taken = _touch_samples(samples, self._channels(), own_clock=own_clock)
        try:
            contact = self._driver.meanwhile(lambda: find_contact(taken))
        except NoContactError as none:
            self._doubts.judge(samples, force_kN)
            raise self._refusal(f"first contact was not found: {none}; touch off again") from None
        self._doubts.judge(samples, force_kN)
        zero = self._zero_of(contact, at_rest, speed, force_kN)
        self._judge(zero)
        self.use(zero)
        text = f"zero found by touch: {zero.sentence()}"
        self._say(f"  {text}")
        if why := before_own_zero(zero):
            self._say(f"WARNING: {why}")
        return zero

    # --- motions -----------------------------------------------------------------------------------

    def _go_to_piston_zero(self, asked_kN: float | None) -> bool:
        """Bring the piston to its own zero, from where the controller's static cycles begin.

        It may stand anywhere: far out, as a jog has left it, or retracted. Its way and speed are said.

        Returns
        -------
        bool
            Whether it came there without touching; else it stands :data:`CLEAR_MM` before the contact.
        """
        self._go_back()
        position_mm = self._acquisition.latest.values.get("position", 0.0)
        if position_mm >= -AT_ZERO_MM:
            return True
        free_kN, at_rest = self._rest_force()
        rest = at_rest.get("force", np.zeros(0))
        force_kN = self._touch_force_kN(rest, asked_kN, at_rest.get("force_2"))
        speed = self._table.speed_mm_per_s
        way_s = abs(position_mm) / speed
        self._say(
            f"  the piston stands at {position_mm:.2f} mm: forward to its own zero at {speed:g} mm/s "
            f"({duration_text(way_s)}), until it touches"
        )
        self._until_force(at_rest, force_kN, speed, way_s)
        self._catch_up()
        touched_mm = self._acquisition.latest.values.get("position", 0.0)
        if touched_mm >= -AT_ZERO_MM and self._look_at_rest() - free_kN <= LEANS_KN:
            return True  # and it does not lean on a specimen whose contact is just there
        if -touched_mm > self._table.travel_max_mm:
            raise self._refusal(
                f"the specimen is touched at {touched_mm:.2f} mm already, further before the piston's own "
                f"zero than {self._limits.names.travel} = {self._table.travel_max_mm:g}: give the specimen "
                "more room, or set the controller's zero"
            )
        self._driver.perform(Release(self._limits.release_speed_mm_per_s), 10.0)
        self._driver.perform(RampTo(touched_mm - CLEAR_MM, speed), 2.0 * CLEAR_MM / speed)
        return False

    def _go_back(self) -> None:
        """Unload, and bring a piston that stands far out to its own zero, whatever a release does with it."""
        position_mm = self._acquisition.latest.values.get("position", 0.0)
        speed = self._limits.release_speed_mm_per_s
        way_s = max(0.0, position_mm) / speed
        if position_mm > SAID_FROM_MM:
            self._say(
                f"  the piston stands at {position_mm:.2f} mm: back to its own zero at {speed:g} mm/s "
                f"({duration_text(way_s)})"
            )
        self._driver.perform(Release(speed), 10.0 + way_s)
        self._catch_up()
        left_mm = self._acquisition.latest.values.get("position", 0.0)
        if left_mm > AT_ZERO_MM:  # without a force there is nothing to release: it may have stayed
            self._driver.perform(RampTo(0.0, speed), left_mm / speed)

    def _until_force(self, at_rest: Forces, force_kN: float, speed: float, way_s: float) -> None:
        """Ramp towards the piston's own zero until a force over that at rest is read; guarded narrowly."""
        panel = self._acquisition.panel
        guards = panel.guards
        panel.change(self._narrow(at_rest, force_kN))
        turn_kN = float(np.mean(at_rest["force"])) + force_kN
        try:
            self._driver.perform(RampToForce(turn_kN, 0.0, speed), way_s)
        finally:
            panel.change(guards)

    def _creep_from_behind(self, at_rest: Forces, force_kN: float, speed: float) -> None:
        """Creep to a contact that lies before the piston's own zero, and back off."""
        self._until_force(at_rest, force_kN, speed, 2.0 * CLEAR_MM / speed)
        self._driver.perform(Release(self._limits.release_speed_mm_per_s), 10.0)
        self._catch_up()

    def _narrow(self, at_rest: Forces, force_kN: float) -> GuardSet:
        """Return the guards with the force's so far over that of the touch only, the second one's too."""
        guards = self._acquisition.panel.guards.during(Phase.TOUCH)
        trips = {name: float(np.mean(values)) + force_kN + TRIP_OVER_KN for name, values in at_rest.items()}
        most_kN = trips["force"]

        def narrow(guard: ChannelGuard) -> ChannelGuard:
            upper = most_kN if guard.upper is None else min(guard.upper, most_kN)
            return replace(guard, upper=upper) if guard.signal == "force" else guard

        guards = guards.changed(ChannelGuard, narrow)
        if "force_2" not in trips:
            return guards
        label = "force_2 (the second way to the force)"  # whatever the controller's own force reads
        second = ChannelGuard("force_2", "force_2", trips["force_2"], None, "kN", label, Action.EMERGENCY)
        return GuardSet(guards, second)

    def _stand(self, span_s: float) -> None:
        """Stand still for a while."""
        began_s = self._acquisition.latest.device_s or 0.0
        while (self._acquisition.latest.device_s or 0.0) - began_s < span_s:
            self._driver.pump()

    def _look_at_rest(self) -> float:
        """Stand still for a while; return the mean of the force as the controller itself has it [kN]."""
        acquisition, seen = self._acquisition, []
        began_s = acquisition.latest.device_s or 0.0
        while (acquisition.latest.device_s or 0.0) - began_s < REST_S:
            self._driver.pump()
            if (status := acquisition.latest.status) is not None:
                seen.append(status.force_kN)
        return sum(seen) / len(seen) if seen else 0.0

    def _rest_force(self) -> tuple[float, Forces]:
        """Stand still for a while; return the controller's own mean [kN], and the samples of the forces."""
        samples = CollectedSamples()
        self._acquisition.observers.append(samples.take)
        try:
            own_kN = self._look_at_rest()
        finally:
            self._acquisition.observers.remove(samples.take)
        found = {name: samples.column(name) for name in FORCES}
        return own_kN, {name: values for name, values in found.items() if values.size}

    def _touch_force_kN(  # noqa: N802 - the unit keeps its capital
        self, rest: FloatArray, asked_kN: float | None, second: FloatArray | None
    ) -> float:
        noise_kN = float(np.std(rest)) if rest.size else math.inf
        given = asked_kN or self._table.touch_force_kN
        if given is None:
            given = min(TOUCH_FORCE_MAX_KN, max(TOUCH_FORCE_MIN_KN, FORCE_OVER_NOISE * noise_kN))
        if given < LEAST_OVER_NOISE * noise_kN:
            self._doubts.scatters(rest, np.zeros(0) if second is None else second, given)
            more = f", or raise {self._limits.names.touch_force} (at most {TOUCH_FORCE_MAX_KN:g} kN)"
            raise self._refusal(
                f"the force at rest scatters by {noise_kN:.2f} kN (standard deviation): a touch at "
                f"{given:g} kN would not be told from it; mend its cable or filter, or its "
                "calibration ([[controller.channel]] "
                "name = “force”) if that is too large" + (more if given < TOUCH_FORCE_MAX_KN else "")
            )
        return float(given)

    def _creep(self, at_rest: Forces, own_rest_kN: float, force_kN: float, speed: float) -> None:
        """Let the controller creep to the force and back; guarded more narrowly than a test."""
        travel_mm = self._table.travel_max_mm
        turn_kN = own_rest_kN + force_kN
        if not 0.0 < turn_kN < math.inf:
            raise self._refusal(
                f"the controller's own force reads {own_rest_kN:+.2f} kN at rest, too little for a touch of "
                f"{force_kN:g} kN: set the controller's zero of force"
            )
        panel = self._acquisition.panel
        guards = panel.guards
        panel.change(self._narrow(at_rest, force_kN))
        try:
            self._driver.perform(StaticCycles(speed, turn_kN, travel_mm, 1, 0.0), 2.0 * travel_mm / speed)
        finally:
            panel.change(guards)
        status = self._acquisition.latest.status
        if status is None or status.end_reason is not EndReason.FORCE_LIMIT:
            raise self._refusal(
                f"no contact within {travel_mm:g} mm of the piston's zero (force rose by less than "
                f"{force_kN:.2g} kN): bring the specimen nearer to the plate, set the controller's zero, or "
                f"raise {self._limits.names.travel}"
            )

    # --- what was found ----------------------------------------------------------------------------

    def _channels(self) -> dict[str, Channel]:
        stand = self._acquisition.stand
        facts = (stand.controller.facts, *(sensor.facts for sensor in stand.sensors))
        return {channel.name: channel for one in facts for channel in one.channels}

    def _zero_of(self, contact: TouchContact, at_rest: Forces, speed: float, force_kN: float) -> Zero:
        channels = self._channels()
        found: list[ChannelZero] = []
        # In the mean of n wires what they have in common stays whole, what each has of its own goes by √n.
        shared = math.sqrt(max(1, len(contact.wires)))
        for name, reading in contact.wires.items():
            u = math.hypot(reading.u_own, shared * reading.u_place, stated_u(channels[name]))
            found.append(ChannelZero(name=name, unit="mm", value=reading.value, u=u))
        place = contact.position
        for name in ("position", "command"):
            if name in channels:
                u = math.hypot(place.u, stated_u(channels[name]))
                found.append(ChannelZero(name=name, unit="mm", value=place.value, u=u))
        found += [rest_zero(channels[name], values) for name, values in at_rest.items() if name in channels]
        touch = Touch(
            speed_mm_per_s=speed,
            touch_force_kN=force_kN,
            peak_force_kN=contact.peak_kN,
            position_mm=place.value,
            u_position_mm=place.u_place,
            stiffness_kN_per_mm=contact.stiffness_kN_per_mm,
            rest_force_kN=contact.rest_kN,
            noise_kN=contact.noise_kN,
        )
        return Zero(
            how="touch",
            found=datetime.now(UTC),
            specimen=self._specimen,
            operator=self._operator,
            channel=tuple(found),
            touch=touch,
        )

    def _judge(self, zero: Zero) -> None:
        """Refuse a zero that is too far off to be one; say a difference of the wires.

        Raises
        ------
        Halt
            If a channel is beyond its limit.
        """
        if why := zero_refusal(zero, self._table, self._limits):
            raise self._refusal(why)
        if text := wires_apart(zero, APART_NOTE_SHARE * self._limits.apart_mm):
            self._say(f"WARNING: {text}; taken for their mounting, not for tilt")

    def _refusal(self, reason: str) -> Halt:
        return Halt(Trip("zero", Action.STOP, reason, self._acquisition.clock.now_s(), device_fault=False))


def before_own_zero(zero: Zero) -> str:
    """Return what a first contact before the piston's own zero means, empty where it does not lie there.

    Parameters
    ----------
    zero : Zero
        With the piston's position of first contact.
    """
    found = zero.of("position")
    if found is None or found.value >= -AT_ZERO_MM:
        return ""
    return (
        f"first contact is at {found.value:+.2f} ± {2.0 * found.u:.2f} mm of the piston, before its own "
        "zero, where the controller's static cycles begin and end and below which no sine goes: ramps, "
        "holds and force-cycles can be run; for the others give the specimen so much more room, or set the "
        "controller's zero back by as much"
    )


def stated_u(channel: Channel) -> float:
    """Return the standard uncertainty of a channel's zero by the limit that it states, 0 without one."""
    return (channel.uncertainty.zero or 0.0) / math.sqrt(3.0)


def rest_zero(channel: Channel, values: NDArray[np.float64]) -> ChannelZero:
    """Return the zero of a channel from its values at rest, shape (n,)."""
    u_mean = float(np.std(values)) / math.sqrt(max(1, values.size))
    return ChannelZero(
        name=channel.name,
        unit=channel.unit,
        value=float(np.mean(values)),
        u=math.hypot(u_mean, seen_step(channel, values) / math.sqrt(12.0), stated_u(channel)),
    )


def step_of(channel: Channel) -> float:
    """Return what one count of a channel is worth near its zero, in its unit."""
    try:
        at = channel.calibration.counts_of(0.0)
    except ValueError:  # no inverse: a polynomial of higher degree; its slope at no counts does
        at = np.zeros(1)
    low, high = channel.calibration.apply(np.array([float(at), float(at) + 1.0]))
    return abs(float(high - low))


def seen_step(channel: Channel, values: FloatArray) -> float:
    """Return the step of a channel's values, in its unit: of one that delivers no whole counts, as they show.

    Parameters
    ----------
    channel : Channel
    values : NDArray, shape (n,)
        Some of its values.
    """
    stated, apart = step_of(channel), np.diff(np.unique(values))
    least = float(apart.min()) if apart.size else stated
    return least if least < 0.5 * stated else stated


def _touch_samples(
    samples: CollectedSamples, channels: dict[str, Channel], *, own_clock: bool
) -> TouchSamples:
    names = [name for name in ("force", "position", *STROKE_CHANNELS) if name in channels]
    wires = {
        name: samples.at_controller(name, device_clock=own_clock)
        for name in STROKE_CHANNELS
        if name in channels
    }
    return TouchSamples(
        samples.time_s(),
        samples.column("force"),
        samples.column("position"),
        wires,
        {name: channels[name].delay_s for name in names},
        {name: seen_step(channels[name], samples.column(name)) for name in names},
    )
