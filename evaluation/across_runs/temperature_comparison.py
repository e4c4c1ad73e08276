"""Runs of the same step at different temperature, compared at equal stroke (paper, Fig. 9).

Temperature is a condition, not a correction: what it changes is stated, nothing is converted by it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.across_runs.combine import Figures, RunFigure
from bufferstand.evaluation.across_runs.grouping import grouped, specimen_of
from bufferstand.evaluation.across_runs.run_means import assumption, basis_of
from bufferstand.evaluation.facts import MeanLoop, RunEvaluation, SharedContributions
from bufferstand.evaluation.quantities import is_two_sided

LEAST_DIFFERENCE_K = 5.0
"""Runs are compared when their temperatures differ by more than this."""
SAME_STROKE_MM = 2.0
"""Same step: lower turning points (static), prestress (harmonic) within this …"""
SAME_AMPLITUDE = 0.05
"""… amplitude within this share, or 0.5 mm …"""
SAME_FREQUENCY = 0.05
"""… frequency within this share …"""
SAME_SPEED = 0.2
"""… loading speed of static runs within this share."""
LEAST_COMMON_SHARE = 0.2
"""Loops with less than this share of the larger range in common are not compared."""
_STEP = 0.02
"""Share of a loop's range over which it is asked how its area grows with the place of its turn."""
_COVERAGE = 2.0
_SQRT3 = float(np.sqrt(3.0))

FIGURES = ("end_force_kN", "stored_energy_J", "absorbed_energy_J", "damping")


@dataclass(frozen=True)
class ChangeByTemperature:
    """A figure at equal stroke in both runs: what temperature made of it.

    ``relative_change`` = value / reference - 1; errors that both runs have in common cancel in it
    (:mod:`bufferstand.evaluation.across_runs`), those of the thermometers do not.
    """

    reference: float | None
    value: float | None
    relative_change: float | None = None
    expanded_uncertainty: float | None = None
    relative_change_per_K: float | None = None
    expanded_uncertainty_per_K: float | None = None
    half_width_95: float | None = None
    """Half-width that holds 95 % of the relative change."""


@dataclass(frozen=True)
class RunAtTemperature:
    """A run as recorded: temperature at the start of its cycles, and its own end of stroke."""

    run: str
    temperature_C: float
    end_stroke_mm: float
    end_force_kN: float
    damping: float | None


@dataclass(frozen=True)
class WarmerRun(RunAtTemperature):
    """A warmer run, and its changes against the reference between ``from_mm`` and ``to_mm``.

    A loop that reaches further is cut there, and its turn moved to the cut.
    """

    from_mm: float
    to_mm: float
    changes: Mapping[str, ChangeByTemperature]


@dataclass(frozen=True)
class TemperatureComparison:
    """Runs of one specimen and step; the coldest is the reference."""

    specimen: str
    step: Mapping[str, float | str]
    reference: RunAtTemperature
    runs: tuple[WarmerRun, ...]
    warnings: tuple[str, ...] = ()


def compare_temperatures(runs: Sequence[RunEvaluation]) -> tuple[TemperatureComparison, ...]:
    """Return a comparison for every group of runs of one specimen and step at different temperature.

    Parameters
    ----------
    runs : sequence of RunEvaluation
        Static and harmonic ones with a mean loop and a temperature count.

    Returns
    -------
    tuple of TemperatureComparison
    """
    usable = [
        r
        for r in runs
        if r.facts.kind in ("static", "harmonic") and _start_temperature(r.mean_loop) is not None
    ]
    found = []
    for group in grouped(usable, _same_step):
        ordered = sorted(group, key=_temperature)
        reference = ordered[0]
        warmer = [r for r in ordered if _temperature(r) - _temperature(reference) > LEAST_DIFFERENCE_K]
        compared = [w for r in warmer if (w := _against(reference, r)) is not None]
        if compared:
            found.append(_comparison(reference, compared, assumption(basis_of(group))))
    return tuple(found)


def _comparison(
    reference: RunEvaluation, compared: Sequence[WarmerRun], assumed: Sequence[str]
) -> TemperatureComparison:
    loop = _loop(reference)
    warnings = []
    if any(run.changes["damping"].value is None for run in compared):
        warnings.append("no damping compared: it is not meaningful for two-sided loops")
    changes = [(name, change) for run in compared for name, change in run.changes.items()]
    missing = [n for n, c in changes if c.relative_change is not None and c.expanded_uncertainty is None]
    if missing:
        names = ", ".join(dict.fromkeys(missing))
        warnings.append(f"no expanded uncertainty of {names}: a run compared has none itself")
    per_K = [n for n, c in changes if c.relative_change is not None and c.expanded_uncertainty_per_K is None]
    if set(per_K) - set(missing):
        warnings.append("no expanded uncertainty per kelvin: the sensors state no accuracy")
    if not missing:
        warnings += assumed
    means = loop.means
    step: dict[str, float | str] = {"kind": reference.facts.kind}
    harmonic = reference.facts.kind == "harmonic"
    same = ("prestress_mm", "amplitude_mm", "frequency_Hz") if harmonic else ("speed_loading_max_mm_per_s",)
    step.update({name: means[name] for name in same if name in means})
    return TemperatureComparison(
        specimen=_specimen(reference),
        step=step,
        reference=_as_recorded(reference),
        runs=tuple(compared),
        warnings=tuple(warnings),
    )


def _specimen(run: RunEvaluation) -> str:
    return str(run.facts.specimen.get("id", ""))


def _loop(run: RunEvaluation) -> MeanLoop:
    assert run.mean_loop is not None
    return run.mean_loop


def _start_temperature(loop: MeanLoop | None) -> float | None:
    return None if loop is None else loop.temperature_C


def _temperature(run: RunEvaluation) -> float:
    value = _start_temperature(run.mean_loop)
    return float("nan") if value is None else value


def _same_step(one: RunEvaluation, two: RunEvaluation) -> bool:
    if one.facts.kind != two.facts.kind or specimen_of(one) != specimen_of(two):
        return False
    a, b = _loop(one).means, _loop(two).means

    def within(name: str, share: float, least: float) -> bool:
        if name not in a or name not in b:
            return False
        return abs(a[name] - b[name]) <= max(share * max(abs(a[name]), abs(b[name])), least)

    if one.facts.kind == "static":
        return within("stroke_min_mm", 0.0, SAME_STROKE_MM) and within(
            "speed_loading_max_mm_per_s", SAME_SPEED, 0.0
        )
    return (
        within("prestress_mm", 0.0, SAME_STROKE_MM)
        and within("amplitude_mm", SAME_AMPLITUDE, 0.5)
        and within("frequency_Hz", SAME_FREQUENCY, 0.0)
    )


def _as_recorded(run: RunEvaluation) -> RunAtTemperature:
    loop = _loop(run)
    return RunAtTemperature(
        run=run.facts.id,
        temperature_C=_temperature(run),
        end_stroke_mm=float(loop.stroke_mm[-1]),
        end_force_kN=loop.end_force_kN,
        damping=None if _two_sided(loop) else loop.means.get("damping"),
    )


def _two_sided(loop: MeanLoop) -> bool:
    lowest = float(min(np.min(loop.loading_kN), np.min(loop.unloading_kN)))
    return is_two_sided(lowest, float(np.max(loop.loading_kN)))


def _against(reference: RunEvaluation, warm: RunEvaluation) -> WarmerRun | None:
    """Compare a warmer run with the reference over their common stroke; None where that is too little."""
    cold_loop, warm_loop = _loop(reference), _loop(warm)
    first = max(float(cold_loop.stroke_mm[0]), float(warm_loop.stroke_mm[0]))
    last = min(float(cold_loop.stroke_mm[-1]), float(warm_loop.stroke_mm[-1]))
    widest = max(float(np.ptp(loop.stroke_mm)) for loop in (cold_loop, warm_loop))
    if last - first < LEAST_COMMON_SHARE * widest:
        return None
    cold, hot = cold_loop.cut(first, last), warm_loop.cut(first, last)
    values = [_figures(cold), _figures(hot)]
    apart_K = _temperature(warm) - _temperature(reference)
    u_apart_K = _difference_uncertainty_K(cold_loop, warm_loop)
    changes = {}
    for name in FIGURES:
        before, after = values[0][name], values[1][name]
        relative = [
            _relative(run, loop, name, value)
            for run, loop, value in ((reference, cold, before), (warm, hot, after))
        ]
        changes[name] = _change(before, after, relative, apart_K, u_apart_K)
    recorded = _as_recorded(warm)
    return WarmerRun(**vars(recorded), from_mm=first, to_mm=last, changes=changes)


def _figures(loop: MeanLoop) -> dict[str, float | None]:
    stored, absorbed = loop.stored_energy_J, loop.absorbed_energy_J
    meaningful = stored > 0.0 and not _two_sided(loop)
    return {
        "end_force_kN": loop.end_force_kN,
        "stored_energy_J": stored,
        "absorbed_energy_J": absorbed,
        "damping": absorbed / stored if meaningful else None,
    }


def _relative(run: RunEvaluation, loop: MeanLoop, name: str, value: float | None) -> RunFigure | None:
    """Return a figure at equal stroke as a share of itself, 1 ± u: that of the run's whole loop.

    Of the end force: that of the largest force, and of the stroke times the slope there. Whatever the
    turning points of both loops were read as, both are cut at the same stroke: force and stored energy are
    those of their branches there, and the errors of the turning points leave them. But the turn of a loop is
    moved by what lies between its own and the cut: a wrong one leaves so much more or less of the area.
    """
    if value is None or value == 0.0:
        return None
    whole = _loop(run)
    top = _share(run, loop, "stroke_max_mm", whole.means.get("stroke_max_mm", 0.0))  # in mm
    low = _share(run, loop, "stroke_min_mm", whole.means.get("stroke_min_mm", 0.0))
    top_mm, low_mm = (0.0 if one is None else one.own_u for one in (top, low))
    if name == "end_force_kN":
        return _end_force(run, loop, value, top)
    figure = _share(run, loop, name, 1.0)
    absorbed = _share(run, loop, "absorbed_energy_J", 1.0)
    if figure is None or absorbed is None:
        return None
    own = figure.own_u
    if name != "absorbed_energy_J":  # the area of the loop has no error of the turning points
        turns_J = np.hypot(whole.end_force_kN * top_mm, float(whole.loading_kN[0]) * low_mm)
        stored_J = whole.means.get("stored_energy_J", whole.stored_energy_J)
        noise = absorbed.own_u * (whole.means["absorbed_energy_J"] / stored_J if name != "damping" else 1.0)
        own = max(abs(noise), _less(own, float(turns_J) / stored_J))
    if name != "stored_energy_J":
        own = float(np.hypot(own, _per_mm(loop) * top_mm))
    return _with_own(figure, own)


def _end_force(run: RunEvaluation, loop: MeanLoop, value: float, top: RunFigure | None) -> RunFigure | None:
    force = _share(run, loop, "force_max_kN", 1.0)
    if force is None or top is None:
        return force
    tail = loop.stroke_mm >= loop.stroke_mm[-1] - 0.05 * np.ptp(loop.stroke_mm)
    slope = float(np.polynomial.polynomial.polyfit(loop.stroke_mm[tail], loop.loading_kN[tail], 1)[1])
    stroke = top.shared.scaled(slope / value)
    # A stroke that reads too much has its force at too large a stroke: the end force is too small there.
    one, other = force.shared.by_source, stroke.by_source
    shared = {s: one.get(s, 0.0) - other.get(s, 0.0) for s in dict.fromkeys((*one, *other))}
    explained = float(np.sqrt(sum(c * c for c in shared.values())))
    return _with_own(
        RunFigure(1.0, explained, SharedContributions(shared, explained)),
        _end_noise(force, slope / value * top.own_u),
    )


def _with_own(figure: RunFigure, own_u: float) -> RunFigure:
    """Return a figure with the same shared errors, and so much of its own."""
    shared = figure.shared
    return RunFigure(figure.value, float(np.hypot(own_u, shared.explained_u)), shared)


def _less(own_u: float, part_u: float) -> float:
    """Return what is left of an uncertainty without a part of it."""
    return float(np.sqrt(max(0.0, own_u**2 - part_u**2)))


def _end_noise(force: RunFigure, turn: float) -> float:
    """Return what the largest force has of its own but for the place of the turn; all, where it has not that:
    the largest force is not at the turn then.
    """
    return _less(force.own_u, turn) if force.own_u >= abs(turn) else force.own_u


def _per_mm(loop: MeanLoop) -> float:
    """Return the share by which the area of a loop grows for each mm that it turns later [1/mm]."""
    first, last = float(loop.stroke_mm[0]), float(loop.stroke_mm[-1])
    step_mm = _STEP * (last - first)
    whole_J = loop.absorbed_energy_J
    return (whole_J - loop.cut(first, last - step_mm).absorbed_energy_J) / (step_mm * whole_J)


def _share(run: RunEvaluation, loop: MeanLoop, name: str, factor: float) -> RunFigure | None:
    """Return what the uncertainty of a mean is as a share of it, times a factor."""
    U, mean = loop.expanded_uncertainties.get(name), loop.means.get(name)
    if U is None or not mean:
        return None
    shared = SharedContributions() if run.shared_errors is None else run.shared_errors.of(name)
    scale = factor / mean
    return RunFigure(1.0, abs(scale) * U / _COVERAGE, shared.scaled(scale))


def _difference_uncertainty_K(one: MeanLoop, two: MeanLoop) -> float | None:  # noqa: N802 - the unit
    """Return U of the difference of temperatures: limits of both sensors, independent and rectangular."""
    if one.temperature_accuracy_C is None or two.temperature_accuracy_C is None:
        return None
    return _COVERAGE * float(np.hypot(one.temperature_accuracy_C, two.temperature_accuracy_C)) / _SQRT3


def _change(
    before: float | None,
    after: float | None,
    relative: Sequence[RunFigure | None],
    apart_K: float,
    u_apart_K: float | None,
) -> ChangeByTemperature:
    if before is None or after is None or before == 0.0:
        return ChangeByTemperature(before, after)
    ratio = after / before
    change = ratio - 1.0
    known = [figure for figure in relative if figure is not None]
    if len(known) < 2:
        return ChangeByTemperature(before, after, change, None, change / apart_K, None)
    # d(after / before) = ratio (d after / after - d before / before): what both have in common cancels.
    spread = Figures.of(known).weighted(np.array([-ratio, ratio]))
    U = _COVERAGE * spread.u
    per_K = None if u_apart_K is None else float(np.hypot(U, change / apart_K * u_apart_K)) / apart_K
    return ChangeByTemperature(before, after, change, U, change / apart_K, per_K, spread.half_width_95)
