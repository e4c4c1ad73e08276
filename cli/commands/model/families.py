"""``bufferstand model families``: which kind of spring is it, as far as the runs tell?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import EXISTING, ambient_option, warn, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import ExitStatus

if TYPE_CHECKING:
    from bufferstand.model.families import FamilyRanking, FittedFamily, TellingRun
    from bufferstand.model.identification import Identification

SCHEMA = "bufferstand/model-families/1"
_FASTEST_MM_PER_S = 250.0


@click.command("families", epilog="Example:  bufferstand model families campaign/runs --json families.json")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option("--knots", type=click.IntRange(3, 60), help="Points of the curves (default one every 5 mm).")
@ambient_option("Temperature of the air (default: the run's own sensor).")
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the comparison as JSON; - is standard output."
)
def command(
    paths: tuple[Path, ...], knots: int | None, ambient_C: float | None, json_file: str | None
) -> int:
    """Fit eight families of spring models to the same runs, and say which of them the runs tell apart.

    One fitter, the same weights and temperatures, the same cycles held out. Ranked by the Bayesian
    information criterion over the effective number of samples (docs/families.md). Some minutes.
    """
    from bufferstand.cli.model import read_runs, settings_of, sittings
    from bufferstand.model.families import FAMILIES, data_of, rank_families
    from bufferstand.model.identification import identify

    runs = read_runs(paths, ambient_C)
    own = identify(sittings(runs), replace(settings_of(runs), knots=knots, hold_out=False))
    ranking = rank_families(FAMILIES, own.solution.problem.frame, own.solution.vector, data_of(own))
    energy = {one.family.name: _energy(one, own) for one in ranking.fitted}
    telling = [(one, _telling(ranking.fitted[0], one, own)) for one in ranking.not_told_apart]
    if json_file is not None:
        write_json(_document(ranking, energy, telling), json_file)
    if json_file != "-":
        _show(own, ranking, energy)
        for sentence in _sentences(ranking, telling):
            click.echo(sentence)
    best = ranking.fitted[0]
    if best.square > 4.0:
        warn(
            f"the likeliest family, too, misses the runs by {best.square**0.5:.2g} times their noise: none "
            "of these is the specimen"
        )
    return ExitStatus.DONE


def _energy(one: FittedFamily, own: Identification) -> str | None:
    from bufferstand.model.families import creates_energy

    return creates_energy(one, own.solution.problem.frame, own.model.temperature)


def _telling(best: FittedFamily, one: FittedFamily, own: Identification) -> TellingRun:
    from bufferstand.model.families import telling_run

    fastest = max(own.facts.peak_speed_mm_per_s, _FASTEST_MM_PER_S)
    return telling_run(best, one, own.solution.problem.frame, own.model.temperature, fastest)


def _show(own: Identification, ranking: FamilyRanking, energy: dict[str, str | None]) -> None:
    show_table(
        [
            ("family", "whole"),
            ("fitted", "right"),
            ("residuals / noise", "right"),
            ("held out: rms kN", "right"),
            ("damping", "right"),
            ("BIC over least", "right"),
            ("creates energy", "left"),
            ("µs a step", "right"),
        ],
        [
            [
                one.family.name,
                str(one.count),
                f"{one.square**0.5:.3g}",
                f"{held[0]:.3g}" if (held := _held_out(one)) else "—",
                f"{held[1]:.4f}" if held else "—",
                f"{ranking.over_best(one):.1f}",
                energy[one.family.name] or "no",
                f"{one.cost_us:.2g}",
            ]
            for one in ranking.fitted
        ],
        title=f"{own.model.name}: families, the likeliest first ({ranking.effective:.0f} effective samples)",
    )
    show_table(
        [
            ("family", "whole"),
            ("parameter", "left"),
            ("", "left"),
            ("value", "right"),
            ("95 % interval", "right"),
            ("unit", "left"),
        ],
        [
            [one.family.name, p.name, p.symbol, f"{p.value:.4g}", f"{p.low:.4g} … {p.high:.4g}", p.unit]
            for one in ranking.fitted
            for p in one.parameters
        ],
        title="Their parameters beside the curves",
    )


def _held_out(one: FittedFamily) -> tuple[float, float] | None:
    """Return the worst rms and the worst damping of held-out cycles."""
    if not one.held_out:
        return None
    return (
        max(check.rms_kN for check in one.held_out),
        max(abs(check.damping - check.predicted_damping) for check in one.held_out),
    )


def _sentences(ranking: FamilyRanking, telling: list[tuple[FittedFamily, TellingRun]]) -> list[str]:
    """Return what the runs tell, and for what they do not tell the run that would."""
    best = ranking.fitted[0].family
    if not telling:
        return [f"These runs tell {best.name} ({best.title}) from all others."]
    found = []
    for one, run in telling:
        found.append(
            f"These runs cannot tell {best.name} from {one.family.name} (BIC {ranking.over_best(one):+.1f}). "
            + _would(run, best.name, one.family.name)
        )
    return found


def _would(run: TellingRun, best: str, other: str) -> str:
    loop = f"{run.prestress_mm:.3g} ± {run.amplitude_mm:.3g} mm at {run.frequency_Hz:g} Hz"
    if run.sigmas < 3.0:
        return f"No single loop would: they differ most at {loop}, by {run.sigmas:.1f} standard deviations."
    return (
        f"The run that would: {loop}, damping {run.damping[0]:.4f} ({best}) or {run.damping[1]:.4f} "
        f"({other}), force range {run.force_kN[0]:.1f} or {run.force_kN[1]:.1f} kN."
    )


def _document(
    ranking: FamilyRanking,
    energy: dict[str, str | None],
    telling: list[tuple[FittedFamily, TellingRun]],
) -> dict[str, Any]:
    runs = {one.family.name: run for one, run in telling}
    families = []
    for one in ranking.fitted:
        held, run = _held_out(one), runs.get(one.family.name)
        families.append(
            {
                "family": one.family.name,
                "title": one.family.title,
                "fitted_entries": one.count,
                "residuals_over_noise": one.square**0.5,
                "samples": one.samples,
                "held_out_rms_kN": held[0] if held else None,
                "held_out_damping": held[1] if held else None,
                "bic_over_least": ranking.over_best(one),
                "creates_energy": energy[one.family.name],
                "cost_us": one.cost_us,
                "parameters": [
                    {"name": p.name, "unit": p.unit or "1", "value": p.value, "interval_95": [p.low, p.high]}
                    for p in one.parameters
                ],
                "not_told_from_the_first": run is not None,
                "telling_run": None
                if run is None
                else {
                    "prestress_mm": run.prestress_mm,
                    "amplitude_mm": run.amplitude_mm,
                    "frequency_Hz": run.frequency_Hz,
                    "damping": list(run.damping),
                    "force_range_kN": list(run.force_kN),
                    "standard_deviations": run.sigmas,
                },
            }
        )
    return {"schema": SCHEMA, "effective_samples": ranking.effective, "families": families}
