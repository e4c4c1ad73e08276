"""The plan as the page shows it: each step with its force and temperature against the limits in force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bufferstand.foundation import duration_text

NEAR = 0.9
"""From this share of a limit on a figure is near it."""


@dataclass(frozen=True)
class Row:
    """A step.

    Parameters
    ----------
    index : int
    name, kind : str
    stroke_mm, frequency_Hz, speed_mm_per_s, cycles : str
        As texts, empty where a step has none.
    force_kN, end_C : str
        Expected, as texts.
    force_share, heat_share : float or None
        Of the limit in force: 1 is at the limit.
    heat_kJ, duration : str
    """

    index: int
    name: str
    kind: str
    stroke_mm: str
    frequency_Hz: str
    speed_mm_per_s: str
    cycles: str
    force_kN: str
    force_share: float | None
    heat_kJ: str
    end_C: str
    heat_share: float | None
    duration: str


def plan_view(plan: dict[str, Any]) -> dict[str, Any]:
    """Return what the template of the plan shows of ``plan --json``."""
    limits, totals = plan["limits"], plan["totals"]
    force_kN = limits["in_force"]["force_max_kN"]["value"]
    stop_C, start_C = limits["test"]["temperature_stop_C"], _at_start(plan)
    most_C = totals.get("max_temperature_C")
    forces = [
        step["expected_peak_force_kN"] for step in plan["steps"] if step["expected_peak_force_kN"] is not None
    ]
    return {
        "rows": [_row(step, force_kN, start_C, stop_C) for step in plan["steps"]],
        "force_limit": f"{force_kN:g} kN" if force_kN is not None else "no limit",
        "force_source": limits["in_force"]["force_max_kN"]["source"],
        "peak": f"{max(forces):.0f} kN" if forces else "not known",
        "stop": f"{stop_C:g} °C" if stop_C is not None else "no stop",
        "warmest": f"{most_C:.1f} °C" if most_C is not None else "not known",
        "heat": f"{totals['heat_J'] / 1e3:.0f} kJ" if totals.get("heat_J") else "not known",
        "lasts": duration_text(totals["duration_s"]),
        "expected": duration_text(totals["expected_duration_s"]),
        "disk": f"{totals['disk_bytes'] / 1e6:.0f} MB",
        "notes": [*plan["assumptions"], *plan["notes"]],
        "warnings": plan["warnings"],
        "not_guarded": plan["not_guarded"],
        "specimen": plan["specimen"]["id"],
    }


def _row(step: dict[str, Any], force_kN: float | None, start_C: float | None, stop_C: float | None) -> Row:
    peak_kN, end_C = step["expected_peak_force_kN"], step["end_temperature_C"]
    own_stop_C = step.get("temperature_stop_C") or stop_C
    heat_share = None
    if end_C is not None and start_C is not None and own_stop_C is not None and own_stop_C > start_C:
        heat_share = max(0.0, (step["max_temperature_C"] - start_C) / (own_stop_C - start_C))
    return Row(
        step["index"],
        step["name"],
        step["kind"],
        _stroke(step),
        _text(step["frequency_Hz"], "{:.3g}"),
        _text(step["peak_speed_mm_per_s"], "{:.4g}"),
        _text(step["cycles"], "{:d}"),
        _text(peak_kN, "{:.0f}"),
        None if peak_kN is None or not force_kN else peak_kN / force_kN,
        _text(step["expected_heat_J"], "{:.1f}", 1e-3),
        _text(end_C, "{:.1f}"),
        heat_share,
        duration_text(step["expected_duration_s"]),
    )


def _at_start(plan: dict[str, Any]) -> float | None:
    conditions = plan["conditions"]
    given = conditions.get("specimen_C")
    start: float | None = conditions.get("ambient_C") if given is None else given
    return start


def _stroke(step: dict[str, Any]) -> str:
    mean_mm, amplitude_mm = step["prestress_mm"], step["amplitude_mm"]
    if mean_mm is None or amplitude_mm is None:
        return ""
    return f"{mean_mm:g} ± {amplitude_mm:g}"


def _text(value: float | None, form: str, factor: float = 1.0) -> str:
    if value is None:
        return ""
    return form.format(value * factor if factor != 1.0 else value)
