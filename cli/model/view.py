"""An identified spring model shown in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

import click

from bufferstand.cli.options import warn
from bufferstand.cli.terminal_tables import show_table
from bufferstand.model.identification import LAWS, NAMES, CycleCheck, Estimate, Identification

_MOST_CYCLES = 12


def show_identification(found: Identification) -> None:
    """Print parameters with intervals, residuals, held-out cycles, and what the runs do not tell."""
    facts = found.facts
    click.echo(
        f"{found.model.name}: up to {facts.stroke_mm:.1f} mm and {facts.force_kN:.0f} kN, spring between "
        f"{facts.temperature_C[0]:.1f} and {facts.temperature_C[1]:.1f} °C, mean speeds of "
        f"{facts.speed_mm_per_s[0]:.3g} to {facts.speed_mm_per_s[1]:.3g} mm/s"
    )
    symbols = {law.name: law.symbol for law in LAWS}
    laws = [estimate for estimate in found.estimates if estimate.name in NAMES]
    show_table(
        [
            ("parameter", "whole"),
            ("", "left"),
            ("value", "right"),
            ("95 % interval", "right"),
            ("unit", "left"),
        ],
        [[e.name, symbols[e.name], _value(e), _interval(e), e.unit] for e in laws],
    )
    _show_curves(found)
    _show_residuals(found)
    if found.unknown:
        click.echo("Not told by these runs:")
        for unknown in found.unknown:
            stands = f"{unknown.value:.4g} {unknown.unit}".rstrip()
            click.echo(f"  {unknown.name}: {unknown.why}; {stands} is assumed")
    for note in found.notes:
        warn(note)


def _value(estimate: Estimate) -> str:
    """Return the value in digits; 0 where nothing but rounding keeps it from its bound at 0."""
    negligible = abs(estimate.value) < 1e-6 * (estimate.high - estimate.low)
    return "0" if negligible else f"{estimate.value:.4g}"


def _interval(estimate: Estimate) -> str:
    if not estimate.identified:
        return "assumed"
    return f"{estimate.low:.4g} … {estimate.high:.4g}"


def _show_curves(found: Identification) -> None:
    knots = found.solution.problem.frame.knots_mm
    curves = [estimate for estimate in found.estimates if estimate.name not in NAMES]
    loading, unloading = curves[: len(knots)], curves[len(knots) :]
    show_table(
        [
            ("stroke mm", "right"),
            ("loading kN", "right"),
            ("±", "right"),
            ("unloading kN", "right"),
            ("±", "right"),
        ],
        [
            [f"{x:.1f}", f"{a.value:.2f}", f"{_half(a):.2f}", f"{b.value:.2f}", f"{_half(b):.2f}"]
            for x, a, b in zip(knots, loading, unloading, strict=True)
        ],
        title=(
            f"Curves at {found.model.temperature.reference_C:g} °C, joined by monotone cubics (PCHIP), not "
            "smoothed otherwise; k_t = max(k_l, k_u) + (F_l - F_u) / L"
        ),
    )


def _half(estimate: Estimate) -> float:
    return 0.5 * (estimate.high - estimate.low)


def _show_residuals(found: Identification) -> None:
    show_cycles("Cycles, measured and fitted", found.cycles)
    if found.held_out:
        show_cycles("Cycles that a second fit did not see", found.held_out)
    else:
        click.echo("No cross-validation: no run has three cycles or more, or it was not asked for.")


def show_cycles(title: str, cycles: Sequence[CycleCheck]) -> None:
    """Print cycles as measured and by the model, the worst ones if there are many, and the worst figures."""
    if not cycles:
        return
    shown = sorted(sorted(cycles, key=_rms, reverse=True)[:_MOST_CYCLES], key=cycles.index)
    few = (
        "" if len(shown) == len(cycles) else f", the {len(shown)} with the largest residuals of {len(cycles)}"
    )
    show_table(
        [
            ("run", "whole"),
            ("from s", "right"),
            ("stroke mm", "right"),
            ("°C", "right"),
            ("damping", "right"),
            ("model", "right"),
            ("end force kN", "right"),
            ("model", "right"),
            ("rms kN", "right"),
            ("worst kN", "right"),
        ],
        [
            [
                c.run,
                f"{c.start_s:.1f}",
                f"{c.stroke_mm[0]:.1f} … {c.stroke_mm[1]:.1f}",
                f"{c.temperature_C:.1f}",
                f"{c.damping:.4f}",
                f"{c.predicted_damping:.4f}",
                f"{c.peak_force_kN:.1f}",
                f"{c.predicted_peak_force_kN:.1f}",
                f"{c.rms_kN:.2f}",
                f"{c.worst_kN:.2f}",
            ]
            for c in shown
        ],
        title=title + few,
    )
    damping = max(abs(c.damping - c.predicted_damping) for c in cycles)
    span = max(c.peak_force_kN for c in cycles)
    worst = max(c.rms_kN for c in cycles)
    click.echo(
        f"{len(cycles)} cycles: damping within {damping:.4f}, force within {worst:.2f} kN rms "
        f"({100.0 * worst / span:.2f} % of {span:.0f} kN)"
    )


def _rms(check: CycleCheck) -> float:
    return check.rms_kN
