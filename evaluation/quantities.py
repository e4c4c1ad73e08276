"""The figures of cycles, by the names of docs/evaluation-document.md, and the windows they are read in.

Cycles are evaluated many at once (:mod:`bufferstand.evaluation.loops`): a run of ten thousand costs no more
than its samples do. One by itself is a stack of one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.branches import Branches
from bufferstand.evaluation.cycles import STEADY_STROKE
from bufferstand.evaluation.loops import CutLoops, LoopStack
from bufferstand.evaluation.motion import Cycle, Loop
from bufferstand.evaluation.record import FloatArray, Record
from bufferstand.evaluation.results import CycleResult, Quantities
from bufferstand.evaluation.smoothing import moving_slopes, polynomials
from bufferstand.evaluation.spectra import spectra
from bufferstand.evaluation.thermometry import READING_INTERVAL_S, temperatures_of

TANGENT_WINDOW = 0.15
"""Tangent stiffness: cubic fit of force over stroke within ± this share of the range about the mean."""
SPEED_WINDOW = 0.05
"""Speeds: slope of a local parabola over this share of a branch's samples (at least 5)."""
CONSISTENCY = 0.02
"""Largest difference of loop area and harmonics' work, as a share of the area, that passes without a word."""
SINE_DISTORTION = 0.01
"""Up to this distortion a stroke counts as a sine, for which ten harmonics must agree with the area."""
TWO_SIDED = 0.02
"""A loop is two-sided when it reaches beyond zero by more than this share of its largest force."""
SLACK_STROKE = 0.02
SLACK_SLOPE = 0.005
"""Slack: the first 2 % of the range with less than this share of the secant stiffness."""
BLOCK_SLOPE = 3.0
"""Block contact: slope of the last 1 % of the range over that between 10 and 5 % below the top."""
_LEAST_WINDOW = 5
_FEWEST_SLOPE = 4

BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]


def stored_energy_J(loop: Loop) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the area from the lower turning point to the largest stroke [J = kN·mm] (EN 15551: W_s)."""
    dwell = slice(loop.top, loop.rising.stop)
    return _area_J(loop, loop.loading) + float(np.trapezoid(loop.force_kN[dwell], loop.stroke_mm[dwell]))


def absorbed_energy_J(loop: Loop) -> float:  # noqa: N802
    """Return the signed area of the loop [J] (W_a); a loop that does not close is closed by a chord."""
    force, stroke = loop.force_kN, loop.stroke_mm
    chord = 0.5 * (force[-1] + force[0]) * (stroke[0] - stroke[-1])
    dwell = slice(loop.top, loop.unload + 1)
    rest = float(np.trapezoid(force[dwell], stroke[dwell]))
    return _area_J(loop, loop.loading) + rest + _area_J(loop, loop.unloading) + float(chord)


def _area_J(loop: Loop, part: slice) -> float:  # noqa: N802
    time_s, stroke_mm, force_kN = (a[None, part] for a in (loop.time_s, loop.stroke_mm, loop.force_kN))
    count = np.array([time_s.size])
    return float(Branches(time_s, stroke_mm, force_kN, count, loop.averaged).areas()[0])


def evaluate_cycles(
    record: Record,
    cycles: Sequence[Cycle],
    first: ComplexArray | None = None,
    loops: CutLoops | None = None,
    reading_interval_s: float = READING_INTERVAL_S,
) -> list[CycleResult]:
    """Return the figures of cycles; of one that is not complete only those of its stroke.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Found in that record.
    first : array, shape (C,), optional
        K* = K′ + i K″ of the complete ones [kN/mm], if it is known already.
    loops : CutLoops, optional
        Those of the complete ones, if somebody else needs them too.
    reading_interval_s : float
        How far readings of temperature may be from each other to cover a cycle [s].

    Returns
    -------
    list of CycleResult
        In the same order, without uncertainties; ``warnings`` say why a figure is None or must be read with
        care.
    """
    complete = [cycle for cycle in cycles if cycle.complete]
    if first is None:
        first = spectra(record, complete).first_harmonic()
    temperatures: list[list[float | None]] = [[None] * len(cycles)] * 2
    if record.temperatures:
        temperatures = [
            [None if np.isnan(t) else t for t in column.tolist()]
            for column in temperatures_of(record.temperatures, *_spans(cycles), reading_interval_s)
        ]
    found: list[Quantities] = []
    said: dict[int, tuple[str, ...]] = {}
    for stack in (loops or CutLoops(record, complete)).stacks():
        begin = len(found)
        figures, texts = _stack_figures(record, stack, first[begin : begin + len(stack.cycles)])
        found += figures
        said |= {begin + row: tuple(lines) for row, lines in texts.items()}
    each = enumerate(found)
    results = []
    for cycle, start_C, max_C in zip(cycles, *temperatures, strict=True):
        if cycle.complete:
            row, values = next(each)
            warnings = said.get(row, ())
        else:
            values, warnings = _incomplete(cycle)
        if start_C is not None or max_C is not None:
            values = values._replace(temperature_start_C=start_C, temperature_max_C=max_C)
        results.append(CycleResult(cycle, values, warnings=warnings))
    return results


def evaluate_cycle(record: Record, cycle: Cycle) -> CycleResult:
    """Return the figures of one cycle (:func:`evaluate_cycles`)."""
    return evaluate_cycles(record, [cycle])[0]


def _spans(cycles: Sequence[Cycle]) -> tuple[FloatArray, FloatArray]:
    return np.array([c.start_s for c in cycles]), np.array([c.end_s for c in cycles])


def _incomplete(cycle: Cycle) -> tuple[Quantities, tuple[str, ...]]:
    if not cycle.bounded:
        return Quantities(), (f"not evaluated, no figures: {'; '.join(cycle.why)}",)
    span = cycle.range_mm
    figures: dict[str, float | None] = {
        "stroke_min_mm": cycle.stroke_min_mm,
        "stroke_max_mm": cycle.stroke_max_mm,
        "prestress_mm": cycle.stroke_min_mm + 0.5 * span,
        "amplitude_mm": 0.5 * span,
    }
    text = "not complete, no energies nor other figures of the loop: " + "; ".join(cycle.why)
    bad = [name for name, value in figures.items() if value is not None and not np.isfinite(value)]
    figures.update(dict.fromkeys(bad))
    return Quantities(**figures), (text, *_not_finite(bad))


def _not_finite(names: Sequence[str]) -> tuple[str, ...]:
    return (f"no finite value: {', '.join(names)}",) if names else ()


def _stack_figures(
    record: Record, stack: LoopStack, first: ComplexArray
) -> tuple[list[Quantities], dict[int, list[str]]]:
    """Return the figures of each loop, and what is to be said of some of them."""
    low, high = stack.turns.stroke_min_mm, stack.turns.stroke_max_mm
    span, mean = high - low, 0.5 * (low + high)
    stored, absorbed = stack.stored_energy_J(), stack.absorbed_energy_J()
    lowest, highest = (extreme.force_kN for extreme in stack.extremes)
    tangent = local_slopes(stack.loading, mean, TANGENT_WINDOW * span)
    storage, loss = first.real, first.imag
    rising, stiff = stored > 0.0, storage > 0.0
    distortion = np.array([cycle.stroke_distortion for cycle in stack.cycles], dtype=np.float64)
    speeds = np.split(branch_speeds_mm_per_s(stack.branches), 2)
    # What NaN may stand for: a figure that is not to be had, for the reason that its warning says.
    unknown = {
        "damping": ~rising,
        "loss_factor": ~stiff,
        "stroke_distortion": np.isnan(distortion),
        "tangent_stiffness_kN_per_mm": np.isnan(tangent),
        "speed_loading_max_mm_per_s": stack.loading.count < _LEAST_WINDOW,
        "speed_unloading_max_mm_per_s": stack.unloading.count < _LEAST_WINDOW,
    }
    with np.errstate(divide="ignore", invalid="ignore"):
        figures = {
            "stroke_min_mm": low,
            "stroke_max_mm": high,
            "prestress_mm": mean,
            "amplitude_mm": 0.5 * span,
            "frequency_Hz": 1.0 / stack.turns.duration_s,
            "force_min_kN": lowest,
            "force_max_kN": highest,
            "speed_loading_max_mm_per_s": speeds[0],
            "speed_unloading_max_mm_per_s": speeds[1],
            "stored_energy_J": stored,
            "absorbed_energy_J": absorbed,
            "damping": np.where(rising, absorbed / stored, np.nan),
            "tangent_stiffness_kN_per_mm": tangent,
            "secant_stiffness_kN_per_mm": (stack.ends[1].force_kN - stack.ends[0].force_kN) / span,
            "dynamic_stiffness_kN_per_mm": np.abs(first),
            "storage_stiffness_kN_per_mm": storage,
            "loss_stiffness_kN_per_mm": loss,
            "loss_factor": np.where(stiff, loss / storage, np.nan),
            "stroke_distortion": distortion,
        }
    warnings = _stack_warnings(record, stack, figures, unknown)
    columns = [figures[name].tolist() for name in Quantities._fields if name in figures]
    named = [Quantities(*row) for row in zip(*columns, strict=True)]
    not_finite = np.array([~np.isfinite(values) for values in figures.values()])
    for row in np.flatnonzero(not_finite.any(axis=0)).tolist():
        bad = [name for name, is_bad in zip(figures, not_finite[:, row], strict=True) if is_bad]
        named[row] = named[row]._replace(**dict.fromkeys(bad))
        warnings[row] += _not_finite([name for name in bad if not (name in unknown and unknown[name][row])])
    return named, warnings


def _stack_warnings(
    record: Record, stack: LoopStack, figures: dict[str, FloatArray], unknown: dict[str, BoolArray]
) -> dict[int, list[str]]:
    """Return what is to be said of which loop; almost always nothing, which is told for all at once."""
    warnings: dict[int, list[str]] = defaultdict(list)

    def say(text: str, rows: BoolArray) -> None:
        for row in np.flatnonzero(rows).tolist():
            warnings[row].append(text)

    stored, absorbed = figures["stored_energy_J"], figures["absorbed_energy_J"]
    two_sided = are_two_sided(figures["force_min_kN"], figures["force_max_kN"])
    say("no tangent stiffness: too few samples about the mean stroke", unknown["tangent_stiffness_kN_per_mm"])
    say(
        "two-sided loop (the force changes sign): damping (absorbed over stored energy) is not meaningful",
        two_sided,
    )
    for row in np.flatnonzero(absorbed < 0.0).tolist():
        warnings[row].append(
            f"the loop area is negative ({absorbed[row]:.4g} J): force lags stroke; "
            "check the signs and delays of the channels"
        )
    for row in np.flatnonzero(stored <= 0.0).tolist():
        warnings[row].append(f"no damping: the stored energy is not positive ({stored[row]:.4g} J)")
    _say_slopes(stack.loading, 2.0 * figures["amplitude_mm"], ~two_sided, warnings)
    rows = _inconsistent(stack.cycles, figures)
    if rows:
        harmonic_J = spectra(record, [stack.cycles[row] for row in rows]).work_J()
        for row, work_J in zip(rows, harmonic_J.tolist(), strict=True):
            warnings[row] += consistency_warnings(work_J, float(absorbed[row]))
    say("no loss factor: the storage stiffness is not positive", unknown["loss_factor"])
    return warnings


def are_two_sided(force_min_kN: FloatArray, force_max_kN: FloatArray) -> BoolArray:
    """Say which loops reach beyond zero to both sides by more than 2 % of their largest force."""
    least = TWO_SIDED * np.maximum(np.abs(force_min_kN), np.abs(force_max_kN))
    return np.asarray((force_min_kN < -least) & (force_max_kN > least))


def is_two_sided(force_min_kN: float, force_max_kN: float) -> bool:
    """Say whether a loop reaches beyond zero to both sides by more than 2 % of its largest force."""
    return bool(are_two_sided(np.array(force_min_kN), np.array(force_max_kN)))


def _by_window(count: NDArray[np.intp], share: float) -> list[tuple[int, slice | NDArray[np.intp]]]:
    """Return the windows of a share of a branch's points and the rows they are for; 0: too few points."""
    window = np.maximum(_LEAST_WINDOW, 2 * (0.5 * share * count).astype(int) + 1)
    window[count < window] = 0
    sizes = np.unique(window).tolist()
    if len(sizes) == 1:
        return [(sizes[0], slice(None))]
    return [(size, np.flatnonzero(window == size)) for size in sizes]


def branch_speeds_mm_per_s(branch: Branches) -> FloatArray:
    """Return the largest absolute speed of branches from their smoothed derivative; NaN below 5 points."""
    speed = np.full(branch.count.size, np.nan)
    for window, rows in _by_window(branch.count, SPEED_WINDOW):
        if not window:
            continue
        count = branch.count[rows]
        lines = np.arange(count.size)
        time = branch.time_s[rows]
        step = (time[lines, count - 1] - time[:, 0]) / (count - 1)
        even = _on_even_times(time, branch.stroke_mm[rows], count, step)
        slope = moving_slopes(even, count, window)
        speed[rows] = np.maximum(np.max(slope, axis=1), -np.min(slope, axis=1)) / step
    return speed


def _on_even_times(
    time_s: FloatArray, value: FloatArray, count: NDArray[np.intp], step_s: FloatArray
) -> FloatArray:
    """Return each row on as many even moments, by straight lines; its last value behind them."""
    place = time_s - time_s[:, :1]
    place /= step_s[:, None]
    order = np.arange(time_s.shape[1])
    ragged = int(np.min(count))
    behind = order[ragged:] >= count[:, None]
    place[:, ragged:] = np.where(behind, order[ragged:], place[:, ragged:])
    # Where samples are even, the moment number k lies within a step of point k: no search is needed.
    off = place - order
    if max(np.max(off), -np.min(off)) < 1.0:
        return _beside(place, value, off)
    rows = 2.0 * order.size * np.arange(time_s.shape[0])[:, None]
    moments = np.minimum(order, (count - 1)[:, None])
    even = np.interp((moments + rows).ravel(), (place + rows).ravel(), value.ravel())
    return np.asarray(even.reshape(value.shape), dtype=np.float64)


def _beside(place: FloatArray, value: FloatArray, off: FloatArray) -> FloatArray:
    """Return values at moments 0, 1, 2 … of rows whose point k lies less than 1 from moment k."""
    slope = np.diff(value, axis=1)
    slope /= np.diff(place, axis=1)
    even = value.copy()
    moved = np.minimum(off[:, :-1], 0.0)
    moved *= slope
    even[:, :-1] -= moved
    np.maximum(off[:, 1:], 0.0, out=moved)
    moved *= slope
    even[:, 1:] -= moved
    return even


def _window(inside: BoolArray) -> slice:
    """Return the columns that hold all of what is inside."""
    columns = np.flatnonzero(inside.any(axis=0))
    return slice(int(columns[0]), int(columns[-1]) + 1) if columns.size else slice(0, 1)


def local_slopes(branch: Branches, stroke_mm: FloatArray, half_width_mm: FloatArray) -> FloatArray:
    """Return the slope of branches at a stroke each [kN/mm], shape (R,).

    A cubic of force over stroke within ± ``half_width_mm`` (cut at the branch's ends) is read at
    ``stroke_mm``; NaN when the branch does not reach it or too few points lie in the window.
    """
    lines = np.arange(branch.count.size)
    ends = branch.stroke_mm[:, 0], branch.stroke_mm[lines, branch.count - 1]
    reached = (ends[0] <= stroke_mm) & (stroke_mm <= ends[1])
    inside = branch.stroke_mm >= (stroke_mm - half_width_mm)[:, None]
    inside &= branch.stroke_mm <= (stroke_mm + half_width_mm)[:, None]
    inside &= branch.used
    part = _window(inside)
    z = (branch.stroke_mm[:, part] - stroke_mm[:, None]) / half_width_mm[:, None]
    fits = reached & (np.count_nonzero(inside[:, part], axis=1) >= 5)
    found = polynomials(z, branch.force_kN[:, part], inside[:, part] & fits[:, None], 3)
    return np.where(fits, found[:, 1] / half_width_mm, np.nan)


def _slopes_between(branch: Branches, first_mm: FloatArray, last_mm: FloatArray) -> FloatArray:
    """Return the slope of lines through branches between two strokes; NaN where there is too little."""
    inside = (branch.stroke_mm >= first_mm[:, None]) & (branch.stroke_mm <= last_mm[:, None])
    inside &= branch.used
    part = _window(inside)
    own, stroke, width = inside[:, part], branch.stroke_mm[:, part], last_mm - first_mm
    reach = np.max(np.where(own, stroke, -np.inf), axis=1) - np.min(np.where(own, stroke, np.inf), axis=1)
    fits = (np.count_nonzero(own, axis=1) >= _FEWEST_SLOPE) & (reach >= 0.5 * width)
    z = (stroke - first_mm[:, None]) / np.where(width > 0.0, width, 1.0)[:, None]
    found = polynomials(z, branch.force_kN[:, part], own & fits[:, None], 1)
    return np.where(fits, found[:, 1] / np.where(width > 0.0, width, 1.0), np.nan)


def _say_slopes(
    loading: Branches, span: FloatArray, wanted: BoolArray, warnings: dict[int, list[str]]
) -> None:
    """Recognise slack and block contact by local slopes of the loading branch."""
    lines = np.arange(loading.count.size)
    low, high = loading.stroke_mm[:, 0], loading.stroke_mm[lines, loading.count - 1]
    secant = (loading.force_kN[lines, loading.count - 1] - loading.force_kN[:, 0]) / span
    foot = _slopes_between(loading, low, low + SLACK_STROKE * span)
    end = _slopes_between(loading, high - 0.01 * span, high)
    before = _slopes_between(loading, high - 0.10 * span, high - 0.05 * span)
    slack = wanted & (secant > 0.0) & (np.abs(foot) < SLACK_SLOPE * secant)
    block = wanted & (end > BLOCK_SLOPE * np.maximum(before, secant))
    for row in np.flatnonzero(slack).tolist():
        warnings[row].append(
            f"slack: the force does not rise over the first {SLACK_STROKE * span[row]:.3g} mm of the stroke"
        )
    for row in np.flatnonzero(block).tolist():
        warnings[row].append(
            f"block contact: the slope rises from {before[row]:.3g} to {end[row]:.3g} kN/mm "
            "at the end of the stroke"
        )


def _inconsistent(cycles: Sequence[Cycle], figures: dict[str, FloatArray]) -> list[int]:
    """Return the rows whose loop area is not π K″ x_a², which it equals for a sine stroke whatever the force.

    Only of a stroke that is nearly a sine and closes: of others, ten harmonics are not all of the work.
    """
    from_harmonic = np.pi * figures["loss_stiffness_kN_per_mm"] * figures["amplitude_mm"] ** 2
    absorbed = figures["absorbed_energy_J"]
    away = ~(np.abs(from_harmonic - absorbed) <= CONSISTENCY * np.abs(absorbed)) & (absorbed != 0.0)
    return [row for row in np.flatnonzero(away).tolist() if _is_closed_sine(cycles[row])]


def _is_closed_sine(cycle: Cycle) -> bool:
    distortion = cycle.stroke_distortion
    closes = abs(cycle.stroke_end_mm - cycle.stroke_min_mm) <= STEADY_STROKE * cycle.range_mm
    return closes and distortion is not None and distortion <= SINE_DISTORTION


def consistency_warnings(harmonic_J: float, absorbed_J: float) -> list[str]:
    """Compare the loop area with the work of the harmonics of the cycle (:meth:`Spectra.work_J`)."""
    difference = abs(harmonic_J / absorbed_J - 1.0)
    if difference <= CONSISTENCY:
        return []
    text = (
        f"loop area {absorbed_J:.5g} J and the work of its harmonics, {harmonic_J:.5g} J, disagree "
        f"by {difference:.1%}: samples are not evenly timed, or the cycle does not repeat"
    )
    return [text]


def first_harmonic(record: Record, cycle: Cycle) -> complex:
    """Return K* = K′ + i K″ of one cycle [kN/mm], the ratio of the first harmonics of force and stroke."""
    return complex(spectra(record, [cycle]).first_harmonic()[0])
