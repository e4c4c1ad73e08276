"""``bufferstand model compare``: does the model say what was measured?"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from cli.model_pictures import picture_comparison, picture_warming, save_picture
from cli.model_runs import MeasuredRun, read_runs
from cli.model_view import show_cycles
from cli.options import EXISTING, FOLDER, show_table, warn
from foundation.errors import ExitStatus
from model.file import load_model
from model.identification.identify import experiment_of
from model.identification.response import Answer, BandStage, LagStage, answer
from model.identification.validation import CycleCheck, check_cycles
from model.spring import SpringModel


@click.command(
    "compare", epilog="Example:  bufferstand model compare spring.toml campaign/runs --out pictures"
)
@click.argument("model_file", metavar="MODEL.toml", type=EXISTING)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option("--out", metavar="DIR", type=FOLDER, help="Write pictures as the paper's Figs 10 to 12.")
@click.option("--format", "kind", type=click.Choice(["png", "svg"]), default="png", show_default=True)
@click.option(
    "--ambient", "ambient_C", metavar="C", type=float, help="Of the air (default the run's own sensor)."
)
@click.option(
    "--temperature",
    "temperature_C",
    metavar="C",
    type=float,
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
    model = load_model(model_file)
    runs = read_runs(paths, ambient_C)
    answers = [_answer(model, run, temperature_C, isothermal) for run in runs]
    checks = [check_cycles(experiment_of(run.drive), given) for run, given in zip(runs, answers, strict=True)]
    _show_runs(runs, answers, checks)
    show_cycles("Cycles", [check for group in checks for check in group])
    for sentence in model.warnings(
        min(float(given.temperature_C.min()) for given in answers),
        max(float(given.temperature_C.max()) for given in answers),
    ):
        warn(sentence)
    if out is not None:
        _write_pictures(model, runs, answers, out, kind)
    return ExitStatus.DONE


def _answer(model: SpringModel, run: MeasuredRun, temperature_C: float | None, isothermal: bool) -> Answer:
    drive = run.drive
    start = temperature_C
    if start is None:
        start = float(np.mean(drive.sensor_C[:3])) if drive.sensor_C.size else drive.ambient_C
        if not drive.sensor_C.size:
            warn(f"{run.path.name}: no temperature of the specimen; {start:.1f} °C is assumed")
    band = BandStage.of(model.tables, drive.stroke_mm)
    lag = LagStage.of(band, drive.time_s, model.viscous.tau_s)
    return answer(
        model,
        drive.time_s,
        band,
        lag,
        start_C=start,
        sensor_start_C=start,
        ambient_C=start if isothermal else drive.ambient_C,
        isothermal=isothermal,
    )


def _show_runs(runs: list[MeasuredRun], answers: list[Answer], checks: list[list[CycleCheck]]) -> None:
    rows = []
    for run, given, group in zip(runs, answers, checks, strict=True):
        drive = run.drive
        counted = experiment_of(drive).used
        rest = (given.force_kN[drive.node] - drive.force_kN)[counted]
        sensor = np.interp(drive.sensor_s, drive.time_s, given.sensor_C) - drive.sensor_C
        span = float(drive.force_kN.max())
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
            ("peak kN", "right"),
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
    for run, given in zip(runs, answers, strict=True):
        target = out / f"{run.path.stem}-loops.{kind}"
        save_picture(picture_comparison(model, run.drive, given), target)
        click.echo(f"written: {target}")
        if run.drive.sensor_C.size > 1:
            target = out / f"{run.path.stem}-temperature.{kind}"
            save_picture(picture_warming(run.drive, given), target)
            click.echo(f"written: {target}")
