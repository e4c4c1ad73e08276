"""Holds the figures of a document against the truth of its record.

Every figure is held that no fault falsifies where it was read; its error over U counts for the coverage,
and more than 2 U (four standard uncertainties) is "gross". A figure that a fault falsifies is compared,
too: wrong by more than 1.5 U it is "spoilt" where it states a U (docs/plausibility.md: it has none
then), and shows that the fault must be named.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .chain import Scene, Stated
from .figures import Interval
from .judgement import Judgement
from .requirements import WITHOUT_U, error, hidden
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
TEMPERATURES = {"temperature_start_C": "start", "temperature_max_C": "max"}
# evaluation/samples.md: averaging leaves 1e-4 of the amplitude of an extreme force: that is no error of U
LEFT = 1e-4
COVER_S = 15.0


@dataclass(frozen=True)
class Row:
    """Figures of a cycle, or means of a run or a step, beside the true cycles that they are of."""

    label: str
    values: dict[str, tuple[float | None, float | None]]  # value and U, by figure
    halves: dict[str, float]  # half-width of the interval that shall hold the truth in 95 of 100 records
    true: list[TrueCycle]
    counts: bool  # for the coverage: one row of a record, lest one chain's error counts many times


def hold_figures(
    j: Judgement,
    scene: Scene,
    run: dict[str, Any],
    strokes: dict[int, TrueCycle | None],
    *,
    disturbed: bool,
) -> None:
    """Compare every figure with the truth."""
    for row in [*_means(scene, run, strokes), *_by_cycle(scene, run, strokes)]:
        spans = [(c.start_s, c.end_s) for c in row.true]
        for name, (value, u) in row.values.items():
            if not all(name in c.figures for c in row.true) or hidden(scene, name):
                continue
            if value is None:
                continue
            truth = _mean([c.figures[name] for c in row.true])
            compare(j, scene, name, row.label, value, u, truth, spans, disturbed=disturbed)
            if row.counts and not falsified(scene, name, spans):
                off = error(value, truth)
                if u:
                    j.ratios.append((f"{row.label.split()[0]} {name}, U", off / u))
                if name in row.halves:
                    j.ratios.append((f"{row.label.split()[0]} {name}, half_width_95", off / row.halves[name]))
    _extremes(j, scene, run, disturbed=disturbed)
    _temperatures(j, scene, strokes, run)
    _contact(j, scene, run.get("first_contact") or {})
    _rows(j, scene, run, strokes, disturbed=disturbed)


def falsified(scene: Scene, name: str, spans: list[Interval]) -> bool:
    """Return whether a fault falsifies this figure in one of the stretches that it is read from."""
    return any(a.touches(name) and a.overlaps(*span) for a in scene.applied for span in spans)


def compare(
    j: Judgement,
    scene: Scene,
    name: str,
    label: str,
    value: float,
    u: float | None,
    truth: Interval,
    spans: list[Interval],
    *,
    disturbed: bool,
) -> None:
    """Note a figure that is wrong; keep what shows that a fault has an effect, or none."""
    off, scale = error(value, truth), max(abs(truth[0]), abs(truth[1]))
    said = f"{label}: {value:.6g} ± {u or 0.0:.2g}, true {truth[0]:.6g} to {truth[1]:.6g}"
    false = falsified(scene, name, spans)
    j.held += [(name, *span) for span in spans]
    width = u or _without(scene, name, scale)
    if false:
        if abs(off) > max(1.5 * width, 1e-3 * scale):
            j.off += [(name, *span, f"{name}, {said}") for span in spans]
            if u is not None:  # a figure of a spoiled channel may stand, named, without an uncertainty
                j.say("spoilt", name, said)
    elif abs(off) > max(2.0 * width, LEFT * scale):
        j.say("gross", name, said)
    if u == 0.0:
        j.say("document", f"U of {name} is 0", said)
    elif u is None and scene.stated and not disturbed and not false and name not in TEMPERATURES:
        j.say("no U", name, said)


def _without(scene: Scene, name: str, scale: float) -> float:
    """Return what noise and gaps may do to a figure where the laboratory states nothing."""
    force, stroke = float(str(scene.facts["noise_kN"])), float(str(scene.facts["noise_mm"]))
    least = {
        "kN": 3.0 * force + 0.001 * scene.force_span,
        "mm": 3.0 * stroke
        + 0.001 * scene.span_mm,  # contract, section 4: a gap may change the stroke by 0.1 %
    }.get(name.rsplit("_", 1)[-1], 0.0)
    share = 0.02 if "speed" in name else WITHOUT_U  # slopes of noisy samples
    return share * scale + least


def _judged(scene: Scene) -> list[str]:
    names = [*ENERGIES, *STIFFNESS, *PLACES, *SPEEDS]
    if scene.motion.kind == "harmonic" and scene.motion.shape != "trapezoid":
        names += HARMONICS
    return [n for n in names if scene.facts["what"] != "damper" or n != "tangent_stiffness_kN_per_mm"]


def _means(scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None]) -> Iterator[Row]:
    """Means of the run or of its steps; one of them, by the record's number, counts for coverage."""
    summaries = [(f"step {i + 1}", step) for i, step in enumerate(run.get("steps") or [])] or [("run", run)]
    for k, (label, holder) in enumerate(summaries):
        summary = holder.get("summary") or {}
        true = [c for n in summary.get("cycles_used") or [] if (c := strokes.get(n)) is not None]
        if not true or len(true) != len(summary["cycles_used"]):
            continue
        entries = {name: summary.get(name) or {} for name in _judged(scene)}
        values = {name: (e.get("value"), e.get("expanded_uncertainty")) for name, e in entries.items()}
        halves = {n: h for n, h in (holder.get("half_width_95") or {}).items() if h}
        yield Row(f"mean ({label})", values, halves, true, k == scene.number % len(summaries))


def _by_cycle(scene: Scene, run: dict[str, Any], strokes: dict[int, TrueCycle | None]) -> Iterator[Row]:
    """Figures of each cycle; of a static run one counts for coverage."""
    cycles = [c for c in run["cycles"] if c.get("complete")]
    for k, cycle in enumerate(cycles):
        true = strokes.get(cycle["index"])
        if true is None or not true.whole or not regular(scene, true):
            continue
        us = cycle.get("expanded_uncertainty") or {}
        values = {name: (cycle.get(name), us.get(name)) for name in _judged(scene)}
        yield Row(f"cycle {cycle['index']}", values, {}, [true], k == scene.number % len(cycles))


def regular(scene: Scene, c: TrueCycle) -> bool:
    """Return whether a cycle is one that was asked for, and no ramp between two steps."""
    steps = scene.motion.steps
    return not steps or any(c.start_s >= a and c.end_s <= b + 0.3 for a, b in steps)


def _extremes(j: Judgement, scene: Scene, run: dict[str, Any], *, disturbed: bool) -> None:
    """Hold the extremes of the run against those of the motion that is on record.

    They are over all samples (contract, section 4): the truth is between the extreme of the true values at
    the samples and that of the motion between them.
    """
    t, kept = scene.motion.time_s, np.isfinite(scene.force_read_kN)
    at = scene.true_time_s
    on = (t >= at.min()) & (t <= at.max())
    stroke, force = scene.motion.stroke_mm, scene.force_kN
    grids = {
        "stroke": (np.interp(at, t, stroke), stroke[on]),
        "force": (np.interp(at[kept], t, force), force[on]),
    }
    found = run.get("extremes") or {}
    for channel, unit in (("stroke", "mm"), ("force", "kN")):
        samples, fine = grids[channel]
        for way, pick in (("min", np.min), ("max", np.max)):
            name = f"{channel}_{way}_{unit}"
            entry = found.get(name) or {}
            if entry.get("value") is None or entry.get("doubt") or hidden(scene, name):
                continue
            pair = sorted((float(pick(samples)), float(pick(fine))))
            truth, u = (pair[0], pair[1]), entry.get("expanded_uncertainty")
            spans = [(float(at.min()), float(at.max()))]
            compare(j, scene, name, "extreme", entry["value"], u, truth, spans, disturbed=disturbed)
            half = entry.get("half_width_95")
            if half and not falsified(scene, name, spans):
                j.ratios.append((f"extreme {name}, half_width_95", error(entry["value"], truth) / half))


def _temperatures(
    j: Judgement, scene: Scene, strokes: dict[int, TrueCycle | None], run: dict[str, Any]
) -> None:
    """Hold the temperatures of cycles: within what the sensor states and what may change in 15 s."""
    limit = scene.stated.get("temperature_1", Stated()).zero + 0.0625
    for cycle in run["cycles"]:
        true = strokes.get(cycle["index"])
        if true is None or hidden(scene, "temperature_max_C"):
            continue
        t = scene.motion.time_s
        about = scene.temperature_C[(t >= true.start_s - COVER_S) & (t <= true.end_s + 1.0)]
        slack = limit + float(np.ptp(about)) if len(about) else limit
        for name, key in TEMPERATURES.items():
            value = (cycle.get("temperature_C") or {}).get(key)
            if value is not None and abs(error(value, true.figures[name])) > slack:
                j.say("gross", name, f"cycle {cycle['index']}: {value:.6g}, true {true.figures[name]}")


def _contact(j: Judgement, scene: Scene, found: dict[str, Any]) -> None:
    """Hold the place of first contact against the true one: where the seat begins to bear or bears all."""
    value, u = found.get("stroke_mm"), found.get("expanded_uncertainty")
    others = [a for a in scene.applied if a.name != "zero-off" and a.touches("first contact")]
    if value is None or not u or others:
        return
    shift = sum(float(a.size.split()[0]) for a in scene.applied if a.name == "zero-off")
    low, seating = float(str(scene.facts["zero_mm"])) + shift, float(str(scene.facts["seating_mm"]))
    off = error(value, (low, low + seating))
    j.ratios.append(("first contact, U", off / u))
    if abs(off) > 2.0 * u:
        j.say("gross", "first contact", f"{value:.4g} ± {u:.2g} mm, true {low:.4g}: {found.get('how')}")


def _rows(
    j: Judgement,
    scene: Scene,
    run: dict[str, Any],
    strokes: dict[int, TrueCycle | None],
    *,
    disturbed: bool,
) -> None:
    """Hold what the requirements measure."""
    for row in run["requirements"]:
        true = strokes.get(row["cycle"]) if row["cycle"] is not None else None
        name, value, u = row["id"], row["measured"], row["expanded_uncertainty"]
        truth = true.readings.get(name) if true is not None else None
        if true is None or truth is None or value is None or name in true.unknown or hidden(scene, name):
            continue
        spans = [(true.start_s, true.end_s)]
        compare(j, scene, name, f"stroke {true.number}", value, u, truth, spans, disturbed=disturbed)
        if u and true.number == 1 + j.number % 3 and not falsified(scene, name, spans):
            j.ratios.append((f"requirement {name}, U", error(value, truth) / u))


def _mean(intervals: list[Interval]) -> Interval:
    return float(np.mean([a for a, _ in intervals])), float(np.mean([b for _, b in intervals]))
