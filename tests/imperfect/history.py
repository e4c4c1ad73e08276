"""Holds what a record holds besides against its truth: cumulated energy, residual strokes, settling.

Reading of evaluation/figures.md, "Holds": a residual stroke is what stays of the stroke, the
end of its unloading less the beginning of its loading; U of a settling is that of the change from the first
cycle to the last.
"""

from __future__ import annotations

from typing import Any

from .chain import Scene
from .figures import Interval
from .holding import compare, falsified
from .judgement import Judgement
from .requirements import error, hidden
from .truth import TrueCycle

SETTLING = ("absorbed_energy_J", "stored_energy_J", "damping", "tangent_stiffness_kN_per_mm")


def hold_history(
    j: Judgement,
    scene: Scene,
    run: dict[str, Any],
    strokes: dict[int, TrueCycle | None],
    *,
    disturbed: bool,
) -> None:
    """Compare each of the three with the truth."""
    _cumulated(j, scene, run, strokes, disturbed=disturbed)
    for entry in run.get("residual_strokes") or []:
        true, u = strokes.get(entry["cycle"]), entry.get("expanded_uncertainty")
        if true is None or not true.whole or entry["residual_mm"] is None or not u:
            continue
        # a stand that dips below its rest ends the stroke at the dip or at the rest; after the last stroke it
        # rests until the record's end
        rest_mm = float(scene.true_stroke()[-1])
        after = next((c.residual_mm for c in scene.cycles if c.number == true.number + 1), rest_mm)
        stays = sorted((true.left_mm - true.residual_mm, after - true.residual_mm))
        truth = (stays[0], stays[1])
        _hold(j, scene, "residual_mm", entry["residual_mm"], u, truth, (true.start_s, true.end_s))
    for entry in run.get("settling") or []:
        name, u = entry["quantity"], entry.get("expanded_uncertainty")
        first, last = strokes.get(entry["first_cycle"]), strokes.get(entry["last_cycle"])
        if name not in SETTLING or first is None or last is None or not u or hidden(scene, name):
            continue
        if name not in first.figures or name not in last.figures:
            continue
        change = last.figures[name][0] - first.figures[name][0]
        span = (first.start_s, last.end_s)
        said = entry["last"] - entry["first"]
        _hold(j, scene, f"settling {name}", said, u, (change, change), span, of=name)


def _cumulated(
    j: Judgement, scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None], *, disturbed: bool
) -> None:
    found = run.get("cumulated_energy_J") or {}
    counted = [c["index"] for c in run["cycles"] if c.get("absorbed_energy_J") is not None]
    true = [c for n in counted if (c := strokes.get(n)) is not None and "absorbed_energy_J" in c.figures]
    name = "absorbed_energy_J"
    if found.get("absorbed") is None or not true or hidden(scene, name):
        return
    if len(true) != len(counted) or len(true) != found.get("cycles"):
        return
    total = sum(c.figures[name][0] for c in true)
    spans, u = [(c.start_s, c.end_s) for c in true], found.get("expanded_uncertainty")
    truth = (total, total)
    compare(j, scene, name, "cumulated", found["absorbed"], u, truth, spans, disturbed=disturbed)
    if u and not falsified(scene, name, spans):
        j.ratios.append(("cumulated energy, U", error(found["absorbed"], truth) / u))


def _hold(
    j: Judgement,
    scene: Scene,
    label: str,
    value: float,
    u: float,
    truth: Interval,
    span: tuple[float, float],
    of: str = "stroke_min_mm",
) -> None:
    """Count a difference within one record for the coverage, and note one beyond 2 U."""
    if falsified(scene, of, [span]) or hidden(scene, of):
        return
    off = error(value, truth)
    j.ratios.append((f"{label}, U", off / u))
    if abs(off) > max(2.0 * u, 1e-4 * scene.span_mm if label == "residual_mm" else 0.0):
        j.say("gross", label, f"{value:.5g} ± {u:.2g}, true {truth[0]:.5g}")
