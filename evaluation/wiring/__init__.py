"""Does the record measure what was moved? Signals of one motion held against each other and the plan.

Each check is a pure function from a :class:`evaluation.plausibility.Look` to findings, in a module of its own.
What is found joins the findings of the run (:mod:`evaluation.plausibility`) and has their effects.
"""

from __future__ import annotations

from collections.abc import Iterable

from evaluation.plausibility.finding import Finding
from evaluation.plausibility.look import Look
from evaluation.wiring.exchanged import force_is_a_stroke
from evaluation.wiring.expected import force_and_plan, outlook_of
from evaluation.wiring.forces import two_forces
from evaluation.wiring.late import late_force
from evaluation.wiring.strokes import strokes_and_piston
from evaluation.wiring.told import told_by_guards
from evaluation.wiring.warmth import thermometers

__all__ = ["doubted_signals"]

_SCALE = ("unit", "scale", "sign", "exchanged", "frozen")
"""Kinds after which nothing more need be said of a channel's scale."""


def doubted_signals(look: Look, known: Iterable[Finding] = ()) -> list[Finding]:
    """Return what speaks against the signals of a run, as they were wired and scaled.

    Parameters
    ----------
    look : Look
    known : iterable of Finding
        What was found in the channels one by one: of what is said already nothing is said again.

    Returns
    -------
    list of Finding
        In the order: told by the stand's own guards, exchanged, strokes, forces, lateness, plan, thermometers.
    """
    known = list(known)
    found = told_by_guards(look)
    signals = look.samples.signals
    outlook = outlook_of(look)
    sides: list[Finding] = []
    if signals is not None:
        sides = force_is_a_stroke(look, signals)
        if not sides:
            sides += strokes_and_piston(look, signals, look.facts.machine_stiffness_kN_per_mm)
            ratio = outlook.ratio if outlook is not None and outlook.known else None
            sides += two_forces(look, signals, ratio)
    late = [one for one in late_force(look) if not _said(one, sides)]
    planned = [one for one in force_and_plan(look, outlook) if not _scaled((*known, *sides))]
    return [*found, *sides, *late, *planned, *thermometers(look)]


def _said(finding: Finding, others: Iterable[Finding]) -> bool:
    return any(finding.kind == other.kind and finding.channel == other.channel for other in others)


def _scaled(findings: Iterable[Finding]) -> bool:
    """Say whether the scale of force or stroke is doubted already."""
    return any(
        one.kind in _SCALE and one.effect == "spoils" and one.quantity != "temperature" for one in findings
    )
