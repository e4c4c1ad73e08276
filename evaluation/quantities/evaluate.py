"""The figures of cycles: every quantity of the catalogue, and what is to be said of a loop.

Cycles are evaluated many at once (:mod:`bufferstand.evaluation.loops.cut`): a run of ten thousand costs no
more than its samples do. One by itself is a stack of one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bufferstand.evaluation.catalogue import (
    NOT_FINITE,
    OF_LOOP,
    OF_THERMOMETER,
    OF_TURNS,
    QUANTITIES,
    Catalogue,
)
from bufferstand.evaluation.cycles import STEADY_STROKE, spectra
from bufferstand.evaluation.facts import Cycle, CycleResult, Quantities
from bufferstand.evaluation.loops import Branches, CutLoops, LoopStack
from bufferstand.evaluation.numerics import BoolArray, ComplexArray, FloatArray
from bufferstand.evaluation.quantities.loop_readings import LoopFigures, TurnFigures, slopes_between
from bufferstand.evaluation.quantities.temperature import (
    READING_INTERVAL_S,
    temperatures_of,
    why_no_temperature,
)
from bufferstand.evaluation.record import Record, Temperature

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
    found: list[CycleResult] = []
    for stack in (loops or CutLoops(record, complete)).stacks():
        begin = len(found)
        found += _evaluated(record, stack, first[begin : begin + len(stack.cycles)])
    each = iter(found)
    results = [next(each) if cycle.complete else _incomplete(cycle) for cycle in cycles]
    return _with_temperatures(results, record.temperatures, reading_interval_s)


def evaluate_cycle(record: Record, cycle: Cycle) -> CycleResult:
    """Return the figures of one cycle (:func:`evaluate_cycles`)."""
    return evaluate_cycles(record, [cycle])[0]


@dataclass(frozen=True, eq=False)
class _Readings:
    """What the sensors on the specimen say of cycles: temperatures [°C], and why one is not to be had."""

    sensors: Sequence[Temperature]
    start_s: FloatArray
    end_s: FloatArray
    interval_s: float

    @cached_property
    def both_C(self) -> tuple[FloatArray, FloatArray]:  # noqa: N802 - the unit's own letter
        return temperatures_of(self.sensors, self.start_s, self.end_s, self.interval_s)

    def why(self, row: int) -> str:
        return why_no_temperature(
            self.sensors, float(self.start_s[row]), float(self.end_s[row]), self.interval_s
        )


def _with_temperatures(
    results: list[CycleResult], sensors: Sequence[Temperature], interval_s: float
) -> list[CycleResult]:
    """Return the cycles, complete or not, with the quantities of the thermometers."""
    spans = np.array([(one.cycle.start_s, one.cycle.end_s) for one in results]).reshape(-1, 2)
    readings = _Readings(sensors, spans[:, 0], spans[:, 1], interval_s)
    columns = _finite(OF_THERMOMETER, readings)
    reasons = _reasons(OF_THERMOMETER, columns, readings)
    named = zip(*columns.values(), strict=True)
    return [
        one._replace(
            quantities=one.quantities._replace(**dict(zip(columns, values, strict=True))),
            missing={**one.missing, **reasons.get(row, {})},
        )
        for row, (one, values) in enumerate(zip(results, named, strict=True))
    ]


def _incomplete(cycle: Cycle) -> CycleResult:
    """Return what a cycle that is not complete has: the figures of its turns, if it has both of them."""
    why = "; ".join(cycle.why)
    missing = dict.fromkeys(OF_LOOP.names, why)
    if not cycle.bounded:
        missing |= dict.fromkeys(OF_TURNS.names, why)
        return CycleResult(
            cycle, Quantities(), warnings=(f"not evaluated, no figures: {why}",), missing=missing
        )
    low, high, span = np.array([[cycle.stroke_min_mm], [cycle.stroke_max_mm], [cycle.range_mm]])
    turns = TurnFigures(low, high, span, low + 0.5 * span)
    columns = _finite(OF_TURNS, turns)
    reasons = _reasons(OF_TURNS, columns, turns).get(0, {})
    text = f"not complete, no energies nor other figures of the loop: {why}"
    return CycleResult(
        cycle,
        Quantities(**{name: value for name, (value,) in columns.items()}),
        warnings=(text, *_said(reasons)),
        missing=missing | reasons,
    )


def _finite(entries: Catalogue, figures: Any) -> dict[str, list[float | None]]:
    """Return each quantity's column; None where it is not a number."""
    columns: dict[str, list[float | None]] = {}
    with np.errstate(divide="ignore", invalid="ignore"):
        for entry in entries:
            column = np.asarray(entry.compute(figures), dtype=np.float64)
            values: list[float | None] = column.tolist()
            for row in np.flatnonzero(~np.isfinite(column)).tolist():
                values[row] = None
            columns[entry.name] = values
    return columns


def _reasons(
    entries: Catalogue, columns: Mapping[str, list[float | None]], figures: Any
) -> dict[int, dict[str, str]]:
    """Return why quantities are missing, by row and name; only of rows where one is."""
    reasons: dict[int, dict[str, str]] = defaultdict(dict)
    for entry in entries:
        column = columns[entry.name]
        for row in (n for n, value in enumerate(column) if value is None) if None in column else ():
            reasons[row][entry.name] = entry.reason(figures, row)
    return reasons


def _said(reasons: Mapping[str, str]) -> list[str]:
    """Return a warning for each reason, and one for all figures that are not finite."""
    words = {entry.name: entry.label.lower() for entry in QUANTITIES}
    said = [f"no {words[name]}: {why}" for name, why in reasons.items() if why != NOT_FINITE]
    not_finite = [name for name, why in reasons.items() if why == NOT_FINITE]
    return [*said, *([f"no finite value: {', '.join(not_finite)}"] if not_finite else ())]


def _evaluated(record: Record, stack: LoopStack, first: ComplexArray) -> list[CycleResult]:
    """Return the figures of each loop, why some are missing, and what is to be said of it."""
    entries = QUANTITIES.that(lambda entry: entry.needs != "thermometer")
    loops = LoopFigures.of(stack, first)
    columns = _finite(entries, loops)
    reasons = _reasons(entries, columns, loops)
    warnings = _stack_warnings(record, loops)
    rows = zip(stack.cycles, zip(*columns.values(), strict=True), strict=True)
    return [
        CycleResult(
            cycle,
            Quantities(**dict(zip(columns, values, strict=True))),
            warnings=(*_said(reasons.get(row, {})), *warnings.get(row, ())),
            missing=reasons.get(row, {}),
        )
        for row, (cycle, values) in enumerate(rows)
    ]


def _stack_warnings(record: Record, loops: LoopFigures) -> dict[int, list[str]]:
    """Return what is to be said of which loop; almost always nothing, which is told for all at once."""
    warnings: dict[int, list[str]] = defaultdict(list)
    absorbed, two_sided = loops.absorbed_J, are_two_sided(*loops.forces_kN)
    for row in np.flatnonzero(two_sided).tolist():
        warnings[row].append(
            "two-sided loop (the force changes sign): damping (absorbed over stored energy) is not meaningful"
        )
    for row in np.flatnonzero(absorbed < 0.0).tolist():
        warnings[row].append(
            f"the loop area is negative ({absorbed[row]:.4g} J): force lags stroke; "
            "check the signs and delays of the channels"
        )
    _say_slopes(loops.stack.loading, loops.span_mm, ~two_sided, warnings)
    rows = _inconsistent(loops)
    if rows:
        harmonic_J = spectra(record, [loops.stack.cycles[row] for row in rows]).work_J()
        for row, work_J in zip(rows, harmonic_J.tolist(), strict=True):
            warnings[row] += consistency_warnings(work_J, float(absorbed[row]))
    return warnings


def are_two_sided(force_min_kN: FloatArray, force_max_kN: FloatArray) -> BoolArray:
    """Say which loops reach beyond zero to both sides by more than 2 % of their largest force."""
    least = TWO_SIDED * np.maximum(np.abs(force_min_kN), np.abs(force_max_kN))
    return np.asarray((force_min_kN < -least) & (force_max_kN > least))


def is_two_sided(force_min_kN: float, force_max_kN: float) -> bool:
    """Say whether a loop reaches beyond zero to both sides by more than 2 % of its largest force."""
    return bool(are_two_sided(np.array(force_min_kN), np.array(force_max_kN)))


def _say_slopes(
    loading: Branches, span: FloatArray, wanted: BoolArray, warnings: dict[int, list[str]]
) -> None:
    """Recognise slack and block contact by local slopes of the loading branch."""
    lines = np.arange(loading.count.size)
    low, high = loading.stroke_mm[:, 0], loading.stroke_mm[lines, loading.count - 1]
    secant = (loading.force_kN[lines, loading.count - 1] - loading.force_kN[:, 0]) / span
    foot = slopes_between(loading, low, low + SLACK_STROKE * span)
    end = slopes_between(loading, high - 0.01 * span, high)
    before = slopes_between(loading, high - 0.10 * span, high - 0.05 * span)
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


def _inconsistent(loops: LoopFigures) -> list[int]:
    """Return the rows whose loop area is not π K″ x_a², which it equals for a sine stroke whatever the force.

    Only of a stroke that is nearly a sine and closes: of others, ten harmonics are not all of the work.
    """
    from_harmonic = np.pi * loops.first.imag * (0.5 * loops.span_mm) ** 2
    absorbed = loops.absorbed_J
    away = ~(np.abs(from_harmonic - absorbed) <= CONSISTENCY * np.abs(absorbed)) & (absorbed != 0.0)
    return [row for row in np.flatnonzero(away).tolist() if _is_closed_sine(loops.stack.cycles[row])]


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
