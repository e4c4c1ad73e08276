"""The force against the second force: one load cell, two amplifiers."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, log

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import SECOND, SETTING, doubt
from bufferstand.evaluation.plausibility.signal_comparison.force_changes import ForceChange, jumped
from bufferstand.evaluation.plausibility.signal_comparison.signal_fit import (
    SignalFit,
    fitted,
    lateness,
    shown,
    still_from,
)
from bufferstand.evaluation.record import Signals

FACTOR = 0.05
"""The forces may differ by this share: ten times what accuracies of 0.5 % and what wires do explain."""
ZERO_SHARE = 0.01
"""Their zeros may differ by this share of the stand's force (or, unknown, of the run's greatest) …"""
ZERO_STATED = 3.0
"""… and by so many times the zeros that both state."""
LEAST_KN, LEAST_SHARE = 5.0, 0.01
"""A force that moves less, and less than this share of the stand's range, tells nothing."""
LEAST_STROKE_MM = 2.0
FEWEST = 20
"""So many instants at least at which both forces have samples."""
ROUNDING_KN = 1e-9
"""What interpolating one and the same value leaves."""
STILL = 0.02
"""A force that moves by less than this share of the other one stands still."""
FOLLOWS, AT_ALL = 0.05, 0.3
"""Left of a force by a line through the other: less says that it follows, more that it does not at all."""
NEARER = 0.6
"""The right force is nearer to what the plan expected by this, in the logarithm of the ratio (1.8 times)."""
BETTER = 0.5
BLURRED = 0.4
"""Stamps that wander take of the factor: up to so much is not told from them."""
LEAST_LATE_S = 0.02
"""The amplifier's own delay is known to some ms."""


def dead_force(look: RunView) -> list[Finding]:
    """Return whether the force stands still from the first to the last sample though the specimen is moved.

    Parameters
    ----------
    look : Look
    """
    force, stroke = look.samples.force_kN, look.samples.stroke_mm
    if force.size < 2 or float(np.ptp(force)) > ROUNDING_KN or float(np.ptp(stroke)) < LEAST_STROKE_MM:
        return []
    text = (
        f"force stands still at {float(force[0]):.4g} kN from the first to the last sample while the "
        f"stroke moves by {float(np.ptp(stroke)):.3g} mm: cut off or frozen; {_where('force')}"
    )
    return [doubt(look, "frozen", "force", float(np.ptp(stroke)), "mm", text)]


def two_forces(look: RunView, signals: Signals, expected: float | None) -> list[Finding]:
    """Return how the second force belies the first.

    Parameters
    ----------
    look : Look
    signals : Signals
    expected : float, optional
        The run's greatest force as a multiple of what the plan expected, where that is known: says which of
        two forces is the wrong one.
    """
    one, two = signals.get("force"), signals.get("force_2")
    if one is None or two is None:
        return []
    both = signals.both("force", "force_2")
    if np.count_nonzero(both) < FEWEST:
        return []
    time_s, one, two = signals.time_s[both], one[both], two[both]
    stand_kN = look.facts.force_limit_kN
    least = max(LEAST_KN, LEAST_SHARE * (stand_kN or 0.0))
    if max(float(np.ptp(one)), float(np.ptp(two))) < least:
        return []
    still = _still(look, time_s, {"force": one, "force_2": two})
    if still:
        return still
    strokes = [signals.by_name[name][both] for name in signals.strokes]
    jump = jumped(time_s, one, two, strokes[0] if strokes else None)
    if jump is None or abs(jump.size_kN) < _moves_kN(time_s, one, signals.loose_s):
        return _followed(look, time_s, one, two, expected, signals.loose_s)
    parts = slice(None, jump.at), slice(jump.at + 1, None)
    longer = max(parts, key=lambda part: time_s[part].size)
    rest = _followed(look, time_s[longer], one[longer], two[longer], expected, signals.loose_s)
    return [_jumped(look, jump), *(finding for finding in rest if finding.kind != "zero")]


def _still(look: RunView, time_s: FloatArray, forces: Mapping[str, FloatArray]) -> list[Finding]:
    """Return the force that stands still, always or from a time on, while the other one moves."""
    for (name, own), (other_name, other) in (
        tuple(forces.items()),
        tuple(reversed(tuple(forces.items()))),
    ):
        moved, moved_other = float(np.ptp(own)), float(np.ptp(other))
        if moved < STILL * moved_other:
            text = (
                f"{name} stands still ({moved:.3g} kN) while {other_name} moves by {moved_other:.4g} "
                f"kN: cut off, frozen or scaled to nothing; {_where(name)}"
            )
            return [_doubt(look, "frozen", name, moved_other, "kN", text)]
        since_s = still_from(time_s, own, other)
        if since_s is not None:
            text = (
                f"{name} stands still from {since_s:.4g} s on while {other_name} moves: cut off or frozen; "
                f"{_where(name)}"
            )
            return [_doubt(look, "frozen", name, since_s, "s", text)]
    return []


def _jumped(look: RunView, jump: ForceChange) -> Finding:
    """Return the force that has jumped; where that cannot be told, both."""
    if not jump.name:
        text = (
            f"force_2 jumped by {jump.size_kN:+.3g} kN against force at {jump.at_s:.4g} s; which of both it "
            f"was cannot be told: the zero or the scale of one of them has changed; {_where('')}"
        )
        return _doubt(look, "zero", "force", jump.size_kN, "kN", text)
    other = "force" if jump.name == "force_2" else "force_2"
    text = (
        f"{jump.name} jumped by {jump.size_kN:+.3g} kN at {jump.at_s:.4g} s, and stroke and {other} did not: "
        f"its zero or its scale has changed; {_where(jump.name)}"
    )
    return _doubt(look, "zero", jump.name, jump.size_kN, "kN", text)


def _followed(
    look: RunView,
    time_s: FloatArray,
    one: FloatArray,
    two: FloatArray,
    expected: float | None,
    loose_s: float,
) -> list[Finding]:
    """Return how the second force follows the first: late, not at all, by a factor, with a zero.

    No finer than the stamps of the second one allow, which wander by ``loose_s``.
    """
    fit = fitted(one, two)
    if fit is None:
        return []
    blurred = FOLLOWS < fit.left < _by_stamps(time_s, one, loose_s)
    if blurred and abs(fit.factor - 1.0) < BLURRED:
        return []
    late = lateness(time_s, one, two) if fit.left > FOLLOWS else None
    found = []
    if late is not None and abs(late[0]) > LEAST_LATE_S + loose_s and late[1].left < BETTER * fit.left:
        found.append(_late(look, late[0]))
        if late[1].left <= AT_ALL:
            return found  # what delays smooths as well, and so takes from the factor
    if fit.left > AT_ALL:
        text = (
            f"force and force_2 do not follow each other ({fit.left:.0%} of force_2 is not in force): one of "
            f"them measures something else; look at both cables and at the channels of the stand file"
        )
        return [*found, _doubt(look, "not-following", "force", fit.left, "", text)]
    return found + _scale_or_zero(look, fit, one, expected)


def _moves_kN(time_s: FloatArray, force: FloatArray, loose_s: float) -> float:  # noqa: N802 - a unit
    """Return the most by which a force changes within the time by which stamps are wrong [kN]."""
    return float(np.max(np.abs(np.interp(time_s + loose_s, time_s, force) - force)))


def _by_stamps(time_s: FloatArray, force: FloatArray, loose_s: float) -> float:
    """Return which share of a force stamps that are wrong by ``loose_s`` [s] leave of it, at most."""
    moved = np.interp(time_s + loose_s, time_s, force) - force
    spread = float(np.std(force))
    return float(np.sqrt(np.mean(moved**2))) / spread if spread > 0.0 else 0.0


def _late(look: RunView, late_s: float) -> Finding:
    name, other = ("force_2", "force") if late_s > 0.0 else ("force", "force_2")
    text = (
        f"{name} comes {abs(late_s):.3g} s later than {other}: look at the filter of its amplifier and at "
        f"its delay_s ({SECOND if name == 'force_2' else SETTING})"
    )
    return _doubt(look, "delay", name, abs(late_s), "s", text)


def _scale_or_zero(look: RunView, fit: SignalFit, one: FloatArray, expected: float | None) -> list[Finding]:
    """Return a factor other than 1, else a zero other than 0."""
    if abs(fit.factor - 1.0) > FACTOR:
        return [_scaled(look, fit.factor, expected)]
    stated = look.facts.force_uncertainty
    limit_kN = ZERO_SHARE * (look.facts.force_limit_kN or float(np.max(np.abs(one))))
    limit_kN = max(limit_kN, 2.0 * ZERO_STATED * ((stated.zero if stated else None) or 0.0))
    if abs(fit.zero) <= limit_kN:
        return []
    text = (
        f"force_2 less force is {fit.zero:+.3g} kN throughout: the zero of one of them is off; unload the "
        f"specimen and set both zeros ({SETTING}, {SECOND})"
    )
    return [_doubt(look, "zero", "force", fit.zero, "kN", text)]


def _scaled(look: RunView, factor: float, expected: float | None) -> Finding:
    """Return which force is of another factor or sign: as a multiple of the other one."""
    name = _wrong_one(factor, expected)
    own, other = ("force", "force_2") if name == "force" else ("force_2", "force")
    size = 1.0 / factor if name == "force" and factor != 0.0 else factor
    what = f"{own} is {shown(size)} of {other}"
    if size <= 0.0:
        by = f", by {shown(size)}" if size < 0.0 and abs(size + 1.0) > FACTOR else ""
        what = f"{own} falls as {other} rises{by}"
    which = f"by what the plan expected, {name} is scaled wrong" if name else "one of them is scaled wrong"
    kind = "scale" if size > 0.0 else "sign"
    return _doubt(look, kind, name or "force", size, "", f"{what}: {which}; {_where(name)}")


def _wrong_one(factor: float, expected: float | None) -> str:
    """Return which force is the wrong one by the plan's expectation; empty where it cannot be told."""
    if expected is None:
        return ""
    own, second = (abs(log(ratio)) if ratio > 0.0 else inf for ratio in (expected, expected * factor))
    if own == second or abs(own - second) < NEARER:
        return ""
    return "force" if own > second else "force_2"


def _where(name: str) -> str:
    places = {"force": SETTING, "force_2": SECOND}
    return f"look at the calibration in {places.get(name, f'{SETTING} and {SECOND}')}, and at the cell's plug"


def _doubt(look: RunView, kind: str, channel: str, size: float | None, unit: str, text: str) -> Finding:
    effect = "noted" if channel == "force_2" else "spoils"
    return doubt(look, kind, channel, size, unit, text, effect=effect)  # type: ignore[arg-type]
