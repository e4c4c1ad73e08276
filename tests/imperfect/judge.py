"""Compares an evaluation document with the truth of its record.

Rule for verdicts. Simple acceptance lets a value near its limit fall on either side: a verdict is false only
where the true value lies on the other side of the limit by more than 1.5 times the stated U (3 % of the limit
where no U is stated). `inconclusive` is never false; without fault, or with harmless ones only, it
is *needless*.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .chain import Scene
from .expected import Condition, conditions, of_the_run, window
from .truth import Interval, TrueCycle

MARGIN, WITHOUT_U = 1.5, 0.03
ENERGIES = ("stored_energy_J", "absorbed_energy_J", "damping")
STIFFNESS = ("tangent_stiffness_kN_per_mm", "secant_stiffness_kN_per_mm")
PLACES = ("stroke_min_mm", "stroke_max_mm", "prestress_mm", "amplitude_mm", "force_min_kN", "force_max_kN")
SPEEDS = ("speed_loading_max_mm_per_s", "speed_unloading_max_mm_per_s")
HARMONICS = (
    "frequency_Hz",
    "dynamic_stiffness_kN_per_mm",
    "storage_stiffness_kN_per_mm",
    "loss_stiffness_kN_per_mm",
    "loss_factor",
)
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
Finding = tuple[str, str, str]  # category, what, detail


@dataclass
class Judgement:
    """What the judge says of one record."""

    number: int
    kinds: list[str]
    findings: list[Finding] = field(default_factory=list)
    ratios: list[tuple[str, float]] = field(
        default_factory=list
    )  # figure, error / U; of those that must be within U
    seconds: float = 0.0  # processor time of import and evaluation
    refused: int = 0  # cycles on the record without figures
    whole: int = 0

    def say(self, category: str, what: str, detail: str) -> None:
        """Note a finding."""
        self.findings.append((category, what, detail))


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
        _figures(j, scene, run, pairs, disturbed=disturbed, silent=silent)
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
    regular = [c for c in scene.cycles if c.whole and _regular(scene, c)]
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


def _judged_figures(scene: Scene) -> list[str]:
    names = [*ENERGIES, *STIFFNESS, *PLACES]
    if scene.motion.kind != "static":
        names += [n for n in HARMONICS if scene.motion.shape != "trapezoid"]
    if scene.facts["what"] == "damper":
        names = [n for n in names if n not in {"tangent_stiffness_kN_per_mm"}]
    return [*names, *SPEEDS]


def _figures(  # noqa: PLR0912
    j: Judgement,
    scene: Scene,
    run: dict[str, Any],
    pairs: dict[int, dict[str, Any]],
    *,
    disturbed: bool,
    silent: list[str],
) -> None:
    """Hold figures against the truth: static ones by cycle, harmonic ones by the means of their steps."""
    by_number = {c.number: c for c in scene.cycles if c.whole}
    within = all(a.figures == "within" for a in scene.applied)
    rows: list[tuple[str, dict[str, tuple[float | None, float | None]], list[TrueCycle]]] = []
    if scene.motion.kind == "static":
        for number, cycle in pairs.items():
            us = cycle.get("expanded_uncertainty") or {}
            values = {name: (cycle.get(name), us.get(name)) for name in _judged_figures(scene)}
            rows.append((f"cycle {number}", values, [by_number[number]]))
    else:
        for label, summary in _summaries(run):
            used = summary.get("cycles_used") or []
            true = [by_number[n] for n, cycle in pairs.items() if cycle["index"] in used and n in by_number]
            if len(true) != len(used) or not true:
                continue
            if _differ([c for c in true if _step(scene, c) >= 0]):
                j.say("mixed", "steps that do not belong together are one mean", label)
                continue
            values = {}
            for name in _judged_figures(scene):
                entry = summary.get(name) or {}
                values[name] = (entry.get("value"), entry.get("expanded_uncertainty"))
            rows.append((label, values, true))
    if within:
        _contact(j, scene, run.get("first_contact") or {})
    chosen = scene.number % len(rows) if rows else 0
    for k, (label, values, true) in enumerate(rows):
        for name, (value, u) in values.items():
            if value is None or not all(name in c.figures for c in true):
                continue
            truth = _mean([c.figures[name] for c in true])
            off = max(truth[0] - value, value - truth[1], 0.0)
            if u is None:
                if within and scene.stated and not disturbed:
                    j.say("no U", name, label)
                continue
            if u == 0.0:
                j.say("U is 0", name, label)
                continue
            signed = (value - truth[1] if value > truth[1] else value - truth[0]) if off else 0.0
            if within and k == chosen:
                j.ratios.append((name, signed / u))
            scale = max(abs(truth[0]), abs(truth[1]))
            if within and off > 2.0 * u and off > 1e-4 * scale:
                j.say("gross", name, f"{label}: {value:.6g} ± {u:.2g}, true {truth[0]:.6g} to {truth[1]:.6g}")
            elif silent and off > 1.5 * u and off > 1e-3 * scale:
                j.say(
                    "silent",
                    f"{name} by {'+'.join(silent)}",
                    f"{label}: {value:.6g} ± {u:.2g}, true {truth[0]:.6g}",
                )


def _contact(j: Judgement, scene: Scene, found: dict[str, Any]) -> None:
    """Hold the place of first contact against the true one: where the seat begins to bear, or bears fully."""
    value, u = found.get("stroke_mm"), found.get("expanded_uncertainty")
    if value is None or not u:
        return
    low = float(scene.facts["zero_mm"])  # type: ignore[arg-type]
    off = max(low - value, 0.0) - max(value - low - float(scene.facts["seating_mm"]), 0.0)  # type: ignore[arg-type]
    j.ratios.append(("first contact", off / u))
    if abs(off) > 2.0 * u:
        j.say("gross", "first contact", f"{value:.4g} ± {u:.2g} mm, true {low:.4g}: {found.get('how')}")


def _mean(intervals: list[Interval]) -> Interval:
    return float(np.mean([a for a, _ in intervals])), float(np.mean([b for _, b in intervals]))


def _step(scene: Scene, c: TrueCycle) -> int:
    for i, (a, b) in enumerate(scene.motion.steps):
        if a - 0.3 <= c.top_s <= b + 0.3:
            return i
    return -1


def _differ(cycles: list[TrueCycle]) -> bool:
    """Say whether cycles are of steps that nobody would take for one."""
    ranges = {}
    for name, apart in (("prestress_mm", None), ("amplitude_mm", 0.1), ("frequency_Hz", 0.1)):
        values = [c.figures[name][0] for c in cycles]
        widest = max(values, default=0.0) - min(values, default=0.0)
        ranges[name] = widest > (2.0 if apart is None else apart * max(values, default=1.0))
    return any(ranges.values())


def _summaries(run: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    steps = run.get("steps") or []
    out = [(f"step {i + 1}", s.get("summary", s)) for i, s in enumerate(steps)]
    return out or [("run", run.get("summary") or {})]


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
        if abs(off) > 2.0 * u:
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
