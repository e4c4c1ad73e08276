"""``bufferstand skew``: by how much the force is late, from runs on an elastic reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import EXISTING, FiniteFloat, warn, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.evaluation.facts import REFERENCE_LOSS
from bufferstand.foundation import ExitStatus

if TYPE_CHECKING:
    from bufferstand.evaluation.uncertainty.skew import SkewMeasurement

_DRAWS = 100
"""The effect of a millisecond carries no uncertainty: few draws are enough."""


@click.command(
    "skew", epilog="Example:  bufferstand skew steel-spring/runs --effect-on campaign/runs --json skew.json"
)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--reference-loss",
    metavar="NUMBER",
    type=FiniteFloat(),
    default=REFERENCE_LOSS,
    show_default=True,
    help="Largest loss factor that the reference may have; counts where all runs have one frequency.",
)
@click.option(
    "--effect-on",
    metavar="PATH",
    multiple=True,
    type=EXISTING,
    help="Show what 1 ms changes in these runs too (a run file or a folder); may be repeated.",
)
@click.option("--json", "json_file", metavar="FILE|-", help="Write the result as JSON; - is standard output.")
def command(
    paths: tuple[Path, ...], reference_loss: float, effect_on: tuple[Path, ...], json_file: str | None
) -> int:
    """Measure the skew between force and stroke from runs on an elastic reference (a steel spring).

    The loop of a spring without loss has no area: what it has, the skew made. One frequency is enough; over
    several the reference's own loss is distinguished. Says what delay_s to write into the stand file, and
    what 1 ms changes in absorbed energy and damping of every run.
    """
    from bufferstand.evaluation.across_runs import points_of
    from bufferstand.evaluation.document import evaluate_file, skew_effect
    from bufferstand.evaluation.facts import Options
    from bufferstand.evaluation.loading import load_run
    from bufferstand.evaluation.uncertainty.skew import measure_skew
    from bufferstand.recording.finding import run_files

    files = run_files(paths)
    measured = measure_skew([load_run(path) for path in files], reference_loss=reference_loss)
    shown = run_files([*files, *effect_on])
    evaluated = [evaluate_file(path, Options(draws=_DRAWS)) for path in shown]
    effects = [skew_effect(point) for run in evaluated for point in points_of(run)]
    if json_file is not None:
        write_json(
            {"skew": {**asdict(measured), "warnings": list(measured.warnings)}, "effect_of_1_ms": effects},
            json_file,
        )
    if json_file != "-":
        _show(measured)
        _show_effects(effects)
    for text in measured.warnings:
        warn(text)
    return ExitStatus.DONE


def _show(measured: SkewMeasurement) -> None:
    u_delay_s = measured.expanded_uncertainty_s / measured.coverage_factor
    late = "late" if measured.skew_s >= 0.0 else "early"
    click.echo(
        f"skew: the force is {abs(measured.skew_s) * 1e3:.4f} ms {late} against the stroke, "
        f"U = {measured.expanded_uncertainty_s * 1e3:.4f} ms (k = {measured.coverage_factor:.2f})"
    )
    sources = sorted(measured.standard_uncertainties_s.items(), key=lambda item: -item[1])
    click.echo("  u by source [µs]: " + ", ".join(f"{name} {1e6 * u:.2g}" for name, u in sources))
    click.echo(f"  by the phase of the first harmonic: {measured.by_phase_s * 1e3:+.4f} ms")
    if measured.criterion == "no-area":
        click.echo(f"  the reference's own loss factor is taken to be at most {measured.reference_loss:g}")
    else:
        click.echo(
            f"  the reference's own loss factor, from several frequencies: {measured.reference_loss:.5f}"
        )
    click.echo("write into the stand file, at the channel “force”:")
    click.echo(f"  delay_s = {measured.delay_s:.6f}  (these runs: {measured.force_delay_s:g})")
    click.echo(f"  u_delay_s = {u_delay_s:.2g}  in its uncertainty")
    if measured.delay_s < 0.0:
        click.echo(f"  or leave it, and set delay_s = {-measured.delay_s:.6f} at both draw wires")
    show_table(
        [("runs", "left"), ("frequency\nHz", "right"), ("amplitude\nmm", "right"), ("cycles\n", "right"),
         ("skew ± u\nms", "right"), ("by phase\nms", "right")],
        [
            (
                ", ".join(point.runs), f"{point.frequency_Hz:.3g}", f"{point.amplitude_mm:.2f}",
                str(point.cycles),
                f"{point.skew_s * 1e3:+.4f} ± {point.standard_uncertainty_s * 1e3:.4f}",
                f"{point.by_phase_s * 1e3:+.4f}",
            )
            for point in measured.points
        ],
    )  # fmt: skip


def _show_effects(effects: Sequence[Mapping[str, Any]]) -> None:
    click.echo("\nwhat 1 ms changes (force moved earlier; by shifting, in brackets by the closed form):")

    def text(both: Mapping[str, float | None], digits: int) -> str:
        shifted, closed = (
            "—" if value is None else f"{value:+.{digits}f}"
            for value in (both["by_shifting"], both["closed_form"])
        )
        return f"{shifted} ({closed})"

    def share(value: float | None) -> str:
        return "—" if value is None else f"{value:+.2%}"

    show_table(
        [("run", "whole"), ("frequency\nHz", "right"), ("absorbed energy\nJ", "right"), ("", "right"),
         ("damping\n", "right"), ("", "right")],
        [
            (
                effect["run"],
                "—" if effect["frequency_Hz"] is None else f"{effect['frequency_Hz']:.3g}",
                text(effect["absorbed_energy_J_per_ms"], 3),
                share(effect["absorbed_energy_share_per_ms"]),
                text(effect["damping_per_ms"], 5),
                share(effect["damping_share_per_ms"]),
            )
            for effect in effects
        ],
    )  # fmt: skip
