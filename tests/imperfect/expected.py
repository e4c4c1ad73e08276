"""What the standard's limits, as the documents quote them, make of the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Scene, Stated
from .figures import Interval
from .truth import TrueCycle

WINDOWS: dict[str, Interval] = {
    "preload": (10.0, 50.0),
    "force-at-25mm": (30.0, 130.0),
    "force-at-60mm": (100.0, 400.0),
    "force-at-100mm": (350.0, 1000.0),
    "stored-energy": (12_500.0, float("inf")),
}
TEMPERATURE_C: Interval = (15.0, 25.0)
SPEED_MM_PER_S, PAUSE_S, DWELL_S, RESIDUAL_MM, FULL_MM = 50.0, 600.0, 1.0, 2.0, 100.0
REST_H, COVER_S = 72.0, 15.0
RUBBERY = ("elastomer", "rubber-steel")
HIDES = 0.9  # evaluation/samples.md: of the shortest stroke; a hole that is shorter hides none
ROUNDING_S = 0.2  # a stand's longest reversal in this world: a rest begins and ends within so much


@dataclass(frozen=True)
class Condition:
    """State of a condition by the truth: ok, broken, near its limit; and whether the record can show it."""

    state: str
    shown: str = "yes"  # yes, no, perhaps

    def allows(self, verdict: str, *, disturbed: bool) -> bool:
        """Return whether this verdict is no falsehood.

        Contract, section 4: broken is `fail`; what the record cannot show is `inconclusive`, never `fail`,
        never `pass`. What it shows broken in part may be `fail`.
        """
        if verdict == "pass":
            return self.state != "broken" and self.shown != "no"
        if verdict == "fail":
            return self.state != "ok"
        if verdict in {"inconclusive", "not-tested"}:
            return disturbed or self.shown != "yes" or self.state == "near"
        return False


def window(number: int, name: str) -> Interval:
    """Return the limits of a requirement for a stroke."""
    if name == "absorbed-energy-ratio":
        return (0.50 if number == 1 else 0.42, float("inf"))
    return WINDOWS[name]


def _against(value: float, limit: float, tolerance: float) -> str:
    if abs(value - limit) <= tolerance:
        return "near"
    return "broken" if value > limit else "ok"


def _either(states: set[str]) -> str:
    """Return the state where several readings are right."""
    return states.pop() if len(states) == 1 else "near"


def place_tolerance_mm(scene: Scene, at_mm: float) -> float:
    """Return by how much a recorded stroke may differ from the true one: what is stated, and noise."""
    of = scene.stated.get("stroke_1", Stated())
    return (
        of.zero
        + of.linearity
        + abs(at_mm) * of.accuracy_percent / 100.0
        + 3.0 * float(str(scene.facts["noise_mm"]))
        + 0.1  # steps of the converter
    )


def conditions(scene: Scene, cycle: TrueCycle) -> dict[str, Condition]:
    """Return the conditions that govern a stroke."""
    out: dict[str, Condition] = {}
    low, high = cycle.temperature_C
    sensor = (
        scene.stated.get("temperature_1", Stated()).zero + 0.0625
    )  # stated limit, a step of the converter
    states = {_against(high, TEMPERATURE_C[1], sensor), _against(-low, -TEMPERATURE_C[0], sensor)}
    state = "broken" if "broken" in states else "near" if "near" in states else "ok"
    out["temperature-range"] = Condition(state, covered(scene, cycle))
    known = "yes" if cycle.closes else "perhaps" if cycle.whole else "no"
    rate, noise = scene.motion.sample_rate_Hz, float(str(scene.facts["noise_mm"]))
    w_s = max(0.05 * 0.5 * (cycle.end_s - cycle.start_s), 5.0 / rate)
    # evaluation/requirements.md: slope over 5 % of the branch, and five standard deviations of its noise
    adds = 5.0 * noise * np.sqrt(12.0 / max(w_s * rate, 5.0)) / w_s
    speeds = {_against(v, SPEED_MM_PER_S, 0.5 + adds) for v in cycle.fastest_mm_per_s}
    speed = _either(speeds)
    out["speed-limit"] = Condition(speed, "yes" if known == "no" and speed == "broken" else known)
    if cycle.pause_s is not None:
        out["pause-limit"] = Condition(_against(cycle.pause_s, PAUSE_S, 2.0 * ROUNDING_S + 1.0))
    dwell = _against(cycle.dwell_s, DWELL_S, 2.0 * ROUNDING_S)
    out["immediate-unloading"] = Condition(dwell, known)
    residuals = [cycle.residual_mm]
    # "before the cycle, after the last one too": where the record goes on until it is released, or at rest
    if cycle.number == min(len(scene.cycles), 3) and cycle.whole:
        residuals.append(cycle.left_mm)
    tolerance = place_tolerance_mm(scene, RESIDUAL_MM)
    residual = max(
        (_against(v, RESIDUAL_MM, tolerance) for v in residuals), key=("ok", "near", "broken").index
    )
    if cycle.number == 3 < len(scene.cycles) and _against(cycle.left_mm, RESIDUAL_MM, 0.0) == "broken":
        residual = "near" if residual == "ok" else residual  # the last on record, or the last that is judged
    out["full-release"] = Condition(residual, known)
    top = cycle.figures.get("stroke_max_mm", (0.0, 0.0))[0]
    near = abs(top - FULL_MM) < place_tolerance_mm(scene, FULL_MM)
    out["full-stroke"] = Condition(
        "ok", "perhaps" if near or not cycle.closes else "yes" if top > FULL_MM else "no"
    )
    return out


def of_the_run(scene: Scene) -> dict[str, Condition]:
    """Return the conditions that govern the whole run."""
    hours = scene.facts["rest_h"]
    if scene.facts["system"] not in RUBBERY:
        rest = Condition("ok")
    elif isinstance(hours, float):
        rest = Condition("ok" if hours >= REST_H else "broken")
    else:
        rest = Condition("ok", "no")
    happened, inner = len(scene.cycles), range(2, len(scene.cycles))
    # whether what lacks at the record's ends is a stroke's, up to 2 % of the range, noise may decide
    sure = sum(c.whole and (c.closes or c.number in inner) for c in scene.cycles)
    count = Condition("ok" if sure >= 3 else "broken" if happened < 3 else "near")
    if count.state == "broken" and sure < happened:
        count = Condition("broken", "perhaps")  # it begins or ends within a stroke: there may have been more
    if count.state == "ok" and sure - hidden_by_contract(scene) < 3:
        count = Condition("near")
    return {"rest-after-assembly": rest, "cycle-count": count}


def hidden_by_contract(scene: Scene) -> int:
    """Return how many strokes lie in holes that hide none by docs/evaluation-document.md.

    "A hole between two samples of the same stroke and force that is shorter than each stroke of the record
    hides none"; nine tenths of the shortest by docs/evaluation/samples.md. A first stroke that was made many
    times as fast as the others fits into such a hole, and nothing on record tells of it.
    """
    rows_s = np.sort(scene.true_time_s)
    spans = [np.searchsorted(rows_s, (c.start_s, c.end_s)) for c in scene.cycles]
    seen_s = [c.end_s - c.start_s for c, (a, b) in zip(scene.cycles, spans, strict=True) if b > a]
    holes_s = [rows_s[a] - rows_s[a - 1] for a, b in spans if a == b and 0 < a < len(rows_s)]
    return sum(hole_s < HIDES * min(seen_s, default=0.0) for hole_s in holes_s)


def begins_within(scene: Scene) -> bool:
    """Return whether the first stroke on record may not have been the first (evaluation/samples.md)."""
    return bool(scene.cycles) and not scene.cycles[0].whole


def _farthest_s(at: np.ndarray, start_s: float, end_s: float) -> float:
    """Return how far readings are from the next, or from the start and the end of a cycle."""
    inner = at[(at > start_s) & (at < end_s)]
    widest = float(np.diff([start_s, *inner, end_s]).max())
    return max(widest, *(float(np.abs(at - end).min()) for end in (start_s, end_s)))


def covered(scene: Scene, cycle: TrueCycle) -> str:
    """Return whether one sensor's readings cover the cycle.

    Contract: "none farther than 15 s from the next, start and end included"; evaluation/figures.md:
    “a reading farther than 15 s from the start is not used”. By the letter a cycle shorter than 15 s is
    covered by a reading that is near enough to its start and to its end, also one outside of it: so it is
    not shown only where that, too, fails. It must be shown where the readings within the cycle do so by
    themselves. A lag dies away over many times as long as any noise shows it, so that the record may end
    the cycle from `released_s` on. `limit-sets.md`: one sensor must cover it by itself.
    """
    shown = []
    slack = 0.3 + 2.0 * scene.dt_s  # where a cycle starts and ends is known to about so much
    for x, bad in zip(scene.temperatures_C, scene.faulty_C, strict=True):
        at = np.sort(scene.true_time_s[np.isfinite(x) & ~bad])
        if not len(at):
            continue
        inner = at[(at > cycle.start_s) & (at < cycle.end_s)]
        widest = float(np.diff([cycle.start_s, *inner, cycle.end_s]).max())
        if _farthest_s(at, cycle.start_s, cycle.released_s) > COVER_S + slack:
            shown.append("no")
        else:
            shown.append("yes" if len(inner) and widest < COVER_S - slack else "perhaps")
    return next((s for s in ("yes", "perhaps") if s in shown), "no")
