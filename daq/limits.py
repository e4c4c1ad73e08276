"""From the limits of a campaign to the guards that keep them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from daq.controller_guard import ControllerGuard
from daq.guards import Action, AgreementGuard, ChannelGuard
from daq.panel import FORCE_2_STREAM, GuardSet
from daq.temperature_guard import TemperatureGuard
from drivers.interfaces import Stand
from protocols.limits import Envelope, TestLimits


@dataclass(frozen=True)
class GuardSettings:
    """What no campaign file states: how the guards judge the stand itself.

    Parameters
    ----------
    force_below_kN : float
        A buffer cannot pull: more tension than this [kN] is a wrong sign or a stuck specimen.
    stroke_below_mm : float
        So far behind first contact the draw wires may read [mm].
    tilt_mm : float
        Largest difference of the two draw wires [mm].
    hold_s : float
        A tilt must last this long [s]: one bad sample of a draw wire is none.
    silence_s : float
        The controller may be silent this long [s of the wall].
    gap_stop_s : float
        A longer gap in the samples [s] stops: the guards were blind.
    agreement_kN : float
        Tolerance between the force and its second way [kN].
    """

    force_below_kN: float = 10.0
    stroke_below_mm: float = 20.0
    tilt_mm: float = 5.0
    hold_s: float = 0.05
    silence_s: float = 2.0
    gap_stop_s: float = 0.5
    agreement_kN: float = 6.0


def guards_for(
    limits: TestLimits,
    envelope: Envelope,
    stand: Stand,
    *,
    ambient: Collection[str] = (),
    settings: GuardSettings | None = None,
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
    settings : GuardSettings, optional
        What no campaign file states.
    """
    own = settings or GuardSettings()
    channels = (
        ChannelGuard(
            "force",
            "force",
            envelope.force_trip_kN,
            -own.force_below_kN,
            "kN",
            "force (transducer of the controller)",
            Action.EMERGENCY,
        ),
        ChannelGuard(
            "stroke",
            "stroke",
            envelope.stroke_trip_mm,
            -own.stroke_below_mm,
            "mm",
            "stroke (mean of the draw wires on the specimen)",
            Action.EMERGENCY,
        ),
        ChannelGuard(
            "tilt",
            "tilt",
            own.tilt_mm,
            -own.tilt_mm,
            "mm",
            "tilt (stroke_1 − stroke_2)",
            Action.EMERGENCY,
            own.hold_s,
        ),
        ChannelGuard(
            "following error",
            "following_error",
            limits.following_error_max_mm,
            -limits.following_error_max_mm,
            "mm",
            "following error (command − position)",
            Action.STOP,
            limits.following_error_grace_s,
        ),
    )
    facts = {sensor.facts.name: sensor.facts for sensor in stand.sensors}
    return GuardSet(
        channels,
        tuple(
            _thermometer(limits, name, facts[name].channels[0].place, name in ambient)
            for name in facts
            if facts[name].channels[0].quantity == "temperature"
        ),
        ControllerGuard(own.silence_s, own.gap_stop_s, stand.controller.facts.rate_Hz),
        AgreementGuard(own.agreement_kN) if FORCE_2_STREAM in facts else None,
    )


def _thermometer(limits: TestLimits, stream: str, place: str, ambient: bool) -> TemperatureGuard:
    return TemperatureGuard(
        stream,
        place,
        None if ambient else limits.temperature_stop_C,
        None if ambient else limits.temperature_resume_C,
        limits.temperature_stale_s,
        silence_action=Action.NOTE if ambient else Action.STOP,
    )
