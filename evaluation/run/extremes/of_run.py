"""The extremes of a run, from its samples as they were recorded (docs/evaluation-document.md)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bufferstand.evaluation.facts import EXTREME_NAMES, CycleResult, DrawWires, Extreme, Finding, StepResult
from bufferstand.evaluation.numerics import FloatArray, noise_sigma
from bufferstand.evaluation.record import Ends, Peak, Record, Temperature, peaks_of, stands_alone
from bufferstand.evaluation.run.extremes.errors import (
    ExtremeReadings,
    channel_errors,
    force_errors,
    rivals_of,
    speed_errors,
    stated,
    stroke_errors,
    temperature_errors,
)
from bufferstand.evaluation.run.extremes.speeds import SpeedPeak, greatest_speeds
from bufferstand.evaluation.uncertainty import Draws, Noise, Spectrum
from bufferstand.foundation.channels import STROKE_CHANNELS, ChannelUncertainty

Extremes = Mapping[str, Extreme]
_ENDS = ("min", "max")
_UNITS = {"force": "kN", "stroke": "mm", "speed": "mm_per_s", "temperature": "C"}
_SHOWN = {"force": "kN", "stroke": "mm", "speed": "mm/s", "temperature": "K"}
_TURNS = 0.02
"""A stroke that leaves its neighbours by this share of its range turns there, on few samples; so does the
force."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A run before its samples were averaged, and after.

    Attributes
    ----------
    samples : Record
        Every sample; where the run is so long that it came averaged, its ``ends`` are those of the samples.
    evaluated : Record
        What its cycles were found in.
    inertia : (array, array) or None
        When, and what the correction for a moving mass added to the force [s, kN].
    wires : DrawWires or None
    speed : ChannelUncertainty or None
        What a measured speed channel states of itself.
    noise : Noise or None
        That of ``samples``, over frequency.
    """

    samples: Record
    evaluated: Record
    inertia: tuple[FloatArray, FloatArray] | None = None
    wires: DrawWires | None = None
    speed: ChannelUncertainty | None = None
    noise: Noise | None = None

    def between(self, start_s: float, end_s: float) -> Recorded:
        """Return what was recorded from one moment to another."""
        samples, evaluated = (_part(each, start_s, end_s) for each in (self.samples, self.evaluated))
        return replace(self, samples=samples, evaluated=evaluated)

    def inertia_force(self, time_s: FloatArray | float) -> FloatArray:
        """Return the force that was added for inertia at moments [kN]."""
        if self.inertia is None:
            return np.zeros_like(np.asarray(time_s, dtype=np.float64))
        return np.asarray(np.interp(time_s, *self.inertia))


def _part(record: Record, start_s: float, end_s: float) -> Record:
    """Return the samples and readings of a record from one moment to another."""
    first = int(np.searchsorted(record.time_s, start_s))
    last = int(np.searchsorted(record.time_s, end_s, side="right"))
    own = slice(first, last)
    speed = record.speed_mm_per_s
    return replace(
        record,
        time_s=record.time_s[own],
        stroke_mm=record.stroke_mm[own],
        force_kN=record.force_kN[own],
        speed_mm_per_s=None if speed is None else speed[own],
        breaks=tuple(at - first for at in record.breaks if first < at < last),
        temperatures=tuple(_readings(sensor, start_s, end_s) for sensor in record.temperatures),
        ends={},
    )


def _readings(sensor: Temperature, start_s: float, end_s: float) -> Temperature:
    inside = (sensor.time_s >= start_s) & (sensor.time_s <= end_s)
    return replace(
        sensor, time_s=sensor.time_s[inside], temperature_C=sensor.temperature_C[inside], ends=None
    )


def run_extremes(recorded: Recorded, results: Sequence[CycleResult], draws: Draws | None) -> Extremes:
    """Return the least and greatest of all samples of a run, by name (:data:`EXTREME_NAMES`).

    Parameters
    ----------
    recorded : Recorded
    results : sequence of CycleResult
        In order of time.
    draws : Draws, optional
        Errors of the channels; None where they are not known, or not asked for.
    """
    found: dict[str, Extreme] = dict.fromkeys(EXTREME_NAMES, Extreme())
    if recorded.samples.time_s.size:
        found |= _forces(recorded, draws)
        found |= _strokes(recorded, draws)
        found |= _speeds(recorded, results, draws)
    found |= _temperatures(recorded.samples.temperatures, draws)
    return {name: _with_cycle(extreme, results) for name, extreme in found.items()}


def step_extremes(
    recorded: Recorded, step: StepResult, results: Sequence[CycleResult], draws: Draws | None
) -> Extremes:
    """Return the extremes of one of several steps of a run: of its samples between its first and last turn.

    Of a run that came averaged they are those of the averages, and ``doubt`` says so.
    """
    own = [r for r in results if step.start_s <= r.cycle.start_s and r.cycle.end_s <= step.end_s]
    found = run_extremes(recorded.between(step.start_s, step.end_s), own, draws)
    averaged = recorded.samples.averaged
    if averaged == 1:
        return found
    text = f"of means over {averaged} samples: the run is too long to be held at once"
    return {
        name: replace(extreme, doubt=extreme.doubt or text)
        if extreme.channel in ("force", "stroke", *STROKE_CHANNELS, "speed")
        else extreme
        for name, extreme in found.items()
    }


def sample_extremes(record: Record) -> dict[str, Extreme]:
    """Return the extremes of a record's samples, without speeds and uncertainties."""
    known = _temperatures(record.temperatures, None)
    if not record.time_s.size:
        return known
    samples = Recorded(record, record)
    return {**_forces(samples, None), **_strokes(samples, None), **known}


def extreme_warnings(
    extremes: Extremes, said: Sequence[str], findings: Sequence[Finding] = (), *, drawn: bool
) -> list[str]:
    """Return a warning for every extreme that is doubtful, is not there or has no uncertainty.

    Parameters
    ----------
    extremes : mapping of str to Extreme
    said : sequence of str
        The run's warnings so far: that it has no samples or no temperature is not said twice.
    findings : sequence of Finding
        Each has a warning of its own, so that a doubt which it is the reason of is not said a second time.
    drawn : bool
        Whether uncertainties were drawn at all; where they were not, the run's warnings say why.
    """
    names: dict[str, list[str]] = {}
    told = {finding.text for finding in findings}
    for name, extreme in extremes.items():
        if extreme.doubt and extreme.doubt not in told:
            names.setdefault(extreme.doubt, []).append(name)
        if extreme.value is None:
            if (why := _why_missing(name, extremes, said)) is not None:
                names.setdefault(why, []).append(name)
        elif drawn and extreme.expanded_uncertainty is None and not extreme.doubt:
            text = f"no expanded uncertainty: the channel {extreme.channel} states no accuracy"
            names.setdefault(text, []).append(name)
    return [f"extremes of the run, {', '.join(of)}: {text}" for text, of in names.items()]


def _why_missing(name: str, extremes: Extremes, said: Sequence[str]) -> str | None:
    if name.startswith("temperature"):
        known = any(text.startswith("no temperature") for text in said)
        return None if known else "no temperature: no reading of a sensor on the specimen is a number"
    if extremes["stroke_max_mm"].value is None:
        return None  # no samples at all: nothing was found in the run, and that is said
    return "no value: nothing moved that way over five samples"


def _named(quantity: str, ends: Ends | None, channel: str) -> dict[str, Extreme]:
    """Return least and greatest of a channel by name, with what speaks against them."""
    if ends is None:
        return {}
    range_ = ends[1].value - ends[0].value
    return {
        f"{quantity}_{which}_{_UNITS[quantity]}": Extreme(
            peak.value, peak.time_s, channel=channel, doubt=_doubt(quantity, peak, range_)
        )
        for which, peak in zip(_ENDS, ends, strict=True)
    }


def _doubt(quantity: str, peak: Peak, range_: float) -> str:
    apart = stands_alone(peak, quantity, range_)
    if apart is None:
        return ""
    return (
        f"one lone sample at {peak.time_s:.6g} s, {apart:.3g} {_SHOWN[quantity]} from its neighbours; "
        "look at the record there: a spike is no value of the specimen"
    )


def _at_turns(found: dict[str, Extreme], samples: Record) -> dict[str, Extreme]:
    """Return extremes of the force without the doubt in those that have a turn of the stroke beside them."""
    known = {}
    for name, extreme in found.items():
        if extreme.doubt and extreme.time_s is not None:
            row = int(np.argmin(np.abs(samples.time_s - extreme.time_s)))
            side = 1.0 if name.startswith("force_max") else -1.0
            near = side * samples.stroke_mm[max(0, row - 1) : row + 2]
            least = _TURNS * float(np.ptp(samples.stroke_mm))
            if near.size == 3 and near[1] - max(near[0], near[2]) > least:
                extreme = replace(extreme, doubt="")  # noqa: PLW2901
        known[name] = extreme
    return known


def _forces(recorded: Recorded, draws: Draws | None) -> dict[str, Extreme]:
    samples = recorded.samples
    force_kN = samples.force_kN
    ends = samples.ends.get("force") or _as_read(samples, "force")
    if recorded.inertia is not None:
        # The greatest force on the specimen is not where the cell read most: all samples are corrected.
        force_kN = force_kN + recorded.inertia_force(samples.time_s)
        ends = _corrected(samples.ends["force"], recorded) if "force" in samples.ends else None
    ends = ends or peaks_of(samples.time_s, force_kN, samples.breaks)
    found = _at_turns(_named("force", ends, "force"), samples)
    if draws is None or ends is None:
        return found
    spectrum = None if recorded.noise is None else recorded.noise.force
    sigma, _ = _scatter(spectrum, samples.force_kN, samples.averaged)
    if recorded.inertia is None and "force" in samples.as_recorded:
        # Moving readings to other instants averages them: that noise is not the one that chose among them.
        force_kN = samples.as_recorded["force"][1]
        sigma = max(sigma, noise_sigma(force_kN))
    hum_kN = sum(line.amplitude for line in recorded.noise.force_lines) if recorded.noise else 0.0
    most = max(ends[1].value, 0.0)

    def errors(peak: Peak) -> FloatArray:
        rivals = rivals_of(force_kN, peak.value, sigma, samples.averaged)
        reading = ExtremeReadings(peak.value, sigma, rivals, hum_kN)
        falls = 0.0 if peak is ends[1] else most
        return force_errors(draws, reading, falls, float(recorded.inertia_force(peak.time_s)))

    return _with_uncertainty(found, ends, errors)


def _scatter(spectrum: Spectrum | None, values: FloatArray, averaged: int) -> tuple[float, float]:
    """Return the standard deviation of a sample's noise, slow and fast, and the amplitude of hum."""
    if spectrum is None:
        return noise_sigma(values) * float(np.sqrt(averaged)), 0.0
    rest = replace(spectrum, lines=()).sigma
    # Of samples that came as means of some the fast part is known of these only.
    fast = float(np.sqrt(spectrum.density[-1] / spectrum.step_s * (averaged - 1)))
    return float(np.hypot(rest, fast)), sum(line.amplitude for line in spectrum.lines)


def _as_read(samples: Record, channel: str) -> Ends | None:
    """Return the ends of a channel's own readings where they were moved to other instants.

    Beside a jump the curve that moves them overshoots every reading.
    """
    if channel not in samples.as_recorded:
        return None
    time_s, value = samples.as_recorded[channel]
    first = np.searchsorted(time_s, samples.time_s[0])
    inside = slice(int(first), int(np.searchsorted(time_s, samples.time_s[-1], side="right")))
    return peaks_of(time_s[inside], value[inside])


def _corrected(ends: Ends, recorded: Recorded) -> Ends:
    one, other = (replace(p, value=p.value + float(recorded.inertia_force(p.time_s))) for p in ends)
    return one, other


def _strokes(recorded: Recorded, draws: Draws | None) -> dict[str, Extreme]:
    samples = recorded.samples
    channel, out = "stroke", {one.wire for one in recorded.wires.out} if recorded.wires else set()
    if out:
        known = samples.as_recorded.keys() | samples.ends.keys()
        wires = [name for name in STROKE_CHANNELS if name in known] or STROKE_CHANNELS[:2]
        left = [name for name in wires if name not in out]
        channel = left[0] if len(left) == 1 else "stroke"
    ends = None if out and channel == "stroke" else samples.ends.get(channel)
    ends = ends or peaks_of(samples.time_s, samples.stroke_mm, samples.breaks)
    found = _named("stroke", ends, channel)
    if draws is None or ends is None:
        return found
    spectrum = None if recorded.noise is None else recorded.noise.stroke
    sigma, hum_mm = _scatter(spectrum, samples.stroke_mm, samples.averaged)

    def errors(peak: Peak) -> FloatArray:
        rivals = rivals_of(samples.stroke_mm, peak.value, sigma, samples.averaged)
        return stroke_errors(draws, ExtremeReadings(peak.value, sigma, rivals, hum_mm))

    return _with_uncertainty(found, ends, errors)


def _with_uncertainty(
    found: Mapping[str, Extreme], ends: Ends, errors: Callable[[Peak], FloatArray]
) -> dict[str, Extreme]:
    known = {}
    for (name, extreme), peak in zip(found.items(), ends, strict=True):
        U, half = stated(errors(peak))
        known[name] = replace(extreme, expanded_uncertainty=U, half_width_95=half)
    return known


def _speeds(recorded: Recorded, results: Sequence[CycleResult], draws: Draws | None) -> dict[str, Extreme]:
    samples = recorded.samples
    if samples.speed_mm_per_s is not None:
        ends = samples.ends.get("speed") or peaks_of(samples.time_s, samples.speed_mm_per_s, samples.breaks)
        if ends is not None:
            return _measured_speeds(ends, recorded, draws)
    peaks = greatest_speeds(recorded.evaluated, results)
    evaluated = recorded.evaluated
    sigma_mm = 0.0 if draws is None else evaluated.stroke_sampling.sigma
    both = [_of_slope(peak, draws, sigma_mm) for peak in peaks]
    return _three(*both)


def _measured_speeds(ends: Ends, recorded: Recorded, draws: Draws | None) -> dict[str, Extreme]:
    samples, by = recorded.samples, recorded.speed
    assert samples.speed_mm_per_s is not None
    speeds = samples.speed_mm_per_s
    range_ = ends[1].value - ends[0].value
    both = []
    for sign, peak in zip((-1.0, 1.0), ends, strict=True):
        if sign * peak.value <= 0.0:
            both.append(Extreme())
            continue
        doubt = _doubt("speed", peak, range_)
        extreme = Extreme(abs(peak.value), peak.time_s, channel="speed", doubt=doubt)
        if draws is not None and by is not None and by.accuracy_percent is not None:
            sigma = noise_sigma(speeds) * float(np.sqrt(samples.averaged))
            rivals = rivals_of(speeds, peak.value, sigma, samples.averaged)
            U, half = stated(channel_errors(draws, ExtremeReadings(peak.value, sigma, rivals), by))
            extreme = replace(extreme, expanded_uncertainty=U, half_width_95=half)
        both.append(extreme)
    unloading, loading = both
    return _three(loading, unloading)


def _of_slope(peak: SpeedPeak | None, draws: Draws | None, sigma_mm: float) -> Extreme:
    if peak is None:
        return Extreme()
    extreme = Extreme(peak.speed_mm_per_s, peak.time_s, channel="stroke")
    if draws is None:
        return extreme
    U, half = stated(speed_errors(draws, peak, sigma_mm))
    return replace(extreme, expanded_uncertainty=U, half_width_95=half)


def _three(loading: Extreme, unloading: Extreme) -> dict[str, Extreme]:
    known = [one for one in (loading, unloading) if one.value is not None]
    return {
        "speed_max_mm_per_s": max(known, key=lambda one: one.value or 0.0, default=Extreme()),
        "speed_loading_max_mm_per_s": loading,
        "speed_unloading_max_mm_per_s": unloading,
    }


def _temperatures(sensors: Sequence[Temperature], draws: Draws | None) -> dict[str, Extreme]:
    """Return coldest and warmest reading of all sensors on the specimen."""
    best: dict[str, tuple[Extreme, Temperature]] = {}
    for sensor in sensors:
        if sensor.role != "specimen":
            continue
        ends = sensor.ends or peaks_of(sensor.time_s, sensor.temperature_C)
        for name, extreme in _named("temperature", ends, sensor.name).items():
            sign = 1.0 if "_max_" in name else -1.0
            former = best.get(name)
            if former is None or sign * (extreme.value or 0.0) > sign * (former[0].value or 0.0):
                best[name] = extreme, sensor
    found = {}
    for name, (extreme, sensor) in best.items():
        known = extreme
        if draws is not None and sensor.accuracy_C is not None:
            U, half = stated(temperature_errors(draws, sensor.accuracy_C))
            known = replace(extreme, expanded_uncertainty=U, half_width_95=half)
        found[name] = known
    return found


def _with_cycle(extreme: Extreme, results: Sequence[CycleResult]) -> Extreme:
    """Return an extreme with the cycle in which it lies."""
    if extreme.time_s is None:
        return extreme
    number = bisect_right(results, extreme.time_s, key=lambda r: r.cycle.start_s) - 1
    if number < 0 or extreme.time_s > results[number].cycle.end_s:
        return extreme
    return replace(extreme, cycle=results[number].cycle.index)
