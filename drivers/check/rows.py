"""Findings of a stand check: one row each, and how values, calibrations and pairs of channels are judged."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, timedelta

from bufferstand.drivers.check.verdict import Verdict
from bufferstand.drivers.stand_file import RecordingStand, StandFile, acquisition_stream
from bufferstand.foundation.channels import Channel

CALIBRATION_SOON = timedelta(days=30)
"""A calibration that ends within this time gets a note."""
STROKE_DIFFERENCE_MM = 2.0
"""Largest believable difference of two draw wires [mm]; more is tilt, or a slack or snagged wire."""
FORCE_DIFFERENCE_SHARE = 0.02
"""Largest believable difference of two amplifiers on one transducer, as a share of the force limit."""
STROKE_SLACK_MM = 60.0
"""How far a piston may be drawn back from first contact [mm]."""
TEMPERATURE_RANGE_C = (-25.0, 85.0)
"""What a specimen or the air of a test hall can have [°C]."""


@dataclass(frozen=True)
class CheckRow:
    """One line of the check.

    Parameters
    ----------
    device : str
        ``controller``, ``amplifier``, ``temperature_1`` … or ``stand``.
    item : str
        What was looked at: ``identity``, ``round trip``, a channel, ``calibration force`` …
    value : str
        What was found, with unit.
    verdict : Verdict
        Whether that is as it should be.
    remark : str
        What is wrong and where to look.
    age_s : float or None
        Age of a reading [s of stand time].
    figures : mapping
        The same as numbers, for programs; names carry their units.
    """

    device: str
    item: str
    value: str
    verdict: Verdict = Verdict.OK
    remark: str = ""
    age_s: float | None = None
    figures: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ShownLimits:
    """What a stand can show at most: force [kN] and stroke [mm]; None where nothing is stated."""

    force_kN: float | None
    stroke_mm: float | None


def shown_limits(stand_file: StandFile) -> ShownLimits:
    """Return them of a stand with a controller."""
    return ShownLimits(stand_file.limits.force_max_kN, stand_file.limits.stroke_max_mm)


def value_row(
    device: str, channel: Channel, value: float, limits: ShownLimits, *, age_s: float, stale_after_s: float
) -> CheckRow:
    """Return a channel's value, judged by what the stand can show and by its age.

    Parameters
    ----------
    device : str
        Stream that it came from.
    channel : Channel
        What was measured.
    value : float
        In the channel's unit.
    limits : ShownLimits
        Of the stand.
    age_s, stale_after_s : float
        Age of the reading, and the age from which it counts as stale [s].
    """
    most_kN = math.inf if limits.force_kN is None else limits.force_kN
    travel_mm = (-STROKE_SLACK_MM, math.inf if limits.stroke_mm is None else limits.stroke_mm)
    low, high = {
        "force": (-0.1 * most_kN, most_kN),
        "temperature": TEMPERATURE_RANGE_C,
        **dict.fromkeys(("stroke", "position", "command"), travel_mm),
    }.get(channel.quantity, (-math.inf, math.inf))  # of any other no range is known
    text = f"{value:.2f} {channel.unit}" + (f" ({channel.place})" if channel.place else "")
    verdict, remark = Verdict.OK, ""
    if not low <= value <= high:
        verdict = Verdict.FAULT
        remark = f"outside {low:g} … {high:g} {channel.unit}; look at transducer, cable and coefficients"
    elif age_s > stale_after_s:
        verdict, remark = Verdict.FAULT, f"stale: {age_s:.1f} s old; look at the device and its wire"
    unit = channel.unit.removeprefix("°").replace("/", "_per_").replace("²", "2")
    figures = {f"value_{unit}": value, "age_s": age_s}
    return CheckRow(device, channel.name, text, verdict, remark, age_s, figures)


def rate_row(
    device: str, item: str, measured_Hz: float, stated_Hz: float, lost: int, *, tolerance: float
) -> CheckRow:
    """Return how many values a second come, against how many should.

    Parameters
    ----------
    device, item : str
        As the finding names them.
    measured_Hz, stated_Hz : float
        By the computer's clock, and as device or stand file say.
    lost : int
        Values known to be lost meanwhile.
    tolerance : float
        Share by which they may differ.
    """
    text = f"{measured_Hz:.4g} Hz of {stated_Hz:.4g}" + (f", {lost} lost" if lost else "")
    figures = {"rate_Hz": measured_Hz, "lost": float(lost)}
    if abs(measured_Hz - stated_Hz) > tolerance * stated_Hz:
        remark = "not the stated rate; look at its data rate, and whether line or computer are overloaded"
        return CheckRow(device, item, text, Verdict.FAULT, remark, figures=figures)
    if lost:
        remark = "values were lost; look at the round trip, and whether a second program reads this device"
        return CheckRow(device, item, text, Verdict.FAULT, remark, figures=figures)
    return CheckRow(device, item, text, figures=figures)


def difference_row(one: str, two: str, difference_mm: float, most_mm: float | None = None) -> CheckRow:
    """Return how far two draw wires are apart, judged by the stand's own limit if it states one [mm]."""
    apart_mm = abs(difference_mm)
    if apart_mm <= (STROKE_DIFFERENCE_MM if most_mm is None else most_mm):
        return CheckRow("controller", f"{one} − {two}", f"{apart_mm:.2f} mm")
    remark = "the draw wires disagree; look for tilt, a slack or a snagged wire"
    return CheckRow("controller", f"{one} − {two}", f"{apart_mm:.2f} mm", Verdict.FAULT, remark)


def force_rows(forces: Mapping[str, float], stand_file: StandFile) -> Iterator[CheckRow]:
    """Yield how far each further way to the force is from the controller's, where both answered."""
    for device, channel in channels_of(stand_file):
        second = channel.name
        if channel.quantity != "force" or second == "force" or {"force", second} - set(forces):
            continue
        apart_kN = abs(forces["force"] - forces[second])
        far = apart_kN > FORCE_DIFFERENCE_SHARE * stand_file.limits.force_max_kN
        remark = "the two amplifiers disagree; look at zero, range and calibration of both" if far else ""
        verdict = Verdict.FAULT if far else Verdict.OK
        yield CheckRow(device, f"force − {second}", f"{apart_kN:.2f} kN", verdict, remark)


def thermometer_rows(stand_file: StandFile | RecordingStand) -> Iterator[CheckRow]:
    """Yield what is remarkable about the thermometers besides their readings."""
    for device in stand_file.thermometers:
        for note in device.kind.notes(device.settings, device.folder):
            yield CheckRow(note.device, note.item, note.value, Verdict.NOTE, note.remark)


def calibration_rows(channels: Iterable[tuple[str, Channel]], today: date) -> Iterator[CheckRow]:
    """Yield whether each channel's calibration holds.

    Parameters
    ----------
    channels : iterable of (str, Channel)
        Device and channel.
    today : date
        Day by which they are judged.
    """
    for device, channel in channels:
        if channel.quantity == "command":
            continue  # a set point is not measured
        calibration = channel.calibration
        item, text, end = f"calibration {channel.name}", calibration.id, calibration.valid_until
        if not calibration.certificate:
            remark = "no certificate is named; figures from it cannot be traced"
            yield CheckRow(device, item, text, Verdict.NOTE, remark)
        elif end is None:
            yield CheckRow(device, item, text, Verdict.NOTE, "its certificate has no “valid_until”")
        elif end < today:
            ago = (today - end).days
            remark = (
                f"expired on {end.isoformat()}, {ago} days ago: nothing measured since can be traced; "
                "calibrate, or enter the new certificate"
            )
            yield CheckRow(device, item, f"{text}, EXPIRED", Verdict.FAULT, remark)
        elif end - today <= CALIBRATION_SOON:
            yield CheckRow(device, item, text, Verdict.NOTE, f"ends soon, on {end.isoformat()}")
        else:
            yield CheckRow(device, item, f"{text}, valid until {end.isoformat()}")


def channels_of(stand_file: StandFile) -> Iterator[tuple[str, Channel]]:
    """Yield every channel of a stand with its device."""
    for channel in stand_file.controller.channel:
        yield "controller", channel
    for one in stand_file.instruments:
        yield one.stream, one.channel
    for number, device in enumerate(stand_file.acquisition):
        for channel in device.channels:
            yield acquisition_stream(number), channel
    for sensor in stand_file.temperature_sensors:
        yield sensor.name, sensor.channel()
