"""Bounds of guard settings that depend on other keys: of stand, campaign and specimen.

Each is declared once, as one entry of :data:`RELATIVE`; the docs' table and the matrix of keys read it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from bufferstand.foundation import BadInput
from bufferstand.foundation.numbers import TILT_LEAST_MM, TILT_SHARE, TRIP_SHARE, tilt_bound_mm
from bufferstand.foundation.settings import place_of, read_text
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.bounded_numbers import POWER_ON_C
from bufferstand.protocols.campaign_file.schema import Campaign, CampaignFile
from bufferstand.protocols.campaign_file.step_kinds import RepeatStep, Step, StepSettings
from bufferstand.protocols.limits import OF_CAMPAIGN, STROKE_TRIP_MARGIN_MM, Bound, StandLimits, envelope

FORCE_TRIP_ROOM_KN = 20.0
"""Above a small force limit the trip may lie so far: a piston at 50 mm/s goes on for 18 ms, into 20 kN/mm."""
CAPACITY_SHARE = 0.05
"""Of the stand's force: tension, and a difference of two load cells, that may be allowed."""
FOLLOWING_SHARE = 0.1
"""Of the piston's travel: at 800 mm/s an actuator of 15 Hz lags by 14 mm, and none by a tenth of its way."""
SPEED_TRIP_FACTOR = 1.5
"""Of the speed limit in force: no overshoot of a motion comes near it."""
RELEASE_S = 50.0
"""The release from the largest stroke must take no longer: the safe stop gives up after 60 s [s]."""
READINGS_MISSED = 2.0
"""A sensor is silent when so many of its readings have failed to come."""
ABOVE_AIR_K = 1.0
"""A temperature stop lies at least so far above the air, or it stops a specimen that nothing has heated."""
UNSEEN_HEATING_K = 5.0
"""By so much a specimen may warm at its largest planned rate while no sensor is heard [K]: 45 °C at a stop of
40 °C harm no rubber; some tens of K more may."""


@dataclass(frozen=True)
class WatchedSensors:
    """What the planner must know of a stand's sensors.

    Parameters
    ----------
    power_on_C : float
        What a specimen's thermometer shows after it has lost its supply, the least of all [°C].
    period_s : float or None
        Of the thermometers' readings; None where there are none.
    """

    power_on_C: float = POWER_ON_C
    period_s: float | None = None


@dataclass(frozen=True)
class BoundFacts:
    """What bounds may depend on."""

    content: CampaignFile
    stand: StandLimits
    specimen: Specimen
    watching: WatchedSensors

    @property
    def force(self) -> Bound:
        """The force limit in force."""
        return envelope(self.stand, self.content.limits, self.specimen).force

    @property
    def stroke(self) -> Bound:
        """The stroke limit in force, the trip itself left out."""
        free = self.content.limits.model_copy(update={"stroke_trip_mm": None})
        return envelope(self.stand, free, self.specimen).stroke

    @property
    def speed(self) -> Bound:
        """The speed limit in force."""
        return envelope(self.stand, self.content.limits, self.specimen).speed


@dataclass(frozen=True)
class AllowedSpan:
    """Least and greatest value of a key, and what they follow from, in words with its figures."""

    low: float
    high: float
    low_from: str = ""
    high_from: str = ""
    low_key: tuple[str, str] | None = None
    """The key of the campaign file that sets it; None where another file or nothing does."""
    high_key: tuple[str, str] | None = None


@dataclass(frozen=True)
class RelativeBound:
    """A bound that depends on other keys.

    Parameters
    ----------
    table, key : str
        Where it is written.
    unit : str
        Of the value.
    words : str
        The bound in general, for the docs.
    why : str
        The reason.
    span : callable
        Its value, from what it depends on.
    why_not_more : str
        The reason of the upper bound, where it is another.
    """

    table: str
    key: str
    unit: str
    words: str
    why: str
    span: Callable[[BoundFacts], AllowedSpan]
    why_not_more: str = ""

    def value(self, content: CampaignFile) -> float | None:
        """Return what the campaign says, None where it is left to the default that follows from others."""
        found: float | None = getattr(getattr(content, self.table), self.key)
        return found


def _force_trip(ground: BoundFacts) -> AllowedSpan:
    force, most = ground.force, (1.0 + TRIP_SHARE) * ground.stand.force_max_kN
    own = max((1.0 + TRIP_SHARE) * force.value, force.value + FORCE_TRIP_ROOM_KN)
    high_from = (
        force.text() if own <= most else f"force_max_kN = {ground.stand.force_max_kN:g} kN (the stand)"
    )
    high_key = _key_of(force) if own <= most else None
    return AllowedSpan(force.value, min(own, most), force.text(), high_from, _key_of(force), high_key)


def _stroke_trip(ground: BoundFacts) -> AllowedSpan:
    stroke, most = ground.stroke, (1.0 + TRIP_SHARE) * ground.stand.stroke_max_mm
    own = max((1.0 + TRIP_SHARE) * stroke.value, stroke.value + STROKE_TRIP_MARGIN_MM)
    return AllowedSpan(0.01, min(own, most), "", stroke.text(), None, _key_of(stroke))


def _stop(ground: BoundFacts) -> AllowedSpan:
    air_C = ground.content.conditions.ambient_C
    return AllowedSpan(
        air_C + ABOVE_AIR_K,
        ground.watching.power_on_C,
        f"{ABOVE_AIR_K:g} K above [conditions] ambient_C = {air_C:g} °C",
        "what a thermometer that lost its supply shows",
        ("conditions", "ambient_C"),
    )


def _stale(ground: BoundFacts) -> AllowedSpan:
    period_s = ground.watching.period_s or 0.0
    return AllowedSpan(
        READINGS_MISSED * period_s, 30.0, f"[temperature] period_s = {period_s:g} s (the stand)"
    )


def _share(
    least: float, share: float, of: str, unit: str, floor: float
) -> Callable[[BoundFacts], AllowedSpan]:
    def span(ground: BoundFacts) -> AllowedSpan:
        whole: float = getattr(ground.stand, of)
        return AllowedSpan(floor, max(least, share * whole), "", f"{of} = {whole:g} {unit} (the stand)")

    return span


def _tilt(ground: BoundFacts) -> AllowedSpan:
    travel = ground.stand.stroke_max_mm
    return AllowedSpan(0.1, tilt_bound_mm(travel), "", f"stroke_max_mm = {travel:g} mm (the stand)")


def _speed_trip(ground: BoundFacts) -> AllowedSpan:
    speed = ground.speed
    return AllowedSpan(1.0, SPEED_TRIP_FACTOR * speed.value, "", speed.text(), None, _key_of(speed))


def _release(ground: BoundFacts) -> AllowedSpan:
    stroke, speed = ground.stroke, ground.speed
    low = min(stroke.value / RELEASE_S, speed.value)
    return AllowedSpan(low, speed.value, stroke.text(), speed.text(), _key_of(stroke), _key_of(speed))


def _key_of(bound: Bound) -> tuple[str, str] | None:
    """Return the key of the campaign file that sets a limit; None where stand or specimen do."""
    return ("limits", bound.name) if bound.source == OF_CAMPAIGN else None


_TILT_WORDS = (
    f"from 0.1 mm to {TILT_LEAST_MM:g} mm or {TILT_SHARE:.0%} of the stand's stroke_max_mm, whichever is more"
)

RELATIVE = (
    RelativeBound(
        "limits",
        "force_trip_kN",
        "kN",
        f"from the force limit in force to {TRIP_SHARE:.0%} above it (or {FORCE_TRIP_ROOM_KN:g} kN, if "
        f"that is more), and {TRIP_SHARE:.0%} above the stand's force_max_kN in any case",
        "the guard must act before the reserve of the stand is used up",
        _force_trip,
    ),
    RelativeBound(
        "limits",
        "stroke_trip_mm",
        "mm",
        f"up to {TRIP_SHARE:.0%} above the stroke limit in force (or {STROKE_TRIP_MARGIN_MM:g} mm, if "
        f"that is more), and {TRIP_SHARE:.0%} above the stand's stroke_max_mm in any case",
        "the guard must act before the specimen strikes its own end",
        _stroke_trip,
    ),
    RelativeBound(
        "limits",
        "temperature_stop_C",
        "°C",
        f"from {ABOVE_AIR_K:g} K above ambient_C to {POWER_ON_C:g} °C (as the specimen's "
        "thermometers show it by their calibration)",
        f"a thermometer that lost its supply shows {POWER_ON_C:g} °C for good: a stop above it is never "
        "reached then; one below the air stops what nothing has heated",
        _stop,
    ),
    RelativeBound(
        "limits",
        "temperature_stale_s",
        "s",
        f"from {READINGS_MISSED:g} × period_s of the stand's [temperature]; what the specimen warms "
        f"meanwhile at its largest planned rate is {UNSEEN_HEATING_K:g} K at most",
        "one reading that comes late is no silence",
        _stale,
    ),
    RelativeBound(
        "limits",
        "following_error_max_mm",
        "mm",
        f"from 0.5 mm to 10 mm or {FOLLOWING_SHARE:.0%} of the stand's stroke_max_mm, whichever is more",
        "no sound actuator lags by more, even at 800 mm/s",
        _share(10.0, FOLLOWING_SHARE, "stroke_max_mm", "mm", 0.5),
    ),
    RelativeBound(
        "guards",
        "force_below_kN",
        "kN",
        f"from 1 kN to 10 kN or {CAPACITY_SHARE:.0%} of the stand's force_max_kN, whichever is more",
        "a buffer cannot pull; 1 kN is zero and noise",
        _share(10.0, CAPACITY_SHARE, "force_max_kN", "kN", 1.0),
    ),
    RelativeBound(
        "guards",
        "agreement_kN",
        "kN",
        f"from 0.5 kN to 6 kN or {CAPACITY_SHARE:.0%} of the stand's force_max_kN, whichever is more",
        "two load cells that differ by more are wrong; half a kN is zero and noise",
        _share(6.0, CAPACITY_SHARE, "force_max_kN", "kN", 0.5),
    ),
    RelativeBound(
        "guards",
        "tilt_max_mm",
        "mm",
        _TILT_WORDS,
        "a straight specimen never brings the two draw wires so far apart",
        _tilt,
    ),
    RelativeBound(
        "zero",
        "wires_apart_max_mm",
        "mm",
        _TILT_WORDS,
        "a straight specimen never brings the two draw wires so far apart",
        _tilt,
    ),
    RelativeBound(
        "guards",
        "speed_trip_mm_per_s",
        "mm/s",
        f"from 1 mm/s to {SPEED_TRIP_FACTOR:g} × the speed limit in force",
        "no overshoot of a motion comes near it; a touch and a release must be possible",
        _speed_trip,
    ),
    RelativeBound(
        "motion",
        "release_speed_mm_per_s",
        "mm/s",
        f"from the stroke limit in force / {RELEASE_S:g} s to the speed limit in force",
        "the safe stop switches the valve off after 60 s, and a slower release has not ended by then",
        _release,
        "a release is a motion like any other",
    ),
)
"""Every bound that depends on other keys."""


def demand_bounds(
    campaign: Campaign, stand: StandLimits, specimen: Specimen, watching: WatchedSensors
) -> None:
    """Refuse a guard setting outside its bounds.

    Parameters
    ----------
    campaign : Campaign
        As read.
    stand : StandLimits
        From the stand file.
    specimen : Specimen
        From the specimen file.
    watching : Watching
        What is known of the stand's sensors.

    Raises
    ------
    BadInput
        With key, line, value, bound, what the bound follows from, and the reason.
    """
    ground = BoundFacts(campaign.content, stand, specimen, watching)
    for rule, path, value in _settings(campaign.content):
        span = rule.span(ground)
        too_low = value < span.low * (1.0 - 1e-9)
        if too_low or value > span.high * (1.0 + 1e-9):
            raise _refusal(campaign, rule, path, value, span, too_low=too_low)


def _refusal(
    campaign: Campaign,
    rule: RelativeBound,
    path: tuple[str | int, ...],
    value: float,
    span: AllowedSpan,
    *,
    too_low: bool,
) -> BadInput:
    """Return what is said of a setting: at the key that somebody wrote, with the bound and what to write."""
    text, unit = read_text(campaign.path), rule.unit
    bound, source = (span.low, span.low_from) if too_low else (span.high, span.high_from)
    setter = span.low_key if too_low else span.high_key
    follows = f" ({source})" if source else ""
    if span.low > span.high:
        bound, follows = span.high, f" ({span.high_from}), and cannot keep {span.low:g} ({span.low_from})"
    side, limit = ("below", "more") if too_low else ("above", "less")
    said = f"{rule.key} = {value!r} is {side} its bound of {bound:g} {unit}{follows}"
    write = f"write {rule.key} = {kept_text(bound, up=too_low)} or {limit}"
    if not _written(path, campaign.content):
        said = (
            f"{rule.key}, which is {value:g} {unit} where it is not written, is {side} its bound of "
            f"{bound:g} {unit}{follows}"
        )
        write += f" under [{rule.table}]"
        if setter is not None and _written(setter, campaign.content):
            path = setter
            write += f", or a {'smaller' if too_low else 'larger'} {setter[1]}"
    why = rule.why if too_low or not rule.why_not_more else rule.why_not_more
    return BadInput(said, file=campaign.path, place=place_of(path, text), remedy=f"{write}: {why}")


def _written(path: tuple[str | int, ...], content: CampaignFile) -> bool:
    """Return whether a key is written in the file; what a step has of its own always is."""
    table, key = path[0], path[-1]
    if len(path) > 2:
        return True
    return table in content.model_fields_set and key in getattr(content, str(table)).model_fields_set


def kept_text(bound: float, *, up: bool) -> str:
    """Return a bound with six digits that keeps it."""
    digits = 5 - math.floor(math.log10(abs(bound))) if bound else 0
    scaled = bound * 10.0**digits
    whole = math.ceil(scaled - 1e-9 * scaled) if up else math.floor(scaled + 1e-9 * scaled)
    return f"{whole / 10.0**digits:.6g}"


def _settings(content: CampaignFile) -> Iterator[tuple[RelativeBound, tuple[str | int, ...], float]]:
    """Yield each bounded setting that has a value, with its place in the file; those of steps, too."""
    for rule in RELATIVE:
        if (value := rule.value(content)) is not None:
            yield rule, (rule.table, rule.key), value
    stop = next(rule for rule in RELATIVE if rule.key == "temperature_stop_C")
    for path, step in _steps(content.step):
        if isinstance(step, StepSettings) and step.temperature_stop_C is not None:
            yield stop, (*path, stop.key), step.temperature_stop_C


def _steps(steps: tuple[Step, ...]) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    for number, step in enumerate(steps):
        yield ("step", number), step
        if isinstance(step, RepeatStep):
            for inner, nested in enumerate(step.step):
                yield ("step", number, "step", inner), nested
