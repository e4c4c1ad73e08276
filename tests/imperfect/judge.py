"""Compares an evaluation document with the truth of its record.

What is demanded is what docs/evaluation-document.md demands: no false verdict, none without
ground, strokes numbered as they happened, nothing averaged that does not belong together, each fault named,
no fault named that is none, figures within U. Each tolerance has its reason beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .chain import Scene
from .expected import begins_within
from .form import hold_form
from .history import hold_history
from .holding import hold_figures, regular
from .judgement import Judgement
from .naming import hold_names
from .other_tests import hold_other_tests
from .requirements import hold_requirements
from .truth import TrueCycle

# evaluation/cycles.md, "Steps": ends within 5 % of the range and frequencies within 5 % (harmonic), ends
# within 10 % and loading speeds within 25 % (static) are one step; a fifth more, for noise
HARMONIC_APART, STATIC_APART, SPEED_APART = 0.06, 0.12, 0.30


def judge(scene: Scene, document: dict[str, Any], said_at_import: list[str]) -> Judgement:
    """Compare the document of this record with its truth."""
    j = Judgement(scene.number, [a.name for a in scene.applied])
    if len(document.get("runs", [])) != 1 or document.get("failures"):
        j.say("crash", "no run in the document", str(document.get("failures"))[:300])
        return j
    run = document["runs"][0]
    disturbed = not all(a.harmless for a in scene.applied)
    hold_form(j, run, stated=bool(scene.stated))
    strokes = match(scene, run["cycles"])
    if all(a.name != "sign-stroke" for a in scene.applied):  # whose cycles run from top to top
        _cycles(j, scene, run, strokes, disturbed=disturbed)
        _averaged(j, scene, run, strokes)
    hold_figures(j, scene, run, strokes, disturbed=disturbed)
    hold_history(j, scene, run, strokes, disturbed=disturbed)
    if scene.motion.kind in {"impact", "proof"} or scene.facts["what"] == "draw-gear":
        hold_other_tests(j, scene, run, strokes, disturbed=disturbed)
    elif scene.motion.kind == "static":
        hold_requirements(j, scene, run, strokes, disturbed=disturbed)
    hold_names(j, scene, run, said_at_import, _true_time(scene))
    return j


def match(scene: Scene, found: list[dict[str, Any]]) -> dict[int, TrueCycle | None]:
    """Return the true cycle of each of the document's numbers, by the moment of its top; None: none."""
    back = _true_time(scene)
    out: dict[int, TrueCycle | None] = {}
    for cycle in found:
        if cycle["start_s"] is None or cycle["end_s"] is None:
            continue
        start, end = back(cycle["start_s"]), back(cycle["end_s"])
        inside = [c for c in scene.cycles if start <= 0.5 * (c.top_s + c.leaves_top_s) <= end]
        out[cycle["index"]] = inside[0] if len(inside) == 1 else None
    return out


def _true_time(scene: Scene) -> Callable[[float], float]:
    """Return the map from the record's stamps to true times."""
    order = np.argsort(scene.time_s, kind="stable")
    stamps, true = scene.time_s[order], scene.true_time_s[order]
    return lambda at: float(np.interp(at, stamps, true))


def _cycles(
    j: Judgement, scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None], *, disturbed: bool
) -> None:
    """Note cycles that are not found, are numbered otherwise, or have no figures."""
    by_true = {c.number: n for n, c in strokes.items() if c is not None}
    by_index = {c["index"]: c for c in run["cycles"]}
    wanted = [c for c in scene.cycles if c.closes and regular(scene, c)]
    j.whole = len(wanted)
    unknowable = begins_within(scene) or any(a.name == "lost-stroke" for a in scene.applied)
    for c in wanted:
        cycle = by_index.get(by_true.get(c.number, -1))
        blank = cycle is None or cycle.get("absorbed_energy_J") is None
        j.refused += blank
        if blank and not disturbed:
            why = "not found" if cycle is None else str(cycle.get("why"))[:160]
            j.say("needless", "cycle without figures", f"cycle {c.number} of {len(scene.cycles)}: {why}")
        elif (
            cycle is not None
            and scene.motion.kind == "static"
            and not unknowable
            and cycle["index"] != c.number
        ):
            j.say("numbering", "stroke number", f"true {c.number}, said {cycle['index']}")
    for cycle in run["cycles"]:
        complete = cycle.get("complete") and cycle.get("absorbed_energy_J") is not None
        if complete and strokes.get(cycle["index"]) is None:
            span = f"{cycle['start_s']:.3f} to {cycle['end_s']:.3f} s"
            j.say("numbering", "a cycle that is none, or several in one", f"cycle {cycle['index']}: {span}")


def _averaged(j: Judgement, scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None]) -> None:
    """Note means over cycles that do not belong together."""
    summaries = [(f"step {i + 1}", step) for i, step in enumerate(run.get("steps") or [])] or [("run", run)]
    for label, holder in summaries:
        used = (holder.get("summary") or {}).get("cycles_used") or []
        true = [c for n in used if (c := strokes.get(n)) is not None and c.figures.get("amplitude_mm")]
        apart = _apart(scene, true)
        if apart:
            j.say("mixed", "cycles that do not belong together are one mean", f"{label}: {apart}")


def _apart(scene: Scene, cycles: list[TrueCycle]) -> str:
    """Return in what cycles differ by more than one step may; nothing where they do not."""
    if len(cycles) < 2:
        return ""

    def widest(name: str) -> tuple[float, float]:
        values = [c.figures[name][0] for c in cycles if name in c.figures]
        return (max(values) - min(values), max(values)) if values else (0.0, 1.0)

    static = scene.motion.kind == "static"
    span = 2.0 * widest("amplitude_mm")[1]
    for end in ("stroke_min_mm", "stroke_max_mm"):
        if widest(end)[0] > (STATIC_APART if static else HARMONIC_APART) * span:
            return f"{end} by {widest(end)[0]:.3g} of {span:.3g} mm"
    name, share = ("speed_loading_max_mm_per_s", SPEED_APART) if static else ("frequency_Hz", HARMONIC_APART)
    if scene.motion.shape == "trapezoid":  # whose rests count for neither cycle
        return ""
    difference, largest = widest(name)
    return f"{name} by {difference:.3g} of {largest:.3g}" if difference > share * largest else ""
