"""An evaluation document shown in the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import click

from cli.options import figure, show_table

COLUMNS = [
    ("run", "whole"),
    ("cycles\nused", "right"),
    ("prestress ±\namplitude mm", "right"),
    ("frequency\nHz", "right"),
    ("stored\nJ", "right"),
    ("absorbed\nJ", "right"),
    ("damping ± U\n", "right"),
    ("tangent\nkN/mm", "right"),
    ("max\n°C", "right"),
    ("verdict\n", "whole"),
]


def show_evaluation(document: Mapping[str, Any], *, warnings: bool = True) -> None:
    """Print a line a run, then what each judged run met or not, then the warnings."""
    show_table(COLUMNS, [_row(entry) for entry in document["runs"]])
    for entry in document["runs"]:
        if entry["requirements"]:
            _show_requirements(entry)
    for trend in document["trends"]:
        _show_trend(trend)
    if warnings:
        for entry in document["runs"]:
            for text in entry["warnings"]:
                click.echo(f"warning: {entry['run']['id']}: {text}")


def _row(entry: Mapping[str, Any]) -> tuple[str, ...]:
    summary, cycles = entry["summary"], entry["cycles"]

    def mean(name: str, digits: int) -> str:
        return figure((summary.get(name) or {}).get("value"), digits)

    expanded = (summary.get("damping") or {}).get("expanded_uncertainty")
    reached = [cycle["temperature_C"]["max"] for cycle in cycles]
    return (
        entry["run"]["id"],
        f"{len(summary['cycles_used'])} of {len(cycles)}",
        f"{mean('prestress_mm', 2)} ± {mean('amplitude_mm', 2)}" if summary["cycles_used"] else "—",
        mean("frequency_Hz", 3),
        mean("stored_energy_J", 0),
        mean("absorbed_energy_J", 0),
        mean("damping", 3) + (f" ± {expanded:.3f}" if expanded is not None else ""),
        mean("tangent_stiffness_kN_per_mm", 2),
        figure(max((value for value in reached if value is not None), default=None), 1),
        entry["verdict"] or "—",
    )


def _show_requirements(entry: Mapping[str, Any]) -> None:
    rows = entry["requirements"]
    counted = Counter(row["verdict"] for row in rows)
    text = ", ".join(f"{number} {verdict}" for verdict, number in counted.items())
    click.echo(f"\n{rows[0]['standard']}, {entry['run']['id']}: {entry['verdict'] or 'no verdict'} ({text})")
    for row in rows:
        if row["verdict"] != "pass":
            cycle = "" if row["cycle"] is None else f", cycle {row['cycle']}"
            click.echo(f"  {row['verdict']}: {row['id']}{cycle}: {row['why']}")


def _show_trend(trend: Mapping[str, Any]) -> None:
    if trend["slope_per_Hz"] is None:
        return
    amplitude = trend["amplitude_mm"]
    loop = f"{trend['prestress_mm']:.0f} mm" + ("" if amplitude is None else f" ± {amplitude:.0f} mm")
    unit = "" if trend["quantity"] == "damping" else " kN/mm"
    click.echo(
        f"\n{trend['quantity'].replace('_', ' ')} over frequency at {loop}: "
        f"{trend['intercept']:.4g}{unit} {trend['slope_per_Hz']:+.3g}{unit}/Hz "
        f"({len(trend['runs'])} runs)"
    )
    for text in trend["warnings"]:
        click.echo(f"  warning: {text}")
