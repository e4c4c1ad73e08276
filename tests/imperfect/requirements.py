"""Holds every row of the requirements against what the truth allows.

Rule for verdicts. By simple acceptance (contract, section 4) the value alone decides, so a row whose true
value is within U of a limit may fall on either side. An error beyond U is not excluded either (5 of 100
figures may have one), but for a verdict it must be rare and counted: from 1 to 1.5 U on the wrong side it
is noted ("beyond U"), and the study holds the number of such rows against what honest U's would make;
beyond 1.5 U (three standard uncertainties: one in 700 to one side, and only for the few rows whose truth
lies so near a limit) it is a false verdict.
"""

from __future__ import annotations

from math import erfc, isfinite, sqrt
from typing import Any

from .chain import Scene
from .expected import Condition, begins_within, conditions, of_the_run, window
from .figures import Interval
from .judgement import Judgement
from .truth import TrueCycle

MARGIN = 1.5
# Where the laboratory states nothing there is no U: this world's chain then has no errors but noise, and what
# gaps may change (contract, section 4: 0.5 % of the absorbed energy)
WITHOUT_U, NOISES = 0.005, 3.0
PLACES_MM = {"force-at-25mm": 25.0, "force-at-60mm": 60.0, "force-at-100mm": 100.0}
CONDITIONS = (
    "cycle-count",
    "rest-after-assembly",
    "temperature-range",
    "speed-limit",
    "pause-limit",
    "immediate-unloading",
    "full-release",
    "full-stroke",
)


def hold_requirements(
    j: Judgement, scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None], *, disturbed: bool
) -> None:
    """Note false verdicts; `strokes` are the true ones by the document's numbers, None: there is none."""
    whole_run = of_the_run(scene)
    for row in run["requirements"]:
        name, verdict, number = row["id"], row["verdict"], row["cycle"]
        label = f"{name} of stroke {number}" if number is not None else name
        detail = f"{verdict}, measured {row['measured']}, why: {row['why']}"
        if hidden(scene, name):
            continue
        if number is None:
            if name in whole_run and not whole_run[name].allows(verdict, disturbed=disturbed):
                _say(j, whole_run[name], verdict, label, detail)
            continue
        cycle = strokes.get(number)
        if cycle is None:
            if verdict in {"pass", "fail", "invalid"} and number in strokes:
                j.say("numbering", "there is no such stroke", f"{label}: {detail}")
            continue
        governing = conditions(scene, cycle)
        if name in CONDITIONS:
            condition = governing.get(name)
            if condition is None:  # a pause before the first stroke
                continue
            if not condition.allows(verdict, disturbed=disturbed):
                _say(j, condition, verdict, label, detail)
        elif name in cycle.readings:
            known = {
                k: Condition("near", "perhaps") if hidden(scene, k) else c
                for k, c in {**whole_run, **governing}.items()
            }
            _requirement(j, scene, row, cycle, known, label, detail, disturbed=disturbed)


def hidden(scene: Scene, name: str) -> bool:
    """Return whether a fault that no record can show falsifies this figure or requirement."""
    return any(a.figures == "hidden" and a.touches(name) for a in scene.applied)


def _say(j: Judgement, condition: Condition, verdict: str, label: str, detail: str) -> None:
    category = {"pass": "false pass", "fail": "false fail", "invalid": "false fail"}.get(verdict, "needless")
    j.say(category, label, f"truth {condition.state}, shown {condition.shown}: {detail}")


def _requirement(
    j: Judgement,
    scene: Scene,
    row: dict[str, Any],
    cycle: TrueCycle,
    governing: dict[str, Condition],
    label: str,
    detail: str,
    *,
    disturbed: bool,
) -> None:
    name, verdict = row["id"], row["verdict"]
    true = cycle.readings[name]
    others = {k: c for k, c in governing.items() if k != "full-stroke"}
    short = governing["full-stroke"].shown
    if true is None:
        if verdict in {"pass", "fail"} and short == "no":
            j.say(f"false {verdict}", label, f"the stroke was not reached: {detail}")
        return
    low, high = window(cycle.number, name)
    why = f"true {true[0]:.5g}, limits {low:g} to {high:g}, ± {row['expanded_uncertainty']}: {detail}"
    if name in cycle.unknown:
        if verdict == "fail" or (verdict == "pass" and not (name == "stored-energy" and true[0] > low)):
            j.say(f"false {verdict}", label, f"what it needs is not on record: {why}")
        return
    if verdict in {"pass", "fail"}:
        u = uncertainty(scene, row, true, min(abs(v) for v in (low, high) if isfinite(v)))
        within = [min(v - low, high - v) for v in true]  # of either reading; positive: within the limits
        false = _decided(name, verdict, within, others, short, u)
        if false is None:
            _founded(j, scene, row, true, u, label, why)
            _count_chance(j, max(within) if max(within) < 0.0 else min(within), u, verdict, label, why)
        else:
            j.say(f"false {verdict}", label, f"{false}{why}")
    elif verdict == "invalid":
        if not any(c.state in {"broken", "near"} for c in others.values()):
            j.say("false fail", label, f"invalid without a broken condition: {why}")
    elif not disturbed and all(c.state == "ok" and c.shown == "yes" for c in others.values()):
        _needless(j, scene, name, true, cycle, short, label, why)


def _decided(
    name: str, verdict: str, within: list[float], others: dict[str, Condition], short: str, u: float
) -> str | None:
    """Return why a pass or a fail is false; None where it is not."""
    if max(within) < -MARGIN * u if verdict == "pass" else min(within) > MARGIN * u:
        return ""
    broken = [k for k, c in others.items() if c.state == "broken"]
    unknown = [k for k, c in others.items() if c.shown == "no"]
    if broken or unknown:
        return f"broken: {', '.join(broken) or 'none'}, not shown: {', '.join(unknown) or 'none'}; "
    needs_it = ("absorbed-energy-ratio",) if verdict == "pass" else ("absorbed-energy-ratio", "stored-energy")
    if name in needs_it and short == "no":
        return "short of full stroke: "
    return None


def _needless(
    j: Judgement,
    scene: Scene,
    name: str,
    true: Interval,
    cycle: TrueCycle,
    short: str,
    label: str,
    why: str,
) -> None:
    """Note a row that could have been decided."""
    if name in {"absorbed-energy-ratio", "stored-energy"} and short != "yes":
        return
    if name == "absorbed-energy-ratio" and begins_within(scene):
        limits = (window(1, name)[0], window(2, name)[0])
        if any(min(limits) - 0.02 < v < max(limits) + 0.02 for v in true):
            return  # which stroke this was nobody knows, and it matters
    place, top = PLACES_MM.get(name), cycle.figures.get("stroke_max_mm", (0.0, 0.0))[1]
    if cycle.closes and (place is None or top > place + 1.0):
        j.say("needless", label, why)


def uncertainty(scene: Scene, row: dict[str, Any], true: Interval, limit: float) -> float:
    """Return the row's U; what noise and gaps may do where the laboratory states nothing."""
    if row["expanded_uncertainty"] is not None:
        return float(row["expanded_uncertainty"])
    noise = NOISES * float(str(scene.facts["noise_kN"])) if row["unit"] == "kN" else 0.0
    return WITHOUT_U * max(limit, abs(true[0])) + noise


def error(value: float, true: Interval) -> float:
    """Return by how much a value lies outside of what is true, with its sign."""
    return max(value - true[1], 0.0) - max(true[0] - value, 0.0)


def _founded(
    j: Judgement, scene: Scene, row: dict[str, Any], true: Interval, u: float, label: str, why: str
) -> None:
    """Note a verdict that is right by luck: its figure is read from what a fault spoiled."""
    if row["measured"] is None:
        j.say("unfounded", label, f"without a measured value: {why}")
        return
    off = error(row["measured"], true)
    if abs(off) > 2.0 * max(u, 1e-3 * abs(true[0])) and any(a.touches(row["id"]) for a in scene.applied):
        j.say("unfounded", label, why)


def _count_chance(j: Judgement, distance: float, u: float, verdict: str, label: str, why: str) -> None:
    """Note verdicts on the wrong side by 1 to 1.5 U, and how many of them honest U's would make."""
    d = abs(distance) / u if u > 0.0 else 0.0
    if not 1.0 < d <= MARGIN or verdict not in {"pass", "fail"}:
        return
    j.chance += 0.5 * erfc(2.0 * d / sqrt(2.0))
    if (verdict == "pass") != (distance > 0.0):
        j.say("beyond U", label, why)
