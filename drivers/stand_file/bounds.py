"""Bounds of a stand file that depend on several of its keys: tilt, scales of channels, thermometers.

A channel whose scale is wrong switches its guards off: a force that reads a thousandth never trips. What
the file alone tells is told here; whether the scale is *true* only a motion shows.
"""

from __future__ import annotations

import numpy as np

from bufferstand.drivers.instruments import SensorEntry, SensorType
from bufferstand.drivers.register_maps import WHOLE_RANGES, Profile
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.numbers import TRIP_SHARE, tilt_bound_mm
from bufferstand.foundation.settings import place_of

POWER_ON_C = 85.0
"""What a DS18B20 that has lost its supply shows [°C]; up to there it is exact to 0.5 K."""
THERMOMETER_C = (0.0, 20.0, 40.0, 85.0)
"""Where its calibration is looked at [°C]."""
COARSEST_SHARE = 0.01
"""Of the stand's force or stroke: a count that is worth more cannot show a limit of 5 % above another."""
OVERLOAD_FACTOR = 3.0
"""So many times the stand's greatest force no load cell bears."""
_LOOKED_AT = 257
_ROUNDED = 1e-4
"""A full scale of exactly the trip lacks a count, and what its certificate rounds."""
_ANY = (-(2.0**31), 2.0**31)


def demand_stand_bounds(stand_file: StandFile, profile: Profile, text: str) -> None:
    """Refuse a stand file whose tilt, or whose scales, switch a guard off.

    Parameters
    ----------
    stand_file : StandFile
        Checked key by key.
    profile : Profile
        Which registers hold the counts.
    text : str
        Of the file, for the lines.

    Raises
    ------
    BadInput
        With key, value, bound and reason.
    """
    tilt_mm, travel_mm = stand_file.stand.tilt_max_mm, stand_file.limits.stroke_max_mm
    if tilt_mm is not None and not 0.1 <= tilt_mm <= tilt_bound_mm(travel_mm):
        raise BadInput(
            f"tilt_max_mm = {tilt_mm!r} is outside 0.1 to {tilt_bound_mm(travel_mm):g} mm (5 mm, or 5 % of "
            f"stroke_max_mm = {travel_mm:g} mm)",
            file=stand_file.path,
            place=place_of(("stand", "tilt_max_mm"), text),
            remedy="write a tilt within that: a straight specimen never brings the wires so far apart",
        )
    for path, problem in _scale_troubles(stand_file, profile):
        raise BadInput(
            problem,
            file=stand_file.path,
            place=place_of(path, text),
            remedy="look at the certificate: a channel with this scale would guard nothing",
        )


def power_on_C(stand_file: StandFile) -> float:  # noqa: N802 - the unit keeps its capital
    """Return what a thermometer on the specimen shows when it has lost its supply, the least of all [°C]."""
    shown = [
        float(sensor.calibration.apply(power_on))
        for device in stand_file.thermometers
        if (power_on := device.kind.sensor_type.power_on) is not None
        for sensor in device.sensors
        if sensor.role == "specimen"
    ]
    return min([POWER_ON_C, *shown])


def _scale_troubles(stand_file: StandFile, profile: Profile) -> list[tuple[tuple[str | int, ...], str]]:
    """Return each channel that cannot show what it must, with its place in the file."""
    limits = stand_file.limits
    travel_mm = limits.stroke_max_mm
    whole = {"force": limits.force_max_kN, **dict.fromkeys(("stroke", "position", "command"), travel_mm)}
    found: list[tuple[tuple[str | int, ...], str]] = []
    for number, channel in enumerate(stand_file.controller.channel):
        name = f"raw_{channel.name}"
        kind = None if profile.window is None else dict(profile.window.sample).get(channel.name)
        if kind is None and profile.has(name):
            kind = profile.find(name).type
        most = whole.get(channel.quantity)
        if most is None:  # no limit and no guard looks at it
            continue
        if problem := _scale_trouble(channel, None if kind is None else WHOLE_RANGES.get(kind), most):
            found.append((("controller", "channel", number, "calibration"), problem))
        if channel.quantity == "force" and (problem := _overload_trouble(channel, most)):
            found.append((("controller", "channel", number, "plausible", "overload"), problem))
    for one in stand_file.instruments:
        ends = one.kind.ends(one.settings, one.folder)
        reach = whole.get(one.channel.quantity)
        if reach is not None and (problem := _scale_trouble(one.channel, ends, reach)):
            found.append(((*one.place, "channel", "calibration"), problem))
        if one.channel.quantity == "force" and (problem := _overload_trouble(one.channel, whole["force"])):
            found.append(((*one.place, "channel", "plausible", "overload"), problem))
    for device in stand_file.thermometers:
        for number, sensor in enumerate(device.sensors):
            if problem := _thermometer_trouble(device.kind.sensor_type, sensor):
                found.append(((*device.place, "sensor", number, "calibration"), problem))
    return found


def _scale_trouble(channel: Channel, counts: tuple[float, float] | None, most: float) -> str:
    """Return why a channel cannot show its trip, or not finely enough; empty if it can.

    ``counts`` is what its register or amplifier can hold; None of a float or a text, where that is anything.
    """
    at = np.linspace(*(counts or _ANY), _LOOKED_AT)
    with np.errstate(all="ignore"):
        shown = channel.calibration.apply(at)
        steps = np.abs(channel.calibration.apply(at[:-1] + 1.0) - shown[:-1])
    trip, unit = (1.0 + TRIP_SHARE) * most, channel.unit
    greatest = float(np.max(shown, initial=-np.inf, where=np.isfinite(shown)))
    if greatest < trip * (1.0 - _ROUNDED):
        return (
            f"channel “{channel.name}” shows at most {greatest:.4g} {unit} by this calibration, and its "
            f"guard may trip at {trip:g} {unit} (5 % above the stand's {most:g} {unit})"
        )
    count = float(np.max(steps, initial=0.0, where=np.abs(shown[:-1]) <= trip))
    if counts is not None and not 0.0 < count <= COARSEST_SHARE * most:
        return (
            f"one count of channel “{channel.name}” is {count:.4g} {unit} by this calibration; more than 1 % "
            f"of the stand's {most:g} {unit}, or nothing, shows no limit"
        )
    return ""


def _overload_trouble(channel: Channel, most: float) -> str:
    overload = None if channel.plausible is None else channel.plausible.overload
    if overload is None or overload <= OVERLOAD_FACTOR * most:
        return ""
    return (
        f"overload = {overload:g} {channel.unit} of channel “{channel.name}” is above its bound of "
        f"{OVERLOAD_FACTOR * most:g} {channel.unit} ({OVERLOAD_FACTOR:g} × force_max_kN = {most:g} kN)"
    )


def _thermometer_trouble(sensor_type: SensorType, sensor: SensorEntry) -> str:
    """Return where a thermometer's calibration is no correction of its type; empty if it is one."""
    most_K = sensor_type.corrected_K
    for true_C in THERMOMETER_C:
        with np.errstate(all="ignore"):
            shown_C = float(sensor.calibration.apply(sensor_type.nominal.counts_of(true_C)))
        if not abs(shown_C - true_C) <= most_K:
            return (
                f"{sensor.name} would show {shown_C:.4g} °C of {true_C:g} °C by this calibration: "
                f"{sensor_type.uncorrected}, and is corrected by {most_K:g} K at most"
            )
    return ""
