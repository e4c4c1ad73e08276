"""``bufferstand model twin``: which cycles lie outside the model's band, and what has moved?"""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.options import EXISTING, ambient_option, in_a_row_option, warn, write_json
from bufferstand.foundation import ExitStatus


@click.command("twin", epilog="Example:  bufferstand model twin spring.toml campaign/runs")
@click.argument("model_file", metavar="MODEL.toml", type=EXISTING)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@ambient_option("Of the air (default the run's own sensor).")
@in_a_row_option
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write every cycle as JSON; - is standard output."
)
def command(
    model_file: Path, paths: tuple[Path, ...], ambient_C: float | None, in_a_row: bool, json_file: str | None
) -> int:
    """Judge recorded runs by a fitted model: which cycles lie outside its band, and what has moved.

    The model must be of model fit, with its uncertainties ([fit]). Nothing is fitted: every cycle is looked
    at with the strokes as measured (docs/twin.md).
    """
    from bufferstand.cli.model import read_runs, show_twin, sittings, twin_document
    from bufferstand.model.twin import load_known, twin_of_runs

    model = load_known(model_file)
    runs = read_runs(paths, ambient_C)
    for run in runs:
        if not run.drive.rested:
            warn(
                f"{run.path.name}: the spring had not rested, so that its warmth is known to 2 K only: the "
                "band is the wider for it"
                + ("" if in_a_row else " (--in-a-row, if these runs are all there was)")
            )
    _, steps = twin_of_runs(model, sittings(runs, chain=in_a_row))
    if json_file is not None:
        write_json(twin_document(steps), json_file)
    if json_file != "-":
        show_twin(steps)
    return ExitStatus.DONE
