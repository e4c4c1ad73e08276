"""What the standard's limits, as the documents quote them, make of the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chain import Scene
from .truth import TrueCycle

WINDOWS: dict[str, tuple[float, float]] = {
    "preload": (10.0, 50.0),
    "force-at-25mm": (30.0, 130.0),
    "force-at-60mm": (100.0, 400.0),
    "force-at-100mm": (350.0, 1000.0),
    "stored-energy": (12_500.0, float("inf")),
}
TEMPERATURE_C, SENSOR_C = (
    (15.0, 25.0),
    0.7,
)  # 0.5 as stated, a converter step, what the seam of readings takes
SPEED_MM_PER_S, PAUSE_S, DWELL_S, RESIDUAL_MM = 50.0, 600.0, 1.0, 2.0
REST_H, COVER_S = 72.0, 15.0
RUBBERY = ("elastomer", "rubber-steel")


@dataclass(frozen=True)
class Condition:
    """State of a condition by the truth: ok, broken, near its limit; and whether the record can show it."""

    state: str
    shown: str = "yes"  # yes, no, perhaps

    def allows(self, verdict: str, *, disturbed: bool) -> bool:
        """Return whether this verdict is no falsehood."""
        if verdict == "pass":
            return self.state != "broken" and self.shown != "no"
        if verdict == "fail":
            return self.state != "ok"
        if verdict in {"inconclusive", "not-tested"}:
            return disturbed or self.shown != "yes" or self.state == "near"
        return False


def window(number: int, name: str) -> tuple[float, float]:
    """Return the limits of a requirement for a stroke."""
    if name == "absorbed-energy-ratio":
        return (0.50 if number == 1 else 0.42, float("inf"))
    return WINDOWS[name]


def _against(value: float, limit: float, tolerance: float) -> str:
    if abs(value - limit) <= tolerance:
        return "near"
    return "broken" if value > limit else "ok"


def conditions(scene: Scene, cycle: TrueCycle, zero_mm: float) -> dict[str, Condition]:
    """Return the conditions that govern a stroke."""
    out: dict[str, Condition] = {}
    low, high = cycle.temperature_C
    widest = _widest(valid_readings(scene), cycle.start_s, cycle.end_s)
    shown = "no" if widest > COVER_S + 0.3 else "yes" if widest < COVER_S - 0.3 else "perhaps"
    states = {_against(high, TEMPERATURE_C[1], SENSOR_C), _against(-low, -TEMPERATURE_C[0], SENSOR_C)}
    out["temperature-range"] = Condition(
        "broken" if "broken" in states else "near" if "near" in states else "ok", shown
    )
    fastest = [cycle.figures.get(f"speed_{way}_max_mm_per_s", (0.0, 0.0)) for way in ("loading", "unloading")]
    speeds = {_against(v, SPEED_MM_PER_S, 0.08 * SPEED_MM_PER_S) for pair in fastest for v in pair}
    speed = (
        "near"
        if len(speeds) > 1 and "ok" in speeds and "near" in speeds
        else max(speeds, key=("ok", "near", "broken").index)
    )
    out["speed-limit"] = Condition(*((speed, "yes") if cycle.closes else ("near", "perhaps")))
    if cycle.pause_s is not None:
        out["pause-limit"] = Condition(_against(cycle.pause_s, PAUSE_S, 8.0))
    dwell = _against(cycle.dwell_s, DWELL_S, 0.4)
    out["immediate-unloading"] = Condition(dwell, "yes" if cycle.closes else "perhaps")
    residual = _against(cycle.residual_mm, RESIDUAL_MM, 0.7 + abs(zero_mm))
    if residual == "ok" and _against(cycle.left_mm, RESIDUAL_MM, 0.0) == "broken":
        residual = "near"  # it governs the next stroke; who blames this one, too, is not wrong
    out["full-release"] = Condition(residual, "yes" if cycle.closes else "perhaps")
    top = cycle.figures.get("stroke_max_mm", (0.0, 0.0))[0]
    near = abs(top - 100.0) < 1.0 + abs(zero_mm)
    out["full-stroke"] = Condition(
        "ok", "perhaps" if near or not cycle.closes else "yes" if top > 100.0 else "no"
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
    whole = sum(c.closes for c in scene.cycles)
    near = len(scene.cycles) != whole
    count = Condition("ok" if whole >= 3 else "near" if near and len(scene.cycles) >= 3 else "broken")
    return {"rest-after-assembly": rest, "cycle-count": count}


def valid_readings(scene: Scene) -> np.ndarray:
    """Return the true times of readings that are no sensor fault."""
    times = [scene.true_time_s[np.isfinite(x) & (x != 85.0) & (x > -100.0)] for x in scene.temperatures_C]
    return np.sort(np.concatenate(times)) if times else np.array([])


def _widest(readings: np.ndarray, start: float, end: float) -> float:
    """Return the widest hole in the readings of a cycle.

    "None farther than 15 s from the next, start and end included" is read as holes between start, readings
    and end, or between readings, the last before the start and the first after the end among them: the
    smaller one counts.
    """
    before, after = readings[readings <= start], readings[readings >= end]
    inner = readings[(readings > start) & (readings < end)]
    within = np.diff([start, *inner, end])
    across = np.diff([before[-1] if len(before) else start, *inner, after[0] if len(after) else end])
    if not len(readings):
        return np.inf
    return float(min(within.max(), across.max()))
