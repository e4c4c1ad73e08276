"""Evaluates one run, from its record to its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from bufferstand.evaluation.facts import (
    CycleResult,
    DrawWires,
    Extreme,
    Measured,
    Options,
    RequirementResult,
    RunEvaluation,
    RunFacts,
    SharedErrors,
    StepResult,
    held_against,
    not_whole,
)
from bufferstand.evaluation.gaps import CyclesOfRecord, found_in
from bufferstand.evaluation.loading import condensed_for
from bufferstand.evaluation.numerics import FloatArray, Sampling
from bufferstand.evaluation.plausibility import SpoiledFigures, doubted, look_for_implausible, without_claims
from bufferstand.evaluation.plausibility.invalid_samples import without_codes, without_spikes
from bufferstand.evaluation.plausibility.jumps import slips_s
from bufferstand.evaluation.plausibility.run_view import Channels, RunView
from bufferstand.evaluation.plausibility.signal_comparison import check_wires, doubted_signals
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.requirements import (
    Case,
    JudgedPart,
    LimitSet,
    assumptions,
    has_limits_of_its_own,
    inspection_of,
    is_judged,
    judge_quantities,
    judge_with_contact,
    run_verdict,
    shipped_limit_set,
    why_not_judged,
)
from bufferstand.evaluation.run.cycle_warnings import cycle_warnings, notes_of, numbered
from bufferstand.evaluation.run.extremes import Recorded, extreme_warnings, run_extremes, step_extremes
from bufferstand.evaluation.run.first_contact import contact_warnings, first_contact_of
from bufferstand.evaluation.run.garbage_collection import collecting_later
from bufferstand.evaluation.run.history import history_of
from bufferstand.evaluation.run.missing_values import missing_warnings, temperature_warnings
from bufferstand.evaluation.run.steps import (
    Division,
    EvaluatedCycles,
    StepFigures,
    division_without,
    sum_up,
    summed_without_claims,
    unfit_warnings,
    with_settling,
)
from bufferstand.evaluation.uncertainty import (
    Draws,
    MeanOfDraws,
    Noise,
    Regression,
    draw_errors,
    drum_periods_mm,
    missing_facts,
    noisy_speed_warnings,
    record_noise,
    with_uncertainty,
)

_PLAN_TOLERANCE = {"prestress_mm": (0.1, 5.0), "amplitude_mm": (0.1, 1.0), "frequency_Hz": (0.05, 0.0)}
"""Share of the planned figure, and least difference, by which a run may miss its step without a word."""
_ASKED_TOLERANCE = {"prestress_mm": (0.0, 0.3), "amplitude_mm": (0.01, 0.1), "frequency_Hz": (0.05, 0.0)}
"""The same where the specimen's stroke was asked for (``compensate``), not the piston's."""
_NOT_DRAWN = "no expanded uncertainties: the evaluation was asked for none (0 draws)"


def evaluate_run(
    record: Record,
    facts: RunFacts,
    options: Options | None = None,
    limit_set: LimitSet | None = None,
) -> RunEvaluation:
    """Evaluate one run.

    Parameters
    ----------
    record : Record
        Stroke and force on common instants (:func:`bufferstand.evaluation.record.record.make_record`).
    facts : RunFacts
        Kind, specimen and uncertainty of the channels.
    options : Options, optional
        Decision rule, Monte Carlo draws and seed.
    limit_set : LimitSet, optional
        Limits to judge static, impact and proof runs by; the shipped EN 15551 set for 105 mm by default.

    Returns
    -------
    RunEvaluation
        The same inputs give the same figures to the last bit.
    """
    with collecting_later():
        return _evaluated(record, facts, options or Options(), limit_set or shipped_limit_set())


def _evaluated(record: Record, facts: RunFacts, options: Options, limits: LimitSet) -> RunEvaluation:
    seen, coded = without_codes(Channels(record))
    seen, calm, facts, wires = _looked_at(seen, facts)
    samples = seen.record
    record, turns, coarse = condensed_for(_without_readings(calm), facts.kind, _known_sampling(seen, calm))
    interval_s = limits.conditions.reading_interval_max_s

    def look_at(found: CyclesOfRecord) -> RunView:
        return RunView(samples, found.record, found.results, facts, wires, seen, coded)

    find = partial(found_in, record, turns, (facts.moving_mass, options.moving_mass), interval_s)
    found = with_settling(_found_without_slips(find, look_at), facts.stroke_events)
    record, results, prepared, added = found.record, found.results, found.prepared, found.added

    draws = _drawn_errors(facts, options, found)
    spoiled = _spoiled(look_at(found))
    division = division_without(facts.kind, results, numbered, spoiled)
    stand_for = [part.used for part in division.parts] or [_all_complete(results, spoiled)]
    tallies = [MeanOfDraws() for _ in stand_for]
    regression: Regression | None = None
    drawn: Mapping[int, Mapping[str, FloatArray]] = {}
    if draws is not None:
        regression = Regression(facts.chain, draws) if facts.chain is not None else None
        parts = list(zip(stand_for, tallies, strict=True))
        results, drawn = with_uncertainty(
            results, prepared, draws, parts, record.temperatures, keep=is_judged(facts, limits)
        )
    results = without_claims(results, spoiled)
    complete = tuple(r for r in results if r.cycle.complete)
    warnings = [*facts.problems, *coarse, *(wires.warnings if wires else ()), *found.warnings]
    warnings += spoiled.warnings(numbered)
    warnings += _record_warnings(record, facts, results, division)
    if samples.time_s.size:
        warnings += _missing_facts(facts) if options.draws else [_NOT_DRAWN]
    warnings += [
        *cycle_warnings(results),
        *(noisy_speed_warnings(record, results) if draws is None and options.draws else ()),
    ]

    whole = sum_up(
        EvaluatedCycles(
            record, facts, results, found.loops, prepared, tallies, regression, bool(options.draws), added
        ),
        division,
    )
    whole = summed_without_claims(whole, spoiled, [r.cycle.index for r in complete])
    warnings += unfit_warnings(whole)
    warnings += _off_plan(facts, whole)
    contact = first_contact_of(record, facts, results, spoiled.findings)
    requirements: list[RequirementResult] = []
    inspection = inspection_of(facts, options.inspections)
    if unfit := why_not_judged(facts, limits):
        warnings.append(f"nothing is judged: {unfit}")
    elif is_judged(facts, limits):
        warnings += assumptions(facts, limits)
        case = Case(
            record,
            facts,
            complete,
            prepared,
            draws,
            drawn,
            limits,
            options,
            inspection,
            tuple(results),
            found.numbering,
            found.reread,
            regression,
            spoiled=spoiled,
            holes=found.holes,
        )
        requirements = judge_with_contact(case, contact)
    warnings += [
        *contact_warnings(contact, requirements),
        *temperature_warnings(results, record.temperatures, numbered),
    ]
    inertial = None if added is None else (record.time_s, added.added_kN)
    noise = None if draws is None else _noise_of_samples(samples, found)
    recorded = Recorded(samples, record, inertial, wires, facts.speed_uncertainty, noise)
    extremes = doubted(run_extremes(recorded, results, draws), spoiled)
    warnings += extreme_warnings(extremes, warnings, spoiled.findings, drawn=draws is not None)
    steps = [
        replace(one, extremes=doubted(step_extremes(recorded, one, results, draws), spoiled))
        for one in whole.steps
    ]
    requirements += _of_quantities(facts, limits, options, whole, steps, extremes, spoiled)
    warnings += missing_warnings(results, whole, requirements, wires, numbered)
    return RunEvaluation(
        facts=facts,
        record=record,
        cycles=tuple(results),
        summary=whole.summary,
        requirements=tuple(requirements),
        verdict=run_verdict(requirements),
        warnings=tuple(dict.fromkeys(warnings)),
        notes=notes_of(
            tuple(dict.fromkeys(warnings)),
            facts,
            results,
            requirements,
            [*found.notes, *cycle_warnings(found.slightly_bridged)],
        ),
        limit_set=limits.identity() if requirements else None,
        inspection=inspection.record() if inspection and requirements else None,
        budget=whole.budget,
        skew_sensitivity=whole.skew_sensitivity,
        draw_wires=wires,
        inertia_correction=found.inertia,
        mean_loop=whole.mean_loop,
        steps=tuple(steps),
        first_contact=contact,
        shared_errors=_with_judged(whole.shared_errors, requirements),
        extremes=extremes,
        preload=_preload(requirements),
        history=history_of(
            record,
            facts,
            results,
            steps,
            tallies,
            None if draws is None else found.prepared.noise,
            asked=options.draws > 0,
        ),
        findings=spoiled.findings,
        unfit=whole.unfit,
    )


def _of_quantities(
    facts: RunFacts,
    limits: LimitSet,
    options: Options,
    whole: StepFigures,
    steps: Sequence[StepResult],
    extremes: Mapping[str, Extreme],
    spoiled: SpoiledFigures,
) -> list[RequirementResult]:
    """Return the rows of the limit set's ``[[requirement]]``, of the run or of each of its steps."""
    if not has_limits_of_its_own(facts, limits):
        return []
    parts = [JudgedPart(f"step {one.index}", one.summary, one.extremes) for one in steps]
    parts = parts or [JudgedPart("", whole.summary, extremes)]
    return judge_quantities(limits, facts, parts, options.decision_rule, spoiled.spoiling)


def _found_without_slips(
    find: Callable[..., CyclesOfRecord], look_at: Callable[[CyclesOfRecord], RunView]
) -> CyclesOfRecord:
    """Find the cycles; where the stroke jumps against its motion, once more without the turns that makes."""
    found = find()
    slipped_s = slips_s(look_at(found))
    return find(slips_s=slipped_s) if slipped_s else found


def _spoiled(look: RunView) -> SpoiledFigures:
    return SpoiledFigures(tuple(doubted_signals(look, look_for_implausible(look))))


def _looked_at(seen: Channels, facts: RunFacts) -> tuple[Channels, Record, RunFacts, DrawWires | None]:
    """Return the channels as recorded, the record without their spikes, and what its draw wires say.

    Where a draw wire is out, the channels are those of the other one, without spikes.
    """
    calm, facts, wires = check_wires(without_spikes(seen), facts)
    calm = _with_stated(calm, facts)
    if wires is not None and wires.out:
        seen = Channels(calm)
    return seen, calm, facts, wires


def _known_sampling(seen: Channels, record: Record) -> Sampling | None:
    """Return how the stroke of a record came about, where it is the one that was seen."""
    return seen.stroke.sampling if seen.stroke.value is record.stroke_mm else None


def _without_readings(record: Record) -> Record:
    """Return a record without the readings as recorded, which must not stay in memory with every result."""
    return replace(record, as_recorded={}, signals=None) if record.as_recorded or record.signals else record


def _all_complete(results: Sequence[CycleResult], spoiled: SpoiledFigures) -> tuple[int, ...]:
    """Return what stands for the run in comparisons where no cycle is steady: all complete cycles."""
    complete = tuple(r.cycle.index for r in results if r.cycle.complete)
    return tuple(number for number in complete if number not in spoiled.cycles) or complete


def _drawn_errors(facts: RunFacts, options: Options, found: CyclesOfRecord) -> Draws | None:
    """Return the errors of the channels, drawn; None where none are asked for or stated."""
    stated = (facts.force_uncertainty, facts.stroke_uncertainty)
    if not options.draws or facts.force_uncertainty is None or not facts.stroke_uncertainty:
        return None  # spares the search for noise, hum and drift, too
    return draw_errors(*stated, options.draws, options.seed, found.added, found.prepared.own)


def _missing_facts(facts: RunFacts) -> list[str]:
    return missing_facts(facts.force_uncertainty, facts.stroke_uncertainty)


def _noise_of_samples(samples: Record, found: CyclesOfRecord) -> Noise:
    """Return the noise of every sample: means of some, which the cycles are found in, have less of it."""
    if samples.time_s.size == found.record.time_s.size:
        return found.prepared.noise
    return record_noise(samples, None, [r.cycle for r in found.results if r.cycle.complete])


def _with_stated(samples: Record, facts: RunFacts) -> Record:
    """Return the record with what its channels state that changes along it: drums, and a drifting zero."""
    drums_mm, force = drum_periods_mm(facts.stroke_uncertainty), facts.force_uncertainty
    drift_kN = (force.drift if force is not None else None) or 0.0
    return replace(samples, drums_mm=drums_mm, drift_kN=drift_kN) if drums_mm or drift_kN else samples


def _with_judged(
    shared: SharedErrors | None, requirements: Sequence[RequirementResult]
) -> SharedErrors | None:
    """Return the shared errors with those of what was judged: by id of the requirement, mean over cycles."""
    if shared is None:
        return None
    found = dict(shared.contributions)
    for identity in dict.fromkeys(row.id for row in requirements if row.shared):
        rows = [row.shared for row in requirements if row.id == identity and row.shared]
        found[identity] = tuple(sum(column) / len(rows) for column in zip(*rows, strict=True))
    return replace(shared, contributions=found)


def _preload(requirements: Sequence[RequirementResult]) -> Measured | None:
    """Return the mean of the preloads; its U is the mean of theirs, as errors of the channels are common."""
    rows = [(row.measured, row.expanded_uncertainty) for row in requirements if row.id == "preload"]
    known = [measured for measured, _ in rows if measured is not None]
    stated = [U for _, U in rows if U is not None]
    if not known or len(known) < len(rows):
        return None
    mean = sum(known) / len(known)
    return Measured(mean, sum(stated) / len(stated) if len(stated) == len(rows) else None)


def _record_warnings(
    record: Record, facts: RunFacts, results: Sequence[CycleResult], division: Division
) -> list[str]:
    warnings = []
    if not results:
        warnings.append("no cycle found: the stroke does not turn, or moves no more than its noise")
    elif not division.parts and not division.why:
        warnings.append("no summary: no cycle is complete and steady")
    elif division.several:
        each = "; ".join(f"{n}: {numbered(part.cycles)}" for n, part in enumerate(division.parts, 1))
        text = f"it has {len(division.parts)} steps, each with a summary of its own ({each})"
        warnings.append(f"no summary of the run: {text}")
    warnings += division.why
    if facts.status not in ("complete", "imported"):
        warnings.append(not_whole(facts.status))
    if facts.kind == "impact":
        warnings += _unstated_impact(facts)
    if not any(sensor.role == "specimen" for sensor in record.temperatures):
        warnings.append("no temperature: no sensor on the specimen is on record")
    return warnings


def _unstated_impact(facts: RunFacts) -> list[str]:
    """Return what the laboratory does not state of an impact, and what follows."""
    stated = {"impact_speed_km_h": facts.impact_speed_km_h, "impact_mass_t": facts.impact_mass_t}
    missing = [name for name, value in stated.items() if value is None]
    if not missing:
        return []
    text = f"not on record: {' and '.join(missing)} ([test] of the specimen file)"
    if facts.impact_speed_km_h is None:
        text += "; whether the impact is one that the category counts for is not judged"
    return [text]


def _off_plan(facts: RunFacts, whole: StepFigures) -> list[str]:
    """Return a warning for every figure in which a harmonic run is not the step that was planned.

    Where the piston's stroke was asked for, the specimen is compared with what the plan expected of it.
    """
    if facts.kind != "harmonic":
        return []
    tolerance = _ASKED_TOLERANCE if facts.step.get("compensate") is True else _PLAN_TOLERANCE
    summaries = {f"step {step.index} of ": step.summary for step in whole.steps} or {"": whole.summary}
    warnings = []
    for part, summary in summaries.items():
        for name, (share, least) in tolerance.items():
            planned, measured = held_against(facts.step, name), summary.values[name].value
            if planned is None or measured is None:
                continue
            if abs(measured - planned.value) > max(share * abs(planned.value), least):
                text = f"{part}the run is not its step: {name} is {measured:.4g}"
                text += f", planned was {planned.value:.4g}"
                if planned.of_piston is not None:
                    text += f" of the specimen for {planned.of_piston:.4g} of the piston"
                warnings.append(text)
    return warnings
