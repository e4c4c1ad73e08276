"""``bufferstand model export``: the spring for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click

from bufferstand.cli.options import EXISTING, FILE, FOLDER, SPRING_C, warn
from bufferstand.foundation import BadInput
from bufferstand.model.export import Positive, Units


@click.command(
    "export",
    epilog="Example:  bufferstand model export sample_runs/models/category-a-elastomer.toml --fmu buffer.fmu",
)
@click.argument("model", metavar="MODEL.toml", type=EXISTING)
@click.option("--fmu", metavar="FILE.fmu", type=FILE, help="FMI 2.0, Model Exchange and Co-Simulation.")
@click.option("--tables", metavar="DIR", type=FOLDER, help="Curves as CSV and JSON, and in Fancher's form.")
@click.option("--modelica", metavar="DIR", type=FOLDER, help="Curves as a table file of Modelica.")
@click.option("--mbdyn", metavar="DIR", type=FOLDER, help="Curves as scalar functions of MBDyn.")
@click.option("--c", "c_folder", metavar="DIR", type=FOLDER, help="One C header with core and curves.")
@click.option(
    "--tension-positive", "positive", flag_value="tension", help="FMU: stroke and force of tension positive."
)
@click.option("--compression-positive", "positive", flag_value="compression", help="FMU: of compression.")
@click.option(
    "--units",
    type=click.Choice(get_args(Units)),
    default="SI",
    show_default=True,
    help="FMU: units of stroke, stroke rate and force.",
)
@click.option(
    "--temperature",
    "temperatures",
    metavar="°C",
    type=SPRING_C,
    multiple=True,
    help="Of a table; repeatable.",
)
@click.option(
    "--initial-temperature",
    metavar="°C",
    type=SPRING_C,
    help="FMU: spring at the start. [default: T_ref]",
)
@click.option("--ambient", metavar="°C", type=SPRING_C, help="FMU: surroundings. [default: T_ref]")
def command(
    model: Path,
    fmu: Path | None,
    tables: Path | None,
    modelica: Path | None,
    mbdyn: Path | None,
    c_folder: Path | None,
    positive: Positive | None,
    units: Units,
    temperatures: tuple[float, ...],
    initial_temperature: float | None,
    ambient: float | None,
) -> None:
    """Hand a spring model on to multibody tools: as FMU, as tables, as C header.

    Each export says in itself what it loses. The signs of the model file hold (loading positive) unless one
    of the two switches is given; the FMU also has a parameter for it.
    """
    from bufferstand.model import load_model
    from bufferstand.model.export import (
        FmuOptions,
        export_c,
        export_fmu,
        export_mbdyn,
        export_modelica,
        export_tables,
    )

    if not (fmu or tables or modelica or mbdyn or c_folder):
        ways = "--fmu, --tables, --modelica, --mbdyn or --c"
        raise BadInput("nothing to write", file="model export", remedy=f"give {ways}")
    if temperatures and not (tables or modelica or mbdyn):
        raise BadInput("only tables hold at chosen temperatures", file="--temperature", remedy="add --tables")
    spring = load_model(model)
    written: list[Path] = []
    if fmu:
        options = FmuOptions(units, positive or "loading", initial_temperature, ambient)
        export_fmu(spring, fmu, options)
        written.append(fmu)
    if tables:
        written += export_tables(spring, tables, model.stem, temperatures or None)
    if modelica:
        written.append(export_modelica(spring, modelica, model.stem, temperatures or None))
    if mbdyn:
        written.append(export_mbdyn(spring, mbdyn, model.stem, temperatures or None))
    if c_folder:
        written += export_c(spring, c_folder, model.stem)
    reference = spring.temperature.reference_C
    for note in spring.warnings(min((reference, *temperatures)), max((reference, *temperatures))):
        warn(note)
    for sentence in spring.statements:
        warn(sentence)
    for path in written:
        click.echo(path)
