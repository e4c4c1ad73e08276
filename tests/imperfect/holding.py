"""Holds the figures of a document against the truth of its record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .chain import Scene
from .figures import Interval
from .judgement import Judgement
from .truth import TrueCycle

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


@dataclass(frozen=True)
class Row:
    """Figures of a cycle, or means of a run or a step, beside the true cycles that they are of."""

    label: str
    values: dict[str, tuple[float | None, float | None]]  # value and U, by figure
    halves: dict[str, float]  # half-width of the interval that shall hold the truth in 95 of 100 records
    true: list[TrueCycle]


def hold_figures(
    j: Judgement,
    scene: Scene,
    run: dict[str, Any],
    pairs: dict[int, dict[str, Any]],
    *,
    disturbed: bool,
    silent: list[str],
) -> None:
    """Note what is off by more than twice its U, or without a word; keep what coverage is counted from."""
    within = all(a.figures == "within" for a in scene.applied)
    if within:
        _contact(j, scene, run.get("first_contact") or {})
    for row in [*_means(j, scene, run, pairs), *_by_cycle(scene, pairs)]:
        for name, (value, u) in row.values.items():
            if value is None or not all(name in c.figures for c in row.true):
                continue
            truth = _mean([c.figures[name] for c in row.true])
            off = max(value - truth[1], 0.0) - max(truth[0] - value, 0.0)
            scale = max(abs(truth[0]), abs(truth[1]))
            said = f"{row.label}: {value:.6g} ± {u or 0.0:.2g}, true {truth[0]:.6g} to {truth[1]:.6g}"
            if within and name in row.halves:
                j.ratios.append((name, off / row.halves[name]))
            if u is None or u == 0.0:
                if within and scene.stated and not disturbed:
                    j.say("no U", name, said)
            elif within and abs(off) > max(2.0 * u, 1e-4 * scale):
                j.say("gross", name, said)
            elif silent and abs(off) > max(1.5 * u, 1e-3 * scale):
                j.say("silent", f"{name} by {'+'.join(silent)}", said)


def _judged(scene: Scene) -> list[str]:
    names = [*ENERGIES, *STIFFNESS, *PLACES, *SPEEDS]
    if scene.motion.kind != "static" and scene.motion.shape != "trapezoid":
        names += HARMONICS
    return [n for n in names if scene.facts["what"] != "damper" or n != "tangent_stiffness_kN_per_mm"]


def _means(
    j: Judgement, scene: Scene, run: dict[str, Any], pairs: dict[int, dict[str, Any]]
) -> Iterator[Row]:
    """Means of the run or of its steps; one of them, by the record's number, counts for coverage."""
    summaries = [(f"step {i + 1}", step) for i, step in enumerate(run.get("steps") or [])] or [("run", run)]
    for k, (label, holder) in enumerate(summaries):
        summary = holder.get("summary") or {}
        used = summary.get("cycles_used") or []
        true = [c for c in scene.cycles if c.number in pairs and pairs[c.number]["index"] in used]
        if not true or len(true) != len(used):
            continue
        if _differ([c for c in true if _step(scene, c) >= 0]):
            j.say("mixed", "steps that do not belong together are one mean", label)
            continue
        entries = {name: summary.get(name) or {} for name in _judged(scene)}
        values = {name: (e.get("value"), e.get("expanded_uncertainty")) for name, e in entries.items()}
        halves = holder.get("half_width_95") or {} if k == scene.number % len(summaries) else {}
        yield Row(label, values, {n: h for n, h in halves.items() if h}, true)


def _by_cycle(scene: Scene, pairs: dict[int, dict[str, Any]]) -> Iterator[Row]:
    """Figures of each cycle of a static run."""
    if scene.motion.kind != "static":
        return
    for number, cycle in pairs.items():
        us = cycle.get("expanded_uncertainty") or {}
        values = {name: (cycle.get(name), us.get(name)) for name in _judged(scene)}
        yield Row(f"cycle {number}", values, {}, [c for c in scene.cycles if c.number == number])


def _contact(j: Judgement, scene: Scene, found: dict[str, Any]) -> None:
    """Hold the place of first contact against the true one: where the seat begins to bear or bears all."""
    value, u = found.get("stroke_mm"), found.get("expanded_uncertainty")
    if value is None or not u:
        return
    low, seating = float(str(scene.facts["zero_mm"])), float(str(scene.facts["seating_mm"]))
    off = max(value - low - seating, 0.0) - max(low - value, 0.0)
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
