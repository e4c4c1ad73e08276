"""From the limits of a campaign to the guards that keep them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from bufferstand.daq.clock_guard import LagGuard
from bufferstand.daq.controller_guard import ControllerGuard
from bufferstand.daq.frozen_guard import FrozenGuard
from bufferstand.daq.guards import Action, AgreementGuard, ChannelGuard
from bufferstand.daq.missed_guard import MissedGuard
from bufferstand.daq.panel import FORCE_2_STREAM, GuardSet
from bufferstand.daq.rate_guard import HeatingGuard, SpeedGuard
from bufferstand.daq.silence_guard import SilenceGuard
from bufferstand.daq.temperature_guard import TemperatureGuard
from bufferstand.drivers.interfaces import Stand
from bufferstand.protocols.guard_table import GuardTable
from bufferstand.protocols.limits import Envelope, TestLimits

ACTIONS = {
    "note": Action.NOTE,
    "finish-cycle": Action.STOP_AFTER_CYCLE,
    "stop": Action.STOP,
    "emergency": Action.EMERGENCY,
}
"""What a campaign file calls each action."""
DEFAULT_TILT_MM = 5.0
"""Where neither the campaign nor the stand file states a tilt."""
MEASURED = ("force", "stroke_1", "stroke_2", "position")
"""Channels of the controller that must move when the command does."""
SPEED_FACTOR = 1.25
"""Default trip of the speed guard over the speed limit in force: a motion may overshoot its speed."""


def guards_for(
    limits: TestLimits,
    envelope: Envelope,
    stand: Stand,
    *,
    ambient: Collection[str] = (),
    table: GuardTable | None = None,
    stand_tilt_mm: float | None = None,
) -> GuardSet:
    """Return the guards of a campaign on a stand.

    Parameters
    ----------
    limits : TestLimits
        ``[limits]`` of the campaign: thresholds of temperature and following error.
    envelope : Envelope
        The narrowest limits: trips of force and stroke.
    stand : Stand
        Its sensors are guarded: every temperature stream, and the agreement if there is an amplifier.
    ambient : collection of str
        Streams that do not touch the specimen: their silence is noted, their value stops nothing.
    table : GuardTable, optional
        ``[guards]`` of the campaign.
    stand_tilt_mm : float, optional
        The tilt that the stand file allows; the campaign's own goes before.
    """
    own = table or GuardTable()
    does = {name: ACTIONS[value] for name, value in own.action.model_dump().items()}
    tilt_mm = own.tilt_max_mm or stand_tilt_mm or DEFAULT_TILT_MM
    channels = (
        ChannelGuard(
            "force",
            "force",
            envelope.force_trip_kN,
            -own.force_below_kN,
            "kN",
            "force (transducer of the controller)",
            does["force"],
        ),
        ChannelGuard(
            "stroke",
            "stroke",
            envelope.stroke_trip_mm,
            -own.stroke_below_mm,
            "mm",
            "stroke (mean of the draw wires on the specimen)",
            does["stroke"],
        ),
        ChannelGuard(
            "tilt",
            "tilt",
            tilt_mm,
            -tilt_mm,
            "mm",
            "tilt (stroke_1 − stroke_2)",
            does["tilt"],
            own.tilt_hold_s,
        ),
        ChannelGuard(
            "following error",
            "following_error",
            limits.following_error_max_mm,
            -limits.following_error_max_mm,
            "mm",
            "following error (command − position)",
            does["following_error"],
            limits.following_error_grace_s,
        ),
    )
    facts = {sensor.facts.name: sensor.facts for sensor in stand.sensors}
    thermometers = tuple(
        _thermometer(limits, name, facts[name].channels[0].place, name in ambient, does)
        for name in facts
        if facts[name].channels[0].quantity == "temperature"
    )
    measured = {channel.name for channel in stand.controller.facts.channels}
    watched = stand.controller.facts
    amplified = FORCE_2_STREAM in facts
    return GuardSet(
        channels,
        thermometers,
        ControllerGuard(own.controller_silence_s, own.gap_stop_s, watched.rate_Hz, watched.clock == "device"),
        AgreementGuard(own.agreement_kN, action=does["agreement"]) if amplified else None,
        speeds=(
            SpeedGuard(
                "speed",
                "stroke",
                own.speed_trip_mm_per_s or SPEED_FACTOR * envelope.speed.value,
                "mm/s",
                "stroke (mean of the draw wires on the specimen)",
                does["speed"],
            ),
        ),
        heating=tuple(
            HeatingGuard(one.stream, one.label, own.heating_max_K_per_min, does["heating"])
            for one in thermometers
            if one.stop_C is not None
        ),
        silences=(
            (SilenceGuard(FORCE_2_STREAM, own.amplifier_silence_s, does["amplifier_silence"]),)
            if amplified
            else ()
        ),
        frozen=tuple(FrozenGuard(name, action=does["frozen"]) for name in MEASURED if name in measured),
        lag=LagGuard(own.lag_stop_s),
        missed=MissedGuard(own.missed_cycles_max_per_min),
        disk_stop_s=own.disk_stop_s,
    )


def _thermometer(
    limits: TestLimits, stream: str, place: str, ambient: bool, does: Mapping[str, Action]
) -> TemperatureGuard:
    return TemperatureGuard(
        stream,
        place,
        None if ambient else limits.temperature_stop_C,
        None if ambient else limits.temperature_resume_C,
        limits.temperature_stale_s,
        action=does["temperature"],
        silence_action=does["ambient_silence"] if ambient else Action.STOP,
    )
