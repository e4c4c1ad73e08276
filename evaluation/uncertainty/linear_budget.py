"""The linear uncertainty budget of a run's main results (JCGM 100), by GTC, for the report.

The Monte Carlo propagation (:mod:`bufferstand.evaluation.uncertainty.monte_carlo`) gives the value of record;
the budget says where it comes from. Both rest on the same facts of the channels and the same integrals of the
recorded loops. Every input is one uncertain number that all results share, so that damping is propagated as
one quantity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import GTC  # type: ignore[import-untyped]
import numpy as np

from bufferstand.evaluation.catalogue import MAIN
from bufferstand.evaluation.facts import Budget, BudgetLine, Summary
from bufferstand.evaluation.loops import InertiaForce
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import TANGENT_WINDOW
from bufferstand.evaluation.uncertainty.cycle_propagations import Propagations
from bufferstand.evaluation.uncertainty.error_model import (
    drum_periods_mm,
    mean_of_wires,
    stroke_term_slopes,
    stroke_terms,
)
from bufferstand.evaluation.uncertainty.hum_and_drift import OwnErrors
from bufferstand.evaluation.uncertainty.means import LEAST_SCATTER
from bufferstand.evaluation.uncertainty.monte_carlo import COVERAGE, CyclePropagation, LocalReading
from bufferstand.foundation.channels import ChannelUncertainty

_UNITS = {entry.name: entry.unit for entry in MAIN}
_MOST_CYCLES = 50
"""Loops are averaged over at most so many of the cycles used, evenly chosen."""
_SQRT3 = math.sqrt(3.0)
_GAPS, _SCATTER = "what is not on record", "scatter between cycles"


@dataclass(frozen=True)
class _Source:
    """What a line of the budget states of its input(s)."""

    name: str
    unit: str
    limit: float | None
    distribution: str
    inputs: tuple[Any, ...]

    @property
    def u(self) -> float:
        return math.sqrt(sum(x.u**2 for x in self.inputs))


class _Inputs:
    """The uncertain numbers that all results of a run share."""

    def __init__(
        self,
        force: ChannelUncertainty,
        wires: Sequence[ChannelUncertainty],
        inertia: InertiaForce | None = None,
        own: OwnErrors | None = None,
    ) -> None:
        stroke = mean_of_wires(wires)
        if force.accuracy_percent is None or stroke is None:
            raise ValueError("the channels state no accuracy")
        self.scale = _within((force.accuracy_percent) / 100.0)
        self.zero = _within(force.zero or 0.0)
        self.reversibility = _within((force.reversibility_percent or 0.0) / 100.0)
        self.skew = GTC.ureal(0.0, math.hypot(force.u_delay_s or 0.0, stroke.u_delay_s))
        self.stroke_scale = _within(stroke.scale)
        self.stroke_zero = _within(stroke.zero_mm)
        self.drums_mm = drum_periods_mm(wires)
        self.shape = tuple(GTC.ureal(0.0, wave.joint_u_mm) for wave in stroke.waves for _ in range(2))
        self.mass: tuple[Any, ...] = () if inertia is None else (_within(inertia.limit),)
        own = own or OwnErrors()
        self.own = tuple(GTC.ureal(0.0, u) for u in own.standard_u)
        self.force_terms = (1.0, self.scale, self.zero, self.reversibility, self.skew, *self.mass, *self.own)
        self.stroke_terms = (1.0, self.stroke_scale, *self.shape)
        # One line for all shapes: of each pair, cosine and sine, the deviation at a stroke has one's u.
        count = 1.0 / math.sqrt(2.0)
        self.sources: tuple[_Source, ...] = (
            _Source(
                "force: scale (class)", "1", force.accuracy_percent / 100.0, "rectangular", (self.scale,)
            ),
            _Source("force: zero", "kN", force.zero or 0.0, "rectangular", (self.zero,)),
            _Source(
                "force: reversibility",
                "1",
                (force.reversibility_percent or 0.0) / 100.0,
                "rectangular",
                (self.reversibility,),
            ),
            _Source("skew of force to stroke", "s", None, "normal", (self.skew,)),
            _Source("stroke: scale", "1", stroke.scale, "rectangular", (self.stroke_scale,)),
            _Source("stroke: zero", "mm", stroke.zero_mm, "rectangular", (self.stroke_zero,)),
            _Source("stroke: linearity", "mm", stroke.linearity_mm, "smooth shape", self.shape),
        )
        if inertia is not None:
            mass = _Source("moving mass", "1", inertia.limit, "rectangular", self.mass)
            self.sources = (*self.sources, mass)
        self.joint = {"stroke: linearity": count}
        for name in dict.fromkeys(own.names):
            inputs = tuple(x for x, of in zip(self.own, own.names, strict=True) if of == name)
            limit, shape = (None, "arcsine") if len(inputs) > 1 else (own.drift_kN, "rectangular")
            self.sources = (*self.sources, _Source(name, "kN", limit, shape, inputs))
            self.joint[name] = count if len(inputs) > 1 else 1.0


def _within(limit: float) -> Any:
    return GTC.ureal(0.0, limit / _SQRT3)


def run_budget(
    force: ChannelUncertainty | None,
    wires: Sequence[ChannelUncertainty],
    prepared: Propagations,
    summary: Summary,
    inertia: InertiaForce | None = None,
    gap_limits: Mapping[str, float] | None = None,
) -> tuple[Budget, ...]:
    """Return the budgets of a run's main results.

    Parameters
    ----------
    force, wires
        Uncertainty of the channels.
    prepared : Propagations
        Of the complete cycles.
    summary : Summary
        Means over the cycles used, with the uncertainty of record.
    inertia : InertiaForce, optional
        What the correction for a moving mass added.
    gap_limits : mapping of str to float, optional
        By how much what is not on record may change the means, by quantity (limits, in their units); of a
        run that lacks nothing none.

    Returns
    -------
    tuple of Budget
        One a result that has a mean; empty where the channels state no accuracy or no cycle was used.
    """
    used = [index for index in summary.cycles_used if index in prepared]
    if force is None or force.accuracy_percent is None or mean_of_wires(wires) is None or not used:
        return ()
    chosen = [used[i] for i in np.unique(np.linspace(0, len(used) - 1, _MOST_CYCLES).round().astype(int))]
    prepared.prepare(chosen)
    loops = [prepared[index] for index in chosen]
    inputs = _Inputs(force, wires, inertia, loops[0].own)
    budgets = []
    energies = _energies(inputs, loops, len(used))
    tangent = _tangent(inputs, loops, len(used))
    for name in MAIN.names:
        figure = energies.get(name) or (tangent if name.startswith("tangent") else None)
        value = summary.values[name].value
        if figure is None or value is None:
            continue
        result, own = figure
        own = (*own, *_beside(name, (gap_limits or {}).get(name, 0.0), summary, len(used)))
        expanded = summary.values[name].expanded_uncertainty
        u_drawn = None if expanded is None else expanded / COVERAGE
        budgets.append(_drawn_up(name, value, result, inputs, own, u_drawn))
    return tuple(budgets)


Figure = tuple[Any, tuple[_Source, ...]]


def _energies(inputs: _Inputs, loops: Sequence[CyclePropagation], cycles: int) -> dict[str, Figure]:
    """Return W_s, W_a and D as uncertain numbers, from the mean integrals of the loops."""
    terms = [loop.energy_terms for loop in loops]
    up, down = np.mean([t.loading for t in terms], axis=0), np.mean([t.returning for t in terms], axis=0)
    share = 1.0 / math.sqrt(cycles)
    noise = [
        share * _rms([getattr(t, name) for t in terms]) for name in ("noise_up_J", "noise_down_J", "turn_J")
    ]
    noise[2] = math.hypot(noise[2], _rms([t.blunt_J for t in terms]))  # the same in all cycles
    if not all(map(math.isfinite, noise)):
        return {}  # a turning point is not known at all: its figures have no U either
    e_up, e_down, e_turn = (GTC.ureal(0.0, u) for u in noise)
    stored = _bilinear(inputs, up) + e_up + e_turn
    absorbed = _bilinear(inputs, up) + e_up + _bilinear(inputs, down) + e_down
    white = _Source("noise and resolution", "J", None, "normal", (e_up, e_down))
    turns = _Source("turning points", "J", None, "normal", (e_turn,))
    figures: dict[str, Figure] = {
        "stored_energy_J": (stored, (white, turns)),
        "absorbed_energy_J": (absorbed, (white,)),
    }
    if stored.x > 0.0:
        figures["damping"] = (absorbed / stored, (white, turns))
    return figures


def _tangent(inputs: _Inputs, loops: Sequence[CyclePropagation], cycles: int) -> Figure | None:
    readings: list[LocalReading] = []
    for loop in loops:
        cycle = loop.cycle
        mean_mm = 0.5 * (cycle.stroke_min_mm + cycle.stroke_max_mm)
        reading = loop.read(mean_mm, TANGENT_WINDOW * cycle.range_mm)
        if reading is None:
            return None
        readings.append(reading)
    slopes = np.mean([r.slope_terms for r in readings], axis=0)
    bend = float(np.mean([r.bend for r in readings]))
    stroke_mm = float(np.mean([r.stroke_mm for r in readings]))
    gain = _rms([r.slope_gain for r in readings]) / math.sqrt(cycles)
    noise = GTC.ureal(0.0, gain)
    low_mm = float(np.mean([loop.cycle.stroke_min_mm for loop in loops]))
    high_mm = float(np.mean([loop.cycle.stroke_max_mm for loop in loops]))
    # The mean stroke is measured with the same wires: their zero does not move the reading along the branch.
    at, low, high = stroke_terms(np.array([stroke_mm, low_mm, high_mm]), inputs.drums_mm).T
    error_mm = _sum((at - 0.5 * (low + high))[1:], inputs.stroke_terms[1:])
    stretch = _sum(stroke_term_slopes(stroke_mm, inputs.drums_mm)[1:], inputs.stroke_terms[1:])
    slope = _sum(slopes, inputs.force_terms) * (1.0 + stretch) + bend * error_mm + noise
    return slope, (_Source("noise and resolution", "kN/mm", None, "normal", (noise,)),)


def _beside(name: str, gap_limit: float, summary: Summary, cycles: int) -> tuple[_Source, ...]:
    """Return the errors that are added to a mean as they are: what is not on record, and what the cycles
    scatter by beyond their noise, as an uncertainty of their mean (type A).

    The bound of a gap is one of each result by itself (damping's is not that of the energies), and one
    rectangular error for the whole run, as it is drawn
    (:func:`bufferstand.evaluation.uncertainty.cycle_uncertainty.with_gaps`).
    """
    found = []
    if gap_limit:
        limit = abs(gap_limit)
        found.append(_Source(_GAPS, _UNITS[name], limit, "rectangular", (_within(limit),)))
    if cycles >= LEAST_SCATTER:
        u = GTC.ureal(0.0, summary.values[name].scatter_u, cycles - 1)
        found.append(_Source(_SCATTER, _UNITS[name], None, "t", (u,)))
    return tuple(found)


def _drawn_up(
    name: str, value: float, result: Any, inputs: _Inputs, own: tuple[_Source, ...], u_drawn: float | None
) -> Budget:
    whole = result + sum(source.inputs[0] for source in own if source.name in (_GAPS, _SCATTER))
    lines = [_line(whole, source, inputs.joint.get(source.name, 1.0)) for source in (*inputs.sources, *own)]
    dof = float(GTC.dof(whole)) if whole.u > 0.0 else math.inf
    return Budget(
        quantity=name,
        unit=_UNITS[name],
        value=value,
        u=float(whole.u),
        u_monte_carlo=u_drawn,
        degrees_of_freedom=_finite(dof),
        coverage_factor_95=float(GTC.rp.k_factor(dof)),
        lines=tuple(lines),
    )


def _line(result: Any, source: _Source, joint: float) -> BudgetLine:
    contribution = math.sqrt(sum(GTC.component(result, x) ** 2 for x in source.inputs))
    single = source.inputs[0] if len(source.inputs) == 1 else None
    has_sensitivity = single is not None and single.u > 0.0
    return BudgetLine(
        source=source.name,
        unit=source.unit,
        value=0.0,
        limit=source.limit,
        distribution=source.distribution,
        u=source.u * joint,
        sensitivity=float(GTC.rp.sensitivity(result, single)) if has_sensitivity else None,
        contribution=contribution,
        degrees_of_freedom=_finite(float(source.inputs[0].df)),
    )


def _finite(dof: float) -> float | None:
    return dof if math.isfinite(dof) else None


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _sum(weights: FloatArray, terms: Sequence[Any]) -> Any:
    return sum(float(w) * term for w, term in zip(weights, terms, strict=True))


def _bilinear(inputs: _Inputs, integrals: FloatArray) -> Any:
    rows = [_sum(row, inputs.stroke_terms) for row in integrals]
    return sum(a * row for a, row in zip(inputs.force_terms, rows, strict=True))
