"""``bufferstand model train``: vehicles with springs of their own models run into each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, warn, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import ExitStatus
from bufferstand.foundation.files import write_text

if TYPE_CHECKING:
    from bufferstand.model.train import Train, TrainFigures, TrainMotion


@click.command(
    "train",
    epilog="Example:  bufferstand model train sample_runs/trains/ten-into-ten.toml --picture train.png",
)
@click.argument("train_file", metavar="TRAIN.toml", type=EXISTING)
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the figures as JSON; - is standard output."
)
@click.option("--out", metavar="FILE.csv", type=FILE, help="Speeds, forces and energies over time.")
@click.option("--picture", metavar="FILE.png|.svg", type=FILE, help="Forces, speeds and energies.")
def command(train_file: Path, json_file: str | None, out: Path | None, picture: Path | None) -> int:
    """Let a train run: forces between its vehicles, speeds and energies, with springs of their own models.

    The file says springs (model files), masses, speeds, gaps and couplings (docs/trains.md). Straight, level
    track; no brakes, traction or rolling resistance.
    """
    from bufferstand.cli.model import picture_train, save_picture
    from bufferstand.model.train import figures_of, load_train, move_train

    train = load_train(train_file)
    motion = move_train(train)
    figures = figures_of(train, motion)
    for sentence in figures.warnings:
        warn(sentence)
    if json_file is not None:
        write_json(figures.document(train, motion), json_file)
    if json_file != "-":
        _show(train, motion, figures)
    if out is not None:
        write_text(out, _history(train, motion))
        click.echo(f"written: {out}", err=json_file == "-")
    if picture is not None:
        save_picture(picture_train(train, motion), picture)
        click.echo(f"written: {picture}", err=json_file == "-")
    return ExitStatus.DONE


def _show(train: Train, motion: TrainMotion, figures: TrainFigures) -> None:
    show_table(
        [
            ("gap", "left"),
            ("push kN", "right"),
            ("pull kN", "right"),
            ("buffers mm", "right"),
            ("draw gears mm", "right"),
            ("lost J", "right"),
        ],
        [
            [
                f"{train.vehicles[k].name} – {train.vehicles[k + 1].name}",
                f"{motion.largest_push_kN[k]:.1f}",
                f"{motion.largest_pull_kN[k]:.1f}" if gap.pull is not None else "—",
                " / ".join(f"{stroke:.1f}" for stroke in motion.buffer_stroke_mm[k]),
                " / ".join(f"{stroke:.1f}" for stroke in motion.draw_gear_stroke_mm[k])
                if gap.pull is not None
                else "—",
                f"{motion.gap_lost_J[k]:.0f}",
            ]
            for k, gap in enumerate(train.gaps)
        ],
        title=f"{train.name}: largest forces and strokes (left / right)",
    )
    show_table(
        [
            ("vehicle", "left"),
            ("t", "right"),
            ("m/s before", "right"),
            ("m/s after", "right"),
            ("m/s²", "right"),
        ],
        [
            [
                vehicle.name,
                f"{vehicle.mass_t:g}",
                f"{vehicle.speed_m_per_s:.3f}",
                f"{motion.speed_m_per_s[-1, k]:.3f}",
                f"{motion.largest_acceleration_m_per_s2[k]:.2f}",
            ]
            for k, vehicle in enumerate(train.vehicles)
        ],
        title="Speeds, and the largest acceleration",
    )
    click.echo(
        f"Largest push {figures.largest_push_kN:.1f} kN, pull {figures.largest_pull_kN:.1f} kN; of "
        f"{figures.kinetic_before_J / 1e3:.1f} kJ the springs lost {figures.lost_J / 1e3:.1f} kJ and hold "
        f"{figures.stored_after_J / 1e3:.1f} kJ (a plastic impact would lose "
        f"{figures.energy_of_impact_J / 1e3:.1f} kJ)."
    )
    click.echo(
        f"Balances: energy within {100.0 * figures.ledger_gap:.2g} % of what the impact can turn over, "
        f"momentum within {figures.momentum_change:.1g} of itself."
    )


def _history(train: Train, motion: TrainMotion) -> str:
    """Return a table over time: speeds, forces between neighbours, energies."""
    import numpy as np

    count = len(train.vehicles)
    heads = ["time [s]"]
    heads += [f"speed_{k + 1} [m/s]" for k in range(count)]
    heads += [f"force_{k + 1}_{k + 2} [kN]" for k in range(count - 1)]
    heads += ["kinetic [J]", "stored [J]", "lost [J]"]
    table = np.column_stack(
        [
            motion.time_s,
            motion.speed_m_per_s,
            motion.gap_force_kN,
            motion.kinetic_J,
            motion.stored_J,
            motion.lost_J,
        ]
    )
    rows = [",".join(f"{value:.9g}" for value in row) for row in table.tolist()]
    return "\n".join([",".join(heads), *rows]) + "\n"
