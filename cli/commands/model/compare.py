"""``bufferstand model compare``: does the model say what was measured?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FOLDER, SPRING_C, ambient_option, warn
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import ExitStatus

if TYPE_CHECKING:
    from bufferstand.cli.model import MeasuredRun
    from bufferstand.evaluation.figures.model_comparison import RunCheck
    from bufferstand.model import SpringModel
    from bufferstand.model.identification import Answer


@click.command(
    "compare", epilog="Example:  bufferstand model compare spring.toml campaign/runs --out pictures"
)
@click.argument("model_file", metavar="MODEL.toml", type=EXISTING)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option("--out", metavar="DIR", type=FOLDER, help="Write pictures as the paper's Figs 10 to 12.")
@click.option("--format", "kind", type=click.Choice(["png", "svg"]), default="png", show_default=True)
@ambient_option("Of the air (default the run's own sensor).")
@click.option(
    "--temperature",
    "temperature_C",
    metavar="C",
    type=SPRING_C,
    help="Of the spring at every run's start (default its sensor's).",
)
@click.option("--isothermal", is_flag=True, help="Keep that temperature, as the paper's Fig. 10 does.")
def command(
    model_file: Path,
    paths: tuple[Path, ...],
    out: Path | None,
    kind: str,
    ambient_C: float | None,
    temperature_C: float | None,
    isothermal: bool,
) -> int:
    """Compare a model with recorded runs: damping, end force and temperature of every cycle, and residuals.

    Nothing is fitted; each run begins at its first measured temperature, unless one is given.
    """
    from bufferstand.cli.model import read_runs, show_cycles
    from bufferstand.evaluation.figures.model_comparison import check_run
    from bufferstand.model import load_model

    model = load_model(model_file)
    runs = read_runs(paths, ambient_C)
    answers = [_answer(model, run, temperature_C, isothermal) for run in runs]
    checks = [check_run(run.drive, given) for run, given in zip(runs, answers, strict=True)]
    told: dict[str, str] = {}
    _show_runs(runs, checks)
    show_cycles("Cycles", [cycle for check in checks for cycle in check.cycles])
    for run, given in zip(runs, answers, strict=True):
        for sentence in model.warnings_of(run.drive.time_s, run.drive.stroke_mm, given.temperature_C):
            told.setdefault(sentence, run.path.stem)
    for sentence, name in told.items():
        warn(f"{name}: {sentence}")
    if out is not None:
        _write_pictures(model, runs, answers, out, kind)
    return ExitStatus.DONE


def _answer(model: SpringModel, run: MeasuredRun, temperature_C: float | None, isothermal: bool) -> Answer:
    from bufferstand.evaluation.figures.model_comparison import answer_to, start_temperature_C

    drive = run.drive
    if temperature_C is None and not drive.sensor_C.size:
        start = start_temperature_C(drive)
        warn(f"{run.path.name}: no temperature of the specimen; {start:.1f} °C is assumed")
    return answer_to(model, drive, start_C=temperature_C, isothermal=isothermal)


def _show_runs(runs: list[MeasuredRun], checks: list[RunCheck]) -> None:
    import numpy as np

    rows = []
    for run, check in zip(runs, checks, strict=True):
        drive, given, group, rest = check.drive, check.answer, check.cycles, check.residual_kN
        sensor = np.interp(drive.sensor_s, drive.time_s, given.sensor_C) - drive.sensor_C
        span = check.largest_force_kN
        rows.append(
            [
                run.path.stem,
                str(len(group)),
                *(
                    [
                        f"{np.mean([c.damping for c in group]):.4f}",
                        f"{np.mean([c.predicted_damping for c in group]):.4f}",
                    ]
                    if group
                    else ["—", "—"]
                ),
                f"{span:.1f}",
                f"{float(given.force_kN[drive.node].max()):.1f}",
                f"{float(np.sqrt(np.mean(rest**2))):.2f}" if rest.size else "—",
                f"{100.0 * float(np.max(np.abs(rest))) / span:.2f}" if rest.size else "—",
                f"{given.temperature_C[-1]:.1f}",
                f"{np.max(np.abs(sensor)):.2f}" if sensor.size else "—",
            ]
        )
    show_table(
        [
            ("run", "whole"),
            ("cycles", "right"),
            ("damping", "right"),
            ("model", "right"),
            ("top kN", "right"),
            ("model", "right"),
            ("rms kN", "right"),
            ("worst %", "right"),
            ("end °C", "right"),
            ("sensor off K", "right"),
        ],
        rows,
        title="Runs, measured and by the model",
    )


def _write_pictures(
    model: SpringModel, runs: list[MeasuredRun], answers: list[Answer], out: Path, kind: str
) -> None:
    from bufferstand.cli.model import picture_comparison, picture_warming, save_picture

    for run, given in zip(runs, answers, strict=True):
        target = out / f"{run.path.stem}-loops.{kind}"
        save_picture(picture_comparison(model, run.drive, given), target)
        click.echo(f"written: {target}")
        if run.drive.sensor_C.size > 1:
            target = out / f"{run.path.stem}-temperature.{kind}"
            save_picture(picture_warming(run.drive, given), target)
            click.echo(f"written: {target}")
