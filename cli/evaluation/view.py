"""An evaluation document shown in the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import click

from bufferstand.cli.options import figure
from bufferstand.cli.terminal_tables import show_table
from bufferstand.evaluation.across_runs import FIGURES
from bufferstand.evaluation.catalogue import QUANTITIES

_MEANS = [(entry.name, entry.shown.terminal) for entry in QUANTITIES if entry.shown.terminal is not None]
COLUMNS = [
    ("run", "whole"),
    ("cycles\nused", "right"),
    ("prestress ±\namplitude mm", "right"),
    *((column.heading, "right") for _, column in _MEANS),
    ("max\n°C", "right"),
    ("verdict\n", "whole"),
]


def show_evaluation(document: Mapping[str, Any], *, warnings: bool = True) -> None:
    """Print a line a run, what each judged run met or not, what the figures hang on, then the warnings."""
    show_table(COLUMNS, [row for entry in document["runs"] for row in _rows(entry)])
    for entry in document["runs"]:
        if entry["requirements"]:
            _show_requirements(entry)
    show_conformity(document)
    show_together(document)
    _show_evidence(document["runs"])
    if warnings:
        for entry in document["runs"]:
            for text in entry["warnings"]:
                click.echo(f"warning: {entry['run']['id']}: {text}")


def show_together(document: Mapping[str, Any]) -> None:
    """Print what runs say together: trends, and runs of one step at different temperature."""
    for text in document.get("warnings", ()):
        click.echo(f"warning: {text}")
    for trend in document["trends"]:
        _show_trend(trend)
    for comparison in document["temperature_comparisons"]:
        _show_temperatures(comparison)


def _rows(entry: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the row of a run, or one for each of its steps."""
    name, cycles, verdict = entry["run"]["id"], entry["cycles"], _verdict(entry)
    if not entry["steps"]:
        return [_row(name, entry, cycles, verdict)]
    rows = []
    for step in entry["steps"]:
        own = [cycle for cycle in cycles if cycle["index"] in step["cycles"]]
        rows.append(_row(f"{name}#{step['index']}", step, own, verdict))
    return rows


def _row(
    name: str, part: Mapping[str, Any], cycles: Sequence[Mapping[str, Any]], verdict: str
) -> tuple[str, ...]:
    summary = part["summary"]
    warmest = (part.get("extremes") or {}).get("temperature_max_C") or {}

    def mean(name: str, digits: int, *, with_u: bool = False) -> str:
        known = summary.get(name) or {}
        expanded = known.get("expanded_uncertainty") if with_u else None
        text = figure(known.get("value"), digits)
        return text if expanded is None else f"{text} ± {expanded:.{digits}f}"

    return (
        name,
        f"{len(summary['cycles_used'])} of {len(cycles)}",
        f"{mean('prestress_mm', 2)} ± {mean('amplitude_mm', 2)}" if summary["cycles_used"] else "—",
        *(mean(name, column.decimals, with_u="± U" in column.heading) for name, column in _MEANS),
        figure(warmest.get("value"), 1),
        verdict,
    )


def _verdict(entry: Mapping[str, Any]) -> str:
    """Return the verdict, in brackets where no statement of conformity rests on it."""
    verdict = entry["verdict"] or "—"
    return f"({verdict})" if entry.get("purpose") == "characterisation" else verdict


def show_conformity(document: Mapping[str, Any]) -> None:
    """Print on which runs the statement of conformity of each specimen rests, where a run is left out."""
    for statement in document["conformity"]:
        if not statement["characterisation"] and not statement["warnings"]:
            continue
        of = statement["specimen"] or "a specimen without id"
        runs = ", ".join(statement["runs"]) or "no run"
        verdict = f": {statement['verdict']}" if statement["verdict"] else ""
        click.echo(f"\nconformity test of {of} ({statement['kind']}): {runs}{verdict} ({statement['why']})")
        if statement["characterisation"]:
            click.echo(f"  characterisation, no part of it: {', '.join(statement['characterisation'])}")
        for text in statement["warnings"]:
            click.echo(f"  warning: {text}")


def _show_requirements(entry: Mapping[str, Any]) -> None:
    rows = entry["requirements"]
    counted = Counter(row["verdict"] for row in rows)
    text = ", ".join(f"{number} {verdict}" for verdict, number in counted.items())
    part = " — characterisation" if entry.get("purpose") == "characterisation" else ""
    verdict = entry["verdict"] or "no verdict"
    click.echo(f"\n{rows[0]['standard']}, {entry['run']['id']}: {verdict} ({text}){part}")
    for row in rows:
        if row["verdict"] != "pass":
            cycle = "" if row["cycle"] is None else f", cycle {row['cycle']}"
            click.echo(f"  {row['verdict']}: {row['id']}{cycle}: {row['why']}")


def _show_trend(trend: Mapping[str, Any]) -> None:
    if trend["slope_per_Hz"] is None:
        return
    amplitude = trend["amplitude_mm"]
    loop = f"{trend['prestress_mm']:z.0f} mm" + ("" if amplitude is None else f" ± {amplitude:.0f} mm")
    entry = next(one for one in QUANTITIES if one.shown.trend and one.trended.name == trend["quantity"])
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    half_width = trend["slope_half_width_95_per_Hz"]
    spread = "" if half_width is None else f" ± {half_width:.2g}"
    click.echo(
        f"\n{trend['quantity'].replace('_', ' ')} over frequency at {loop}: "
        f"{trend['intercept']:.4g}{unit} {trend['slope_per_Hz']:+.3g}{spread}{unit}/Hz "
        f"({len(trend['runs'])} runs{'' if half_width is None else ', 95 %'})"
    )
    for text in trend["warnings"]:
        click.echo(f"  warning: {text}")


_CHANGES = (
    ("end force", "end_force_kN"),
    *((QUANTITIES.named(name).label.lower(), name) for name in FIGURES[1:]),
)


def _show_temperatures(comparison: Mapping[str, Any]) -> None:
    reference = comparison["reference"]
    click.echo(f"\nagainst {reference['run']} at {reference['temperature_C']:.1f} °C, at equal stroke:")
    for run in comparison["runs"]:
        parts = [
            f"{words} {change['relative_change']:+.1%}" + _per_kelvin(change)
            for words, name in _CHANGES
            if (change := run["changes"].get(name)) and change["relative_change"] is not None
        ]
        click.echo(
            f"  {run['run']} ({run['temperature_C']:.1f} °C), to {run['to_mm']:.1f} mm: "
            f"{', '.join(parts) or 'nothing to compare'}"
        )
    for text in comparison["warnings"]:
        click.echo(f"  warning: {text}")


def _per_kelvin(change: Mapping[str, Any]) -> str:
    per_kelvin = change["relative_change_per_K"]
    return "" if per_kelvin is None else f" ({per_kelvin:+.2%}/K)"


def _show_evidence(runs: Sequence[Mapping[str, Any]]) -> None:
    """Print what 1 ms of skew would change, how the draw wires agree, and the inertia correction."""
    parts = [part for entry in runs for part in _parts(entry)]
    concerned = [entry for entry in parts if entry["skew_sensitivity"] or entry["draw_wires"]]
    if not concerned:
        return
    click.echo("\nwhat the figures hang on: 1 ms more of delay_s at the force; the draw wires; inertia")
    show_table(
        [("run", "whole"), ("1 ms: absorbed\nJ", "right"), ("1 ms: absorbed\n%", "right"),
         ("1 ms: damping\n", "right"), ("1 ms: damping\n%", "right"), ("wires differ\nmm", "right"),
         ("tilt\nmm", "right"), ("permitted\nmm", "right"), ("inertia", "whole")],
        [
            (
                entry["name"],
                *_skew(entry, "absorbed_energy_J", 2),
                *_skew(entry, "damping", 4),
                *(
                    figure((entry["draw_wires"] or {}).get(name), 2)
                    for name in ("largest_difference_mm", "remaining_mm", "limit_mm")
                ),
                _inertia(entry["inertia_correction"]),
            )
            for entry in concerned
        ],
    )  # fmt: skip


def _parts(entry: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what the figures of a run hang on, or those of each of its steps."""
    name = entry["run"]["id"]
    if not entry["steps"]:
        return [{**entry, "name": name}]
    return [{**entry, **step, "name": f"{name}#{step['index']}"} for step in entry["steps"]]


def _skew(entry: Mapping[str, Any], name: str, digits: int) -> tuple[str, str]:
    change = ((entry["skew_sensitivity"] or {}).get(f"{name}_per_ms") or {}).get("by_shifting")
    own = (entry["summary"].get(name) or {}).get("value")
    if change is None:
        return "—", "—"
    share = f"{100.0 * change / abs(own):+.2f}" if own and abs(change) <= abs(own) else "—"
    return f"{change:+.{digits}f}", share


def _inertia(inertia: Mapping[str, Any] | None) -> str:
    if not inertia or not inertia["moving_mass_kg"]:
        return "not corrected"
    return f"{inertia['moving_mass_kg']:g} kg, up to {inertia['largest_force_kN']:.2g} kN"
