"""Compares an evaluation document with the truth of its record.

Rule for verdicts. Simple acceptance lets a value near its limit fall on either side: a verdict is false only
where the true value lies on the other side of the limit by more than 1.5 times the stated U (3 % of the limit
where no U is stated). `inconclusive` is never false; without fault, or with harmless ones only, it
is *needless*.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from .chain import Scene
from .expected import Condition, conditions, of_the_run, window
from .holding import hold_figures
from .judgement import Judgement
from .truth import TrueCycle

MARGIN, WITHOUT_U = 1.5, 0.03
ALARMS = {
    "clip": r"clip|saturat",
    "held": r"\bh[eo]ld\b|fr[eo]ze|stuck",
    "jump": r"\bjump|slip",
    "drift": r"\bdrift",
    "unit": r"\bunit\b|implausib|not plausible",
    "sign": r"mostly negative|turned sign",
    "sensor": r"power-on|disconnect",
    "lost": r"\blost\b|\bgaps?\b",
}
PLACES_MM = {"force-at-25mm": 25.0, "force-at-60mm": 60.0, "force-at-100mm": 100.0}
STANDING = re.compile(r"no (expanded|conformance|comparison|mean|highest|uncertainty)")


def judge(scene: Scene, document: dict[str, Any], said_at_import: list[str]) -> Judgement:
    """Compare the document of this record with its truth."""
    j = Judgement(scene.number, [a.name for a in scene.applied])
    if len(document.get("runs", [])) != 1 or document.get("failures"):
        j.say("crash", "no run in the document", str(document.get("failures"))[:300])
        return j
    run = document["runs"][0]
    text = said(run, said_at_import)
    disturbed = bool(scene.applied) and not all(a.harmless for a in scene.applied)
    free = any(a.figures == "free" for a in scene.applied)
    silent = _named(j, scene, text, disturbed=disturbed)
    pairs = _match(scene, run["cycles"])
    _cycles(j, scene, run, pairs, disturbed=disturbed)
    if not free:
        hold_figures(j, scene, run, pairs, disturbed=disturbed, silent=silent)
        if scene.motion.kind == "static":
            _requirements(j, scene, run, disturbed=disturbed)
    return j


def said(run: dict[str, Any], at_import: list[str]) -> str:
    """Return what import and evaluation say of this record, without what they say of every record."""
    sentences = list(at_import) + [str(w) for w in run["warnings"]]
    sentences += _texts(run.get("plausibility"))
    sentences += [str(r["why"]) for r in run["requirements"] if r["verdict"] == "inconclusive"]
    return "\n".join(s for s in sentences if not STANDING.match(s))


def _texts(value: Any) -> list[str]:
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [f"{k}: {t}" for k, v in value.items() for t in _texts(v)]
    return [t for v in value for t in _texts(v)] if isinstance(value, list) else []


def _named(j: Judgement, scene: Scene, text: str, *, disturbed: bool) -> list[str]:
    """Note faults without a word about them; return their names. On a record without faults note alarms."""
    silent = []
    for a in scene.applied:
        if a.named_as and not re.search(a.named_as, text, re.IGNORECASE):
            silent.append(a.name)
            j.say("unnamed", a.name, a.size)
    if not scene.applied:
        words = text
        for name, pattern in ALARMS.items():
            hit = re.search(f".{{0,60}}(?:{pattern}).{{0,60}}", words, re.IGNORECASE)
            if hit:
                j.say("false alarm", name, hit.group(0))
    return silent


def _match(scene: Scene, found: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
    """Return the document's cycle for each true one, by the moment of the upper turn."""
    back = _stamp_shift(scene)
    out = {}
    for c in scene.cycles:
        if not c.whole:
            continue
        top = float(back(0.5 * (c.top_s + c.leaves_top_s)))
        for cycle in found:
            if cycle["start_s"] is not None and cycle["start_s"] < top < cycle["end_s"]:
                out[c.number] = cycle
    return out


def _stamp_shift(scene: Scene) -> Any:
    """Return the map from true times to the record's stamps."""
    order = np.argsort(scene.true_time_s, kind="stable")
    true, stamps = scene.true_time_s[order], scene.time_s[order]
    return lambda at: np.interp(at, true, stamps)


def _cycles(
    j: Judgement, scene: Scene, run: dict[str, Any], pairs: dict[int, dict[str, Any]], *, disturbed: bool
) -> None:
    """Note cycles that are not found, are numbered otherwise, or have no figures."""
    regular = [c for c in scene.cycles if c.closes and _regular(scene, c)]
    j.whole = len(regular)
    for c in regular:
        cycle = pairs.get(c.number)
        blank = cycle is None or cycle.get("absorbed_energy_J") is None
        j.refused += blank
        if blank and not disturbed:
            why = "not found" if cycle is None else str(cycle.get("why"))[:160]
            j.say("needless", "cycle without figures", f"cycle {c.number} of {len(scene.cycles)}: {why}")
        elif cycle is not None and scene.motion.kind == "static" and cycle["index"] != c.number:
            j.say("numbering", "stroke number", f"true {c.number}, said {cycle['index']}")
    complete = [c for c in run["cycles"] if c.get("complete") and c.get("absorbed_energy_J") is not None]
    if len(complete) > len(scene.cycles) and not disturbed:
        j.say("numbering", "more cycles than strokes", f"{len(complete)} of {len(scene.cycles)}")


def _regular(scene: Scene, c: TrueCycle) -> bool:
    if not scene.motion.steps:
        return True
    return any(c.start_s >= a and c.end_s <= b + 0.3 for a, b in scene.motion.steps)


def _requirements(j: Judgement, scene: Scene, run: dict[str, Any], *, disturbed: bool) -> None:
    """Hold every row of the requirements against what the truth allows."""
    by_number = {c.number: c for c in scene.cycles}
    zero_mm = sum(float(a.size.split()[0]) for a in scene.applied if a.name == "zero-off")
    whole_run = of_the_run(scene)
    within = all(a.figures == "within" for a in scene.applied)
    for row in run["requirements"]:
        name, verdict, number = row["id"], row["verdict"], row["cycle"]
        label = f"{name} of stroke {number}" if number is not None else name
        detail = f"{verdict}, measured {row['measured']}, why: {row['why']}"
        if number is not None and number not in by_number:
            if name == "temperature-range" and verdict in {"pass", "fail", "invalid"}:
                j.say("numbering", "there is no such stroke", f"{label}: {detail}")
            continue
        if name in whole_run or (number is not None and name in _names(by_number[number], scene, zero_mm)):
            condition = whole_run.get(name) or conditions(scene, by_number[number], zero_mm).get(name)
            if condition is None:
                continue
            if not condition.allows(verdict, disturbed=disturbed):
                category = {"pass": "false pass", "fail": "false fail"}.get(verdict, "needless")
                j.say(category, label, f"truth {condition.state}, shown {condition.shown}: {detail}")
            continue
        if number is None or name not in by_number[number].readings:
            continue
        cycle = by_number[number]
        governing = {**whole_run, **conditions(scene, cycle, zero_mm)}
        _requirement(j, row, cycle, governing, label, detail, disturbed=disturbed, within=within)


def _names(cycle: TrueCycle, scene: Scene, zero_mm: float) -> set[str]:
    return set(conditions(scene, cycle, zero_mm)) | {"pause-limit"}


def _requirement(  # noqa: PLR0912
    j: Judgement,
    row: dict[str, Any],
    cycle: TrueCycle,
    governing: dict[str, Condition],
    label: str,
    detail: str,
    *,
    disturbed: bool,
    within: bool,
) -> None:
    name, verdict = row["id"], row["verdict"]
    true = cycle.readings[name]
    if within and None not in (true, row["measured"], row["expanded_uncertainty"]):
        off, u = row["measured"] - true, row["expanded_uncertainty"]
        if cycle.number == 1 + j.number % 3:
            j.ratios.append((f"requirement {name}", off / u))
        if abs(off) > 2.0 * u and cycle.open_J < 1e-4 * (cycle.readings["stored-energy"] or 0.0):
            j.say(
                "gross",
                f"requirement {name}",
                f"stroke {cycle.number}: {row['measured']:.6g} ± {u:.2g}, true {true:.6g}",
            )
    others = {k: c for k, c in governing.items() if k != "full-stroke"}
    broken = [k for k, c in others.items() if c.state == "broken"]
    maybe = [k for k, c in others.items() if c.state == "near"]
    unknown = [k for k, c in others.items() if c.shown == "no"]
    perhaps = [k for k, c in others.items() if c.shown == "perhaps"]
    short = governing["full-stroke"].shown
    if true is None:
        if verdict in {"pass", "fail"} and short == "no":
            j.say(f"false {verdict}", label, f"the stroke was not reached: {detail}")
        return
    low, high = window(cycle.number, name)
    limits = [v for v in (low, high) if np.isfinite(v)]
    u = row["expanded_uncertainty"]
    margin = MARGIN * u if u is not None else WITHOUT_U * max(abs(v) for v in limits)
    if name == "absorbed-energy-ratio":
        margin += cycle.open_J / max(cycle.readings["stored-energy"] or 1.0, 1.0)
    distance = min((true - low), (high - true))  # positive: within the limits
    side = "near" if abs(distance) <= margin else "pass" if distance > 0 else "fail"
    why = f"true {true:.5g}, limits {low:g} to {high:g}, ± {u}: {detail}"
    if verdict == "pass":
        if side == "fail":
            j.say("false pass", label, why)
        elif broken or unknown:
            j.say("false pass", label, f"{', '.join(broken + unknown)} broken or not shown: {why}")
        elif name == "absorbed-energy-ratio" and short == "no":
            j.say("false pass", label, f"short of full stroke: {why}")
    elif verdict == "fail":
        if side == "pass":
            j.say("false fail", label, why)
        elif broken:
            j.say("false fail", label, f"invalid it is, by {broken}: {why}")
        elif name in {"absorbed-energy-ratio", "stored-energy"} and short == "no":
            j.say("false fail", label, f"short of full stroke: {why}")
    elif verdict == "invalid":
        if not broken and not maybe:
            j.say("false fail", label, f"invalid without a broken condition: {why}")
    elif not disturbed and not (broken or maybe or unknown or perhaps):
        reached = name not in {"absorbed-energy-ratio", "stored-energy"} or short == "yes"
        place = PLACES_MM.get(name)
        top = cycle.figures.get("stroke_max_mm", (0.0, 0.0))[1]
        if reached and cycle.whole and (place is None or top > place + 1.0):
            j.say("needless", label, why)
