"""The figures of one cycle, by the names of the evaluation contract, and the windows they are read in."""

from __future__ import annotations

import numpy as np

from evaluation.cycles import STEADY_STROKE, cycle_samples, harmonics
from evaluation.loops import cut_loop
from evaluation.motion import Cycle, Loop
from evaluation.record import FloatArray, Record, Temperature
from evaluation.results import CycleResult, Quantities
from evaluation.smoothing import polynomial, smoothed

TANGENT_WINDOW = 0.15
"""Tangent stiffness: cubic fit of force over stroke within ± this share of the range about the mean."""
SPEED_WINDOW = 0.05
"""Speeds: slope of a local parabola over this share of a branch's samples (at least 5)."""
FORCE_WINDOW = 0.01
"""Extreme forces: maximum of a local parabola over this share of a branch's samples (at least 5)."""
CONSISTENCY = 0.02
"""Largest difference of loop area and π K″ x_a², as a share of the loop area, that passes without a word."""
SINE_DISTORTION = 0.01
"""Up to this distortion a stroke counts as a sine, for which the two must agree."""
TWO_SIDED = 0.02
"""A loop is two-sided when it reaches beyond zero by more than this share of its largest force."""
SLACK_STROKE = 0.02
SLACK_SLOPE = 0.005
"""Slack: the first 2 % of the range with less than this share of the secant stiffness."""
BLOCK_SLOPE = 3.0
"""Block contact: slope of the last 1 % of the range over that between 10 and 5 % below the top."""
TEMPERATURE_STALE_S = 30.0
"""A temperature reading further away than this from a cycle is not its temperature."""
_HARMONICS = 10


def stored_energy_J(loop: Loop) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the area under the loading branch, lower to upper turning point [J = kN·mm] (EN 15551: W_s)."""
    return float(np.trapezoid(loop.force_kN[loop.loading], loop.stroke_mm[loop.loading]))


def absorbed_energy_J(loop: Loop) -> float:  # noqa: N802
    """Return the signed area of the loop [J] (W_a); a loop that does not close is closed by a chord."""
    force, stroke = loop.force_kN, loop.stroke_mm
    chord = 0.5 * (force[-1] + force[0]) * (stroke[0] - stroke[-1])
    return float(np.trapezoid(force, stroke) + chord)


def local_force(
    loop: Loop, stroke_mm: float, half_width_mm: float, degree: int = 3
) -> tuple[float, float, int] | None:
    """Return force [kN], slope [kN/mm] and number of samples of the loading branch at a stroke.

    A polynomial of force over stroke within ± ``half_width_mm`` (cut at the branch's ends) is read at
    ``stroke_mm``; None when the branch does not reach it or too few samples lie in the window.
    """
    stroke, force = loop.stroke_mm[loop.loading], loop.force_kN[loop.loading]
    if not stroke[0] <= stroke_mm <= stroke[-1]:
        return None
    inside = np.abs(stroke - stroke_mm) <= half_width_mm
    count = int(np.count_nonzero(inside))
    if count < degree + 2:
        return None
    z = (stroke[inside] - stroke_mm) / half_width_mm
    coefficients = polynomial(z, force[inside], degree)
    return float(coefficients[0]), float(coefficients[1]) / half_width_mm, count


def _odd_window(share: float, samples: int) -> int:
    return max(5, 2 * int(0.5 * share * samples) + 1)


def branch_speed_mm_per_s(time_s: FloatArray, stroke_mm: FloatArray) -> float | None:
    """Return the largest absolute speed of a branch from its smoothed derivative; None below 5 samples."""
    if time_s.size < 5:
        return None
    even = np.linspace(time_s[0], time_s[-1], time_s.size)
    window = _odd_window(SPEED_WINDOW, even.size)
    speed = smoothed(np.interp(even, time_s, stroke_mm), window, 2, derivative=1)
    return float(np.max(np.abs(speed)) / (even[1] - even[0]))


def _smoothed_force(loop: Loop) -> FloatArray:
    """Return the force of both branches, each smoothed by itself so that peaks at turns stay sharp."""
    parts = []
    for branch in (loop.loading, loop.unloading):
        force = loop.force_kN[branch]
        window = _odd_window(FORCE_WINDOW, force.size)
        parts.append(smoothed(force, window, 2) if force.size >= window else force)
    return np.concatenate(parts)


def temperature_of(
    temperatures: tuple[Temperature, ...], start_s: float, end_s: float
) -> tuple[float | None, float | None]:
    """Return temperature at the start and highest one during a cycle, over all sensors on the specimen [°C].

    None where no sensor on the specimen has a reading within 30 s of the moment.
    """
    starts, highest = [], []
    for sensor in temperatures:
        good = np.isfinite(sensor.time_s) & np.isfinite(sensor.temperature_C)
        time, value = sensor.time_s[good], sensor.temperature_C[good]
        if sensor.role != "specimen" or time.size == 0:
            continue
        if np.min(np.abs(time - start_s)) > TEMPERATURE_STALE_S:
            continue
        starts.append(float(np.interp(start_s, time, value)))
        if np.min(np.abs(time - end_s)) <= TEMPERATURE_STALE_S:
            within = value[(time >= start_s) & (time <= end_s)]
            ends = np.interp([start_s, end_s], time, value)
            highest.append(float(np.max(np.concatenate((within, ends)))))
    return (max(starts) if starts else None), (max(highest) if highest else None)


def evaluate_cycle(record: Record, cycle: Cycle, loop: Loop | None = None) -> CycleResult:
    """Return the figures of one cycle; of a cycle that is not complete only those of its stroke.

    Parameters
    ----------
    record : Record
    cycle : Cycle
        Found in that record.
    loop : Loop, optional
        The cycle's loop, if it was cut already.

    Returns
    -------
    CycleResult
        Without uncertainties; ``warnings`` say why a figure is None or must be read with care.
    """
    if not cycle.complete:
        return _incomplete(record, cycle)
    warnings: list[str] = []
    loop = loop or cut_loop(record, cycle)
    span = cycle.range_mm
    stored, absorbed = stored_energy_J(loop), absorbed_energy_J(loop)
    smooth = _smoothed_force(loop)
    force_min, force_max = float(np.min(smooth)), float(np.max(smooth))
    mean = 0.5 * (cycle.stroke_min_mm + cycle.stroke_max_mm)
    tangent = local_force(loop, mean, TANGENT_WINDOW * span)
    if tangent is None:
        warnings.append("no tangent stiffness: too few samples about the mean stroke")
    first = first_harmonic(record, cycle)
    start_C, max_C = temperature_of(record.temperatures, cycle.start_s, cycle.end_s)
    warnings += _energy_warnings(stored, absorbed, force_min, force_max)
    if not is_two_sided(force_min, force_max):
        warnings += _slope_warnings(loop, span)
    warnings += consistency_warnings(first, cycle, absorbed)
    storage, loss = first.real, first.imag
    quantities = Quantities(
        stroke_min_mm=cycle.stroke_min_mm,
        stroke_max_mm=cycle.stroke_max_mm,
        prestress_mm=mean,
        amplitude_mm=0.5 * span,
        frequency_Hz=1.0 / cycle.duration_s,
        force_min_kN=force_min,
        force_max_kN=force_max,
        speed_loading_max_mm_per_s=branch_speed_mm_per_s(
            loop.time_s[loop.loading], loop.stroke_mm[loop.loading]
        ),
        speed_unloading_max_mm_per_s=branch_speed_mm_per_s(
            loop.time_s[loop.unloading], loop.stroke_mm[loop.unloading]
        ),
        stored_energy_J=stored,
        absorbed_energy_J=absorbed,
        damping=absorbed / stored if stored > 0.0 else None,
        tangent_stiffness_kN_per_mm=None if tangent is None else tangent[1],
        secant_stiffness_kN_per_mm=float(loop.force_kN[loop.top] - loop.force_kN[0]) / span,
        dynamic_stiffness_kN_per_mm=abs(first),
        storage_stiffness_kN_per_mm=storage,
        loss_stiffness_kN_per_mm=loss,
        loss_factor=loss / storage if storage > 0.0 else None,
        stroke_distortion=cycle.stroke_distortion,
        temperature_start_C=start_C,
        temperature_max_C=max_C,
    )
    if quantities.loss_factor is None:
        warnings.append("no loss factor: the storage stiffness is not positive")
    return CycleResult(cycle, quantities, warnings=tuple(warnings))


def _incomplete(record: Record, cycle: Cycle) -> CycleResult:
    span = cycle.range_mm
    start_C, max_C = temperature_of(record.temperatures, cycle.start_s, cycle.end_s)
    quantities = Quantities(
        stroke_min_mm=cycle.stroke_min_mm,
        stroke_max_mm=cycle.stroke_max_mm,
        prestress_mm=cycle.stroke_min_mm + 0.5 * span,
        amplitude_mm=0.5 * span,
        temperature_start_C=start_C,
        temperature_max_C=max_C,
    )
    return CycleResult(
        cycle,
        quantities,
        warnings=("not complete, no energies nor other figures of the loop: " + "; ".join(cycle.why),),
    )


def first_harmonic(record: Record, cycle: Cycle) -> complex:
    """Return K* = K′ + i K″ [kN/mm], the ratio of the first harmonics of force and stroke (ISO 4664-1)."""
    inside = cycle_samples(record, cycle)
    time = record.time_s[inside]
    both = np.stack((record.stroke_mm[inside], record.force_kN[inside]))
    stroke, force = harmonics(time, both, cycle.start_s, cycle.duration_s, _HARMONICS)
    # cos, sin amplitudes a, b are the phasor a - i b of exp(+i ω t); force leads stroke when K″ > 0.
    return complex(force[1, 0], -force[1, 1]) / complex(stroke[1, 0], -stroke[1, 1])


def is_two_sided(force_min_kN: float, force_max_kN: float) -> bool:
    """Say whether a loop reaches beyond zero to both sides by more than 2 % of its largest force."""
    least = TWO_SIDED * max(abs(force_min_kN), abs(force_max_kN))
    return force_min_kN < -least and force_max_kN > least


def _energy_warnings(stored: float, absorbed: float, force_min: float, force_max: float) -> list[str]:
    warnings = []
    if is_two_sided(force_min, force_max):
        warnings.append(
            "two-sided loop (the force changes sign): damping (absorbed over stored energy) is not meaningful"
        )
    if absorbed < 0.0:
        warnings.append(
            f"the loop area is negative ({absorbed:.4g} J): force lags stroke; "
            "check the signs and delays of the channels"
        )
    if stored <= 0.0:
        warnings.append(f"no damping: the stored energy is not positive ({stored:.4g} J)")
    return warnings


def _slope_warnings(loop: Loop, span: float) -> list[str]:
    """Recognise slack and block contact by local slopes of the loading branch."""
    stroke, force = loop.stroke_mm[loop.loading], loop.force_kN[loop.loading]
    low, high = float(stroke[0]), float(stroke[-1])
    secant = float(force[-1] - force[0]) / span

    def slope(first: float, last: float) -> float | None:
        inside = (stroke >= first) & (stroke <= last)
        if np.count_nonzero(inside) < 4 or np.ptp(stroke[inside]) < 0.5 * (last - first):
            return None
        return float(polynomial((stroke[inside] - first) / (last - first), force[inside], 1)[1]) / (
            last - first
        )

    warnings = []
    foot = slope(low, low + SLACK_STROKE * span)
    if foot is not None and secant > 0.0 and abs(foot) < SLACK_SLOPE * secant:
        warnings.append(
            f"slack: the force does not rise over the first {SLACK_STROKE * span:.3g} mm of the stroke"
        )
    end, before = slope(high - 0.01 * span, high), slope(high - 0.10 * span, high - 0.05 * span)
    if end is not None and before is not None and end > BLOCK_SLOPE * max(before, secant):
        warnings.append(
            f"block contact: the slope rises from {before:.3g} to {end:.3g} kN/mm at the end of the stroke"
        )
    return warnings


def consistency_warnings(first: complex, cycle: Cycle, absorbed: float) -> list[str]:
    """Compare the loop area with π K″ x_a², which it equals for a sine stroke whatever the force."""
    distortion = cycle.stroke_distortion
    if distortion is None or distortion > SINE_DISTORTION or absorbed == 0.0:
        return []
    if abs(cycle.stroke_end_mm - cycle.stroke_min_mm) > STEADY_STROKE * cycle.range_mm:
        return []
    from_harmonic = np.pi * first.imag * (0.5 * cycle.range_mm) ** 2
    difference = abs(from_harmonic / absorbed - 1.0)
    if difference <= CONSISTENCY:
        return []
    text = (
        f"loop area {absorbed:.5g} J and first harmonic π K″ x_a² = {from_harmonic:.5g} J disagree "
        f"by {difference:.1%}: samples are not evenly timed, or the cycle does not repeat"
    )
    return [text]
