"""Checks of the wiring: signals of one motion compared with each other and with the plan.

Each check is a pure function from a :class:`bufferstand.evaluation.plausibility.RunView` to findings, in
its own module. What is found joins the findings of the run (:mod:`bufferstand.evaluation.plausibility`) and
has their effects.
"""

from __future__ import annotations

from collections.abc import Iterable

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.exchanged_channels import force_is_a_stroke
from bufferstand.evaluation.plausibility.signal_comparison.force_delay import late_force
from bufferstand.evaluation.plausibility.signal_comparison.force_sensors import dead_force, two_forces
from bufferstand.evaluation.plausibility.signal_comparison.guard_findings import told_by_guards
from bufferstand.evaluation.plausibility.signal_comparison.plan_check import (
    PlanExpectation,
    force_and_plan,
    outlook_of,
)
from bufferstand.evaluation.plausibility.signal_comparison.stroke_sensors import strokes_and_piston
from bufferstand.evaluation.plausibility.signal_comparison.thermometer_check import thermometers
from bufferstand.evaluation.record import Signals

_EXPLAIN = ("sign", "delay", "exchanged", "frozen", "not-following")
"""Kinds that make loops run backwards."""
_DAMAGES = ("clipped", "frozen", "stroke-jump")
"""Kinds of which a straight line through a channel has a part."""
_SCALE = ("unit", "scale", "sign", "exchanged", "frozen")
"""Kinds after which nothing more need be said of a channel's scale."""


def doubted_signals(look: RunView, known: Iterable[Finding] = ()) -> list[Finding]:
    """Return what speaks against a run: what is known, and what its signals say of each other.

    Parameters
    ----------
    look : Look
    known : iterable of Finding
        What was found in the channels one by one. A sign that is doubted there by the shape of the loops
        alone gives way to what a second signal says.

    Returns
    -------
    list of Finding
        What is known; then told by the stand's own guards, exchanged, strokes, forces, lateness, plan,
        thermometers.
    """
    known = list(known)
    outlook = outlook_of(look)
    sides = _side_by_side(look, look.samples.signals, outlook)
    sides = [one for one in sides if one.kind != "scale" or not _damaged(one.quantity, known)]
    sides += [one for one in late_force(look, known) if not _said(one, sides)]
    if _explains_signs(sides):
        known = [one for one in known if one.kind != "sign"]
    planned = [one for one in force_and_plan(look, outlook) if not _scaled((*known, *sides))]
    return [*known, *told_by_guards(look), *sides, *planned, *thermometers(look)]


def _side_by_side(look: RunView, signals: Signals | None, outlook: PlanExpectation | None) -> list[Finding]:
    dead = dead_force(look)
    if signals is None:
        return dead
    exchanged = force_is_a_stroke(look, signals)
    if exchanged:
        return exchanged
    ratio = outlook.ratio if outlook is not None and outlook.known else None
    sides = strokes_and_piston(look, signals, look.facts.machine_stiffness_kN_per_mm)
    return sides + (dead or two_forces(look, signals, ratio))


def _explains_signs(findings: Iterable[Finding]) -> bool:
    """Say whether loops that run backwards or fall are explained by something else than the force's sign."""
    return any(
        one.kind in _EXPLAIN and one.effect == "spoils" and one.quantity in ("force", "stroke")
        for one in findings
    )


def _said(finding: Finding, others: Iterable[Finding]) -> bool:
    return any(finding.kind == other.kind and finding.channel == other.channel for other in others)


def _damaged(quantity: str, known: Iterable[Finding]) -> bool:
    """Say whether a channel is not the same throughout a record, so that a factor to another one is none."""
    return any(one.kind in _DAMAGES and one.quantity == quantity for one in known)


def _scaled(findings: Iterable[Finding]) -> bool:
    """Say whether the scale of force or stroke is doubted already."""
    return any(
        one.kind in _SCALE and one.effect == "spoils" and one.quantity != "temperature" for one in findings
    )
