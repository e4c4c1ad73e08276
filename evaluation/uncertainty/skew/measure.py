"""Measuring the skew between force and stroke on an elastic reference.

Whatever such a spring's characteristic, its loop encloses no area: what a record of it encloses is the skew
(and the little that the reference itself loses). At one frequency the two cannot be distinguished; over
several frequencies a loss that does not depend on the rate stays, and the skew's share grows with ω:
δ = η - ω τ, a straight line in ω whose slope is the skew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import fdtri, stdtrit

from bufferstand.evaluation.cycles import find_cycles
from bufferstand.evaluation.facts import REFERENCE_LOSS, Cycle, RunFacts
from bufferstand.evaluation.loops import cut_loop
from bufferstand.evaluation.quantities import absorbed_energy_J, first_harmonic
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.skew.resolution import Resolution, skew_floors
from bufferstand.evaluation.uncertainty.skew.sensitivity import advanced, area_rate_J_per_s
from bufferstand.foundation import BadInput
from bufferstand.foundation.numbers import median

SAME_FREQUENCY = 0.05
"""Cycles whose frequencies agree within this share are one point."""
SEVERAL_FREQUENCIES = 1.5
"""Least ratio of frequencies at which the reference's own loss is fitted instead of assumed."""
LEAST_CYCLES = 3
"""Fewest cycles at a frequency: their scatter is the noise's part of the uncertainty."""
LARGE_LOSS = 0.05
"""A loss factor above this is no elastic reference's."""
_SUREST = 0.7
"""No frequency counts as surer than this share of their median: with three of them the interval holds the
truth in 96 % of simulated measurements, and in 98 % if none counted as surer than the median."""
_COVERED = 0.9545
"""Probability that U = k u covers; k = 2 for many degrees of freedom."""
_TOO_MUCH = 0.95
"""Points that scatter about the line more than so many sets of points would by chance: it is no line."""
_STEPS = 3
_SQRT3 = float(np.sqrt(3.0))

Criterion = Literal["no-area", "area-linear-in-frequency"]


@dataclass(frozen=True)
class SkewPoint:
    """Skew at one frequency, as if the reference had no loss: means over cycles [s]."""

    runs: tuple[str, ...]
    frequency_Hz: float
    amplitude_mm: float
    cycles: int
    skew_s: float
    standard_uncertainty_s: float
    by_phase_s: float
    resolution_s: float = 0.0
    """What the steps of the converters do to it, in the best of its cycles [s]."""


@dataclass(frozen=True)
class SkewMeasurement:
    """Lateness of the force against the stroke, after the delays that the run files apply already.

    Attributes
    ----------
    skew_s, expanded_uncertainty_s, coverage_factor : float
        By the loop area; positive when the force is late.
    by_phase_s : float
        The same by the phase of the first harmonics, -atan(K″ / K′) / ω.
    criterion : str
        ``no-area`` or, over several frequencies, ``area-linear-in-frequency``.
    reference_loss : float
        Loss factor of the reference: its assumed limit, or the fitted one.
    standard_uncertainties_s : mapping
        By source: the scatter of the cycles, and what does not show in it (:func:`skew_floors`).
    force_delay_s : float
        ``delay_s`` that the force channel of these runs has.
    delay_s : float
        ``delay_s`` to write for it: the former and the skew.
    """

    skew_s: float
    expanded_uncertainty_s: float
    coverage_factor: float
    by_phase_s: float
    criterion: Criterion
    reference_loss: float
    standard_uncertainties_s: Mapping[str, float]
    force_delay_s: float
    delay_s: float
    points: tuple[SkewPoint, ...]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _OfCycle:
    run: str
    frequency_Hz: float
    amplitude_mm: float
    skew_s: float
    by_phase_s: float
    resolution_s: float


def cycle_skew_s(record: Record, cycle: Cycle) -> float:
    """Return by how much the force must be moved earlier for the cycle's loop to enclose no area [s].

    Newton's method on the area of the shifted loop, whose slope is ∮ Ḟ dx.

    Raises
    ------
    BadInput
        If the force does not rise with the stroke, so that there is no such shift.
    """
    rate = area_rate_J_per_s(record, cycle)
    if rate <= 0.0:
        raise BadInput(
            f"in cycle {cycle.index} the force does not rise with the stroke",
            remedy="a run on an elastic reference spring is needed",
        )
    skew_s = 0.0
    for _ in range(_STEPS):
        loop = cut_loop(advanced(record, cycle, skew_s), cycle)
        step_s = -absorbed_energy_J(loop) / rate
        skew_s += float(np.clip(step_s, -0.1 * cycle.duration_s, 0.1 * cycle.duration_s))
    return skew_s


def measure_skew(
    runs: Sequence[tuple[Record, RunFacts]], *, reference_loss: float = REFERENCE_LOSS
) -> SkewMeasurement:
    """Measure the skew from runs on an elastic reference.

    Parameters
    ----------
    runs : sequence of (Record, RunFacts)
        At one frequency, or better at several; the complete, steady cycles of all count.
    reference_loss : float
        Largest loss factor of the reference: its limit where all runs have one frequency; else a tenth of it
        (or of the one found) is the limit of what it may vary by over the frequencies.

    Returns
    -------
    SkewMeasurement

    Raises
    ------
    BadInput
        If there are fewer than three such cycles at a frequency, the runs were made with different delays,
        or the limit of the loss is not from 0 up.
    """
    if not reference_loss >= 0.0:
        raise BadInput("the reference's loss factor must not be negative", place="--reference-loss")
    delays = {facts.force_delay_s for _, facts in runs}
    if len(delays) != 1:
        listed = ", ".join(f"{1e3 * delay:g} ms" for delay in sorted(delays))
        raise BadInput(
            f"the runs were made with different delays of the force ({listed})",
            remedy="measure the skew from runs of one set-up of the stand",
        )
    found = [one for record, facts in runs for one in _cycles_of(record, facts)]
    points = [_point(group) for group in _by_frequency(found)]
    enough = [point for point in points if point.cycles >= LEAST_CYCLES]
    if not enough:
        raise BadInput(
            f"fewer than {LEAST_CYCLES} complete, steady cycles at any frequency",
            file=", ".join(facts.path or facts.id for _, facts in runs) or None,
            remedy="record at least five cycles at a constant amplitude on an elastic reference",
        )
    warnings = [
        f"left out: {point.frequency_Hz:.3g} Hz has only {point.cycles} complete, steady cycles"
        for point in points
        if point.cycles < LEAST_CYCLES
    ]
    return _combined(enough, reference_loss, delays.pop(), warnings)


def _cycles_of(record: Record, facts: RunFacts) -> list[_OfCycle]:
    found = []
    steps = Resolution.of(record)
    for cycle in find_cycles(record):
        if not (cycle.complete and cycle.steady):
            continue
        try:
            skew_s = cycle_skew_s(record, cycle)
        except BadInput as error:
            raise BadInput(error.problem, file=facts.path or facts.id, remedy=error.remedy) from None
        first = first_harmonic(record, cycle)
        phase_s = -float(np.arctan2(first.imag, first.real)) * cycle.duration_s / (2.0 * np.pi)
        half_mm, frequency_Hz = 0.5 * cycle.range_mm, 1.0 / cycle.duration_s
        samples = int(np.diff(np.searchsorted(record.time_s, [cycle.start_s, cycle.end_s]))[0])
        resolution_s = steps.skew_s(abs(first) * half_mm, half_mm, max(1, samples), frequency_Hz)
        found.append(_OfCycle(facts.id, frequency_Hz, half_mm, skew_s, phase_s, resolution_s))
    return found


def _by_frequency(found: Sequence[_OfCycle]) -> list[list[_OfCycle]]:
    groups: list[list[_OfCycle]] = []
    for one in sorted(found, key=lambda one: one.frequency_Hz):
        if groups and one.frequency_Hz <= (1.0 + SAME_FREQUENCY) * groups[-1][0].frequency_Hz:
            groups[-1].append(one)
        else:
            groups.append([one])
    return groups


def _point(group: Sequence[_OfCycle]) -> SkewPoint:
    skews = np.array([one.skew_s for one in group])
    scatter = float(np.std(skews, ddof=1)) / float(np.sqrt(skews.size)) if skews.size > 1 else 0.0
    return SkewPoint(
        runs=tuple(dict.fromkeys(one.run for one in group)),
        frequency_Hz=float(np.mean([one.frequency_Hz for one in group])),
        amplitude_mm=float(np.mean([one.amplitude_mm for one in group])),
        cycles=skews.size,
        skew_s=float(np.mean(skews)),
        standard_uncertainty_s=scatter,
        by_phase_s=float(np.mean([one.by_phase_s for one in group])),
        resolution_s=min(one.resolution_s for one in group),
    )


def _combined(
    points: Sequence[SkewPoint], reference_loss: float, force_delay_s: float, warnings: Sequence[str]
) -> SkewMeasurement:
    """Join the points: a line over ω where the frequencies allow it, else their weighted mean."""
    warnings = list(warnings)
    omega = 2.0 * np.pi * np.array([point.frequency_Hz for point in points])
    skew = np.array([point.skew_s for point in points])
    phase = np.array([point.by_phase_s for point in points])
    # A few cycles that agree by chance must not outweigh all others.
    own = np.array([point.standard_uncertainty_s for point in points])
    u = np.maximum(own, max(_SUREST * median(own), 1e-9))
    dof = float(sum(point.cycles - 1 for point in points))
    several = omega[-1] >= SEVERAL_FREQUENCIES * omega[0]
    # δ = ω τ - η for every point; without several frequencies η is not fitted but bounded.
    columns = np.column_stack((omega, -np.ones_like(omega))) if several else omega[:, None]
    weighted = columns / (omega * u)[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted)
    operator = covariance @ weighted.T / u
    fit = operator @ np.column_stack((skew, phase))
    left = len(points) - columns.shape[1]
    if left > 0:
        chi2 = float(np.sum((weighted @ fit[:, 0] - skew / u) ** 2))
        # The points' own uncertainties come from a few cycles each: only what they do not explain counts.
        if chi2 / left > fdtri(left, max(dof, 1.0), _TOO_MUCH):
            covariance, dof = covariance * (chi2 / left), float(left)
    budget = {"scatter": float(np.sqrt(covariance[0, 0]))}
    loss = float(fit[1, 0]) if several else reference_loss
    if not several:
        budget["reference loss"] = reference_loss / _SQRT3 / float(np.mean(omega))
        if float(np.max(np.abs(omega * skew))) > LARGE_LOSS:
            warnings.append(
                "the loop is wide for an elastic reference: its own loss, which one frequency cannot tell "
                "from skew, may be larger than stated; measure at several frequencies"
            )
    else:
        amplitudes = [point.amplitude_mm for point in points]
        if max(amplitudes) > 1.05 * min(amplitudes):
            warnings.append(
                f"the amplitude varies from {min(amplitudes):.3g} to {max(amplitudes):.3g} mm: "
                "the reference's own loss may vary with it"
            )
        if abs(loss) > LARGE_LOSS:
            warnings.append(
                f"the reference loses energy itself (loss factor {loss:.3f}): if that loss depends on the "
                "rate, it is part of the skew found"
            )
    tau = float(fit[0, 0])
    budget |= skew_floors(
        omega,
        operator[0],
        [point.resolution_s for point in points],
        skew_s=tau,
        delay_s=force_delay_s + tau,
        loss=max(abs(loss), reference_loss) if several else None,
    )
    combined = float(np.sqrt(sum(value**2 for value in budget.values())))
    # Welch-Satterthwaite: only the scatter has few degrees of freedom.
    free = dof * (combined / budget["scatter"]) ** 4 if budget["scatter"] > 0.0 else float("inf")
    factor = float(stdtrit(min(free, 1e6), 0.5 * (1.0 + _COVERED)))
    return SkewMeasurement(
        skew_s=tau,
        expanded_uncertainty_s=factor * combined,
        coverage_factor=factor,
        by_phase_s=float(fit[0, 1]),
        criterion="area-linear-in-frequency" if several else "no-area",
        reference_loss=loss,
        standard_uncertainties_s=budget,
        force_delay_s=force_delay_s,
        delay_s=force_delay_s + tau,
        points=tuple(points),
        warnings=tuple(warnings),
    )
