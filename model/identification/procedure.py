"""Identifies a spring model from recorded runs: free parameters, fit, quality, and what is missing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import BadInput
from bufferstand.model.curves import Curves
from bufferstand.model.identification.continuation import Continued, continued
from bufferstand.model.identification.coverage import CoverageFacts, facts_of, reason, without_contrast
from bufferstand.model.identification.drive import Drive
from bufferstand.model.identification.fitting import (
    COVERAGE,
    Estimate,
    Solution,
    curve_spread,
    estimates,
    freeze,
    identified,
    solve,
)
from bufferstand.model.identification.held_out import HeldOut, cross_validate
from bufferstand.model.identification.known_parameters import uncertainty_of
from bufferstand.model.identification.laws import LAWS, NAMES
from bufferstand.model.identification.parameters import FixedParts, curves_of, model_of
from bufferstand.model.identification.problem import Experiment, Problem
from bufferstand.model.identification.starting import knots_of, start_vector
from bufferstand.model.identification.validation import CycleCheck, check_cycles, quality
from bufferstand.model.identified_range import IdentifiedRange
from bufferstand.model.spring import SpringModel

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPECTRUM = "spectrum_per_decade"
_TOLD_FROM_NONE = 2.0
"""Standard deviations by which b must exceed 0."""
_LEAST_GAIN = 2.0
"""Logarithm of the likelihood of the held-out cycles that the spectrum must gain, over effective samples."""
_ALWAYS_FREE = ("transition_length_mm",)
_TOGETHER = {"beta": ("tau_s",), "sensitivity_per_K": ("depth_mm",)}
_CHECKS = 3


@dataclass(frozen=True)
class FitSettings:
    """What the user decides.

    Parameters
    ----------
    knots : int, optional
        Number of knots of the curves; one every 5 mm if not given.
    reference_C : float, optional
        T_ref; 25 °C if the runs were that warm at some time, else the middle of their temperatures.
    contact_ramp_mm : float
        Stroke over which the preload builds up; forces below twice this stroke are not used.
    without : tuple of str
        Parameters that are not to be identified.
    hold_out : bool
        Cross-validate on held-out cycles (one more fit).
    full_stroke_mm : float, optional
        The specimen's own stroke, to which the curves are continued; without it they end with the runs.
    catalogue_points : tuple of (float, float)
        Stroke [mm] and force [kN] of the maker's loading curve; those beyond the runs are taken.
    catalogue_margin : float
        Factor by which the maker's curve and the spring may differ.
    stop_stiffness_kN_per_mm : float, optional
        Of the stop beyond the curves; the model file's default is assumed if not given.
    name, sense, origin : str
        For the model file.
    """

    knots: int | None = None
    reference_C: float | None = None
    contact_ramp_mm: float = 0.2
    without: tuple[str, ...] = ()
    hold_out: bool = True
    full_stroke_mm: float | None = None
    catalogue_points: tuple[tuple[float, float], ...] = ()
    catalogue_margin: float = 1.15
    stop_stiffness_kN_per_mm: float | None = None
    name: str = "identified spring"
    sense: str = "compression"
    origin: str = ""


@dataclass(frozen=True)
class Unknown:
    """A parameter that the runs do not identify, why, and what stands in its place."""

    name: str
    why: str
    value: float
    unit: str
    on_request: bool = False
    fitted: bool = False
    """Whether the value was fitted along with the others, instead of assumed."""


@dataclass(frozen=True, eq=False)
class Identification:
    """What came of it.

    Attributes
    ----------
    model : SpringModel
    solution : Solution
    estimates : tuple of Estimate
        Laws' parameters, then the curves at the knots.
    unknown : tuple of Unknown
    facts : RunFacts
        What the runs cover.
    cycles : tuple of CycleCheck
        Every cycle against the model that was fitted to all of them.
    held_out : tuple of CycleCheck
        Cycles against a model that did not see them; empty if there were too few.
    notes : tuple of str
        What must be known of the result.
    """

    model: SpringModel
    solution: Solution
    estimates: tuple[Estimate, ...]
    unknown: tuple[Unknown, ...]
    facts: CoverageFacts
    cycles: tuple[CycleCheck, ...]
    held_out: tuple[CycleCheck, ...]
    notes: tuple[str, ...]


def experiment_of(drive: Drive, *, contact_ramp_mm: float = 0.2, sensor_sigma_C: float = 0.05) -> Experiment:
    """Return a drive as an experiment: which forces count, and whether the spring had rested before.

    Forces below twice the contact ramp do not count (they tell of the plate, not of the spring), nor those
    of the first cycle of a record that begins under load: the spring's state is not known there. A drive that
    has a rest of its own before (``drive.rested``) starts with one temperature for mass and sensor.
    """
    stroke = drive.stroke_mm[drive.node]
    used = stroke > 2.0 * contact_ramp_mm + 0.1
    if drive.stroke_mm[0] > 1.0:
        used &= drive.half[drive.node] >= 2
    return Experiment(drive, drive.rested, used, sensor_sigma_C)


def identify(drives: Sequence[Drive], settings: FitSettings | None = None) -> Identification:
    """Identify a spring model from drives.

    Parameters
    ----------
    drives : sequence of Drive
        Independent of each other: each begins with a temperature of its own. Runs in a row are joined first
        (:func:`bufferstand.model.identification.drive.join`), so that their cooling counts too.
    settings : Settings, optional

    Returns
    -------
    Identification

    Raises
    ------
    BadInput
        If the runs cannot be used at all; the message says why.
    """
    how = settings or FitSettings()
    for name in how.without:
        if name not in NAMES:
            raise BadInput(f"there is no parameter “{name}”", remedy=f"use one of {', '.join(NAMES)}")
    experiments = [experiment_of(drive, contact_ramp_mm=how.contact_ramp_mm) for drive in drives]
    frame = _frame(drives, how)
    problem = Problem(frame, experiments)
    vector = problem.start(start_vector(frame, drives))
    rich = _fit(problem, vector, how.without)
    solution, held_out, why = _spectrum_chosen(problem, vector, rich, how)
    return _result(solution, held_out.checks, how, why)


def _frame(drives: Sequence[Drive], how: FitSettings) -> FixedParts:
    readings = np.concatenate([drive.sensor_C for drive in drives])
    if readings.size == 0:
        readings = np.array([drive.ambient_C for drive in drives])
    low, high = float(readings.min()), float(readings.max())
    reference = how.reference_C
    if reference is None:
        reference = 25.0 if low - 0.5 <= 25.0 <= high + 0.5 else round(0.5 * (low + high), 1)
    stop = how.stop_stiffness_kN_per_mm
    return FixedParts(
        knots_mm=knots_of(drives, how.knots),
        reference_C=reference,
        contact_ramp_mm=how.contact_ramp_mm,
        stop_stiffness_kN_per_mm=Curves.stop_stiffness_kN_per_mm if stop is None else stop,
        name=how.name,
        sense="extension" if how.sense == "extension" else "compression",
        origin=how.origin,
    )


def _fit(problem: Problem, vector: Floats, without: Sequence[str]) -> Solution:
    """Fit, and take out what the runs do not say, until nothing changes."""
    asked = set(without)
    begun, free = freeze(problem, vector, sorted(asked))
    first = problem.reweighted(problem.residuals(begun), 1.0)
    out = asked | _unknown(first, begun, free)
    start = vector
    tried = {frozenset(out)}
    while True:
        frozen, free = freeze(problem, start, sorted(out))
        solution = solve(problem, frozen, free)
        # What was hidden by a poor start may show now, so all are looked at again, from their usual values.
        start = np.where(free, solution.vector, vector)
        _, every = freeze(problem, start, sorted(asked))
        now = asked | _unknown(solution.problem, start, every, solution.correlation)
        if frozenset(now) in tried or len(tried) >= _CHECKS:
            still = _unknown(solution.problem, solution.vector, free, solution.correlation)
            if not still:
                return solution
            now = out | still
        out = now
        tried.add(frozenset(out))


def _unknown(problem: Problem, vector: Floats, free: Mask, correlation: float = 1.0) -> set[str]:
    """Return the names of the laws' parameters that are free and not identified."""
    known = identified(problem, vector, free, correlation)
    names = {
        law.name
        for law in LAWS
        if free[problem.frame.place(law.name)] and not known[problem.frame.place(law.name)]
    }
    for name, others in _TOGETHER.items():
        if name in names or vector[problem.frame.place(name)] <= 0.0:
            names |= {other for other in others if free[problem.frame.place(other)]}
    return names - set(_ALWAYS_FREE) if problem.experiments else names


def _spectrum_chosen(
    problem: Problem, vector: Floats, solution: Solution, how: FitSettings
) -> tuple[Solution, HeldOut, dict[str, str]]:
    """Keep the flat spectrum only if it is told from none, and held-out cycles are the better for it.

    Returns the fit that is kept, its held-out cycles, and why the spectrum was left out, if it was.
    """
    validate = cross_validate if how.hold_out else _not_validated
    at = problem.frame.place(SPECTRUM)
    if not solution.free[at]:
        return solution, validate(solution), {}
    b = float(solution.vector[at])
    place = int(np.count_nonzero(solution.free[:at]))
    sigma = float(np.sqrt(solution.covariance[place, place]))
    found = f"b = {b:.2g} ± {COVERAGE * sigma:.1g} per decade"
    start = np.where(solution.free, solution.vector, vector)
    if b < _TOLD_FROM_NONE * sigma:
        plain = _fit(problem, start, (*how.without, SPECTRUM))
        return plain, validate(plain), {SPECTRUM: f"{found} is not told from none"}
    rich = validate(solution)
    if not rich.count:
        return solution, rich, {}
    plain = _fit(problem, start, (*how.without, SPECTRUM))
    poor = validate(plain, solution)
    samples = rich.count / max(solution.correlation, plain.correlation)
    gain = 0.5 * samples * math.log(poor.square / rich.square)
    if gain >= _LEAST_GAIN:
        return solution, rich, {}
    return plain, poor, {SPECTRUM: f"cycles held out are foretold no better with {found} than with none"}


def _not_validated(_: Solution, __: Solution | None = None) -> HeldOut:
    return HeldOut()


def _result(
    solution: Solution, held_out: tuple[CycleCheck, ...], how: FitSettings, why: dict[str, str]
) -> Identification:
    problem, vector = solution.problem, solution.vector
    answers = problem.answers(vector)
    facts = facts_of(problem, answers)
    untold = without_contrast(facts)
    unknown = _unknowns(solution, facts, how, why, untold)
    coldest, warmest = facts.temperature_C
    valid_C = (math.floor(10.0 * coldest) / 10.0, math.ceil(10.0 * warmest) / 10.0)
    longer = _continued(solution, how)
    curves = curves_of(problem.frame, vector) if longer is None else longer.curves
    identified_in = _range(facts, problem.frame, longer, how)
    model = replace(
        model_of(problem.frame, vector, curves, valid_C, identified_in),
        fit=uncertainty_of(solution, held_out),
    )
    checks = tuple(
        check
        for experiment, given in zip(problem.experiments, answers, strict=True)
        for check in check_cycles(experiment, given)
    )
    notes = [*quality(solution, checks), *model.warnings(*facts.temperature_C), *model.statements[1:]]
    if how.full_stroke_mm is None:
        notes.append(
            "no run states the specimen's full stroke (max_stroke_mm): the curves end at "
            f"{curves.end_mm:.4g} mm, where the runs end, and the stop stands there"
        )
    found = estimates(solution, untold)
    notes += [
        f"{e.name} lies at the end of what was allowed ({abs(round(e.value, 9)):.4g} {e.unit})"
        for e in found
        if e.at_bound and e.identified
    ]
    return Identification(model, solution, tuple(found), unknown, facts, checks, held_out, tuple(notes))


def _unknowns(
    solution: Solution, facts: CoverageFacts, how: FitSettings, why: dict[str, str], untold: set[str]
) -> tuple[Unknown, ...]:
    """Return what the runs do not tell: parameters left out of the fit, or fitted along without contrast."""
    frame = solution.problem.frame
    found = []
    for law in LAWS:
        at = frame.place(law.name)
        fitted = bool(solution.free[at])
        if fitted and law.name not in untold:
            continue
        asked = law.name in how.without
        told = "it was left out on request" if asked else why.get(law.name) or reason(law.name, facts)
        value = law.to_value(float(solution.vector[at]))
        found.append(Unknown(law.name, told, value, law.unit, asked, fitted))
    return tuple(found)


def _continued(solution: Solution, how: FitSettings) -> Continued | None:
    """Return the curves to the specimen's full stroke, if that is known and the runs end before it."""
    if how.full_stroke_mm is None:
        return None
    curves = curves_of(solution.problem.frame, solution.vector)
    _, (deviation, _) = curve_spread(solution)
    return continued(curves, deviation, how.full_stroke_mm, how.catalogue_points, how.catalogue_margin)


def _range(
    facts: CoverageFacts, frame: FixedParts, longer: Continued | None, how: FitSettings
) -> IdentifiedRange:
    """Return where the model was identified; speeds and frequencies rounded outwards to two digits."""
    return IdentifiedRange(
        stroke_mm=(frame.knots_mm[0], frame.knots_mm[-1]),
        speed_mm_per_s=(
            _outwards(facts.speed_mm_per_s[0], math.floor),
            _outwards(facts.peak_speed_mm_per_s, math.ceil),
        ),
        frequency_Hz=(
            _outwards(facts.frequency_Hz[0], math.floor),
            _outwards(facts.frequency_Hz[1], math.ceil),
        ),
        continuation=None if longer is None else longer.kind,
        loading_at_end_kN=None if longer is None else longer.loading_at_end_kN,
        stop="assumed" if how.stop_stiffness_kN_per_mm is None else "given",
    )


def _outwards(value: float, rounded: Callable[[float], int]) -> float:
    digits = 1 - math.floor(math.log10(value))
    return round(rounded(value * 10.0**digits) / 10.0**digits, max(digits, 0))
