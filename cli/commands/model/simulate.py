"""``bufferstand model simulate``: what the spring does under a stroke history."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, SPRING_C, FiniteRange, ambient_option, warn
from bufferstand.foundation import BadInput, ExitStatus
from bufferstand.foundation.files import write_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_RATE_Hz = 200.0
_MOST_SAMPLES = 5e6
"""Of a sine: more fill the memory before they tell more."""
STROKE_MM = FiniteRange(min=0.0, max=1000.0)
FREQUENCY_HZ = FiniteRange(min=0.0001, max=100.0)
_COLUMNS = "time [s],stroke [mm],force [kN],temperature_1 [°C],bulk_temperature [°C],heat [J],work [J]"


@click.command(
    "simulate",
    epilog="Example:  bufferstand model simulate spring.toml --prestress 78 --amplitude 15 "
    "--frequency 0.85 --cycles 30 --out warm.csv --picture warm.png",
)
@click.argument("model_file", metavar="MODEL.toml", type=EXISTING)
@click.option(
    "--run", "run_file", metavar="FILE", type=EXISTING, help="The stroke of a run file, or of a CSV table."
)
@click.option("--prestress", "prestress_mm", metavar="MM", type=STROKE_MM, help="Mean stroke of a sine.")
@click.option("--amplitude", "amplitude_mm", metavar="MM", type=STROKE_MM, help="Half its range.")
@click.option("--frequency", "frequency_Hz", metavar="HZ", type=FREQUENCY_HZ, help="Its frequency.")
@click.option("--cycles", type=click.IntRange(1, 100_000), default=5, show_default=True, help="How many.")
@click.option(
    "--temperature",
    "temperature_C",
    metavar="C",
    type=SPRING_C,
    help="Of the spring at the start (default 25).",
)
@ambient_option("Of the air (default as the spring).")
@click.option("--isothermal", is_flag=True, help="Keep the temperature.")
@click.option("--out", metavar="FILE.csv", type=FILE, help="Table that `bufferstand import` reads.")
@click.option("--picture", metavar="FILE.png|.svg", type=FILE, help="Stroke, loop, energy and temperature.")
def command(
    model_file: Path,
    run_file: Path | None,
    prestress_mm: float | None,
    amplitude_mm: float | None,
    frequency_Hz: float | None,
    cycles: int,
    temperature_C: float | None,
    ambient_C: float | None,
    isothermal: bool,
    out: Path | None,
    picture: Path | None,
) -> int:
    """Simulate force, heat and temperature of a spring over the stroke of a run or table, or over a sine.

    A sine begins and ends at contact, with ramps at 20 mm/s. A measured stroke is de-noised first
    (docs/identification.md).
    """
    import numpy as np

    from bufferstand.cli.model import picture_simulation, save_picture
    from bufferstand.model import load_model, simulate

    model = load_model(model_file)
    sine = (prestress_mm, amplitude_mm, frequency_Hz)
    if run_file is not None and any(value is not None for value in sine):
        raise BadInput("give --run, or a sine, not both", file="--run")
    if run_file is not None:
        time, stroke = _measured(run_file)
    elif prestress_mm is None or amplitude_mm is None or frequency_Hz is None:
        raise BadInput(
            "there is no stroke to follow", remedy="give --run, or --prestress, --amplitude and --frequency"
        )
    else:
        time, stroke = _sine(prestress_mm, amplitude_mm, frequency_Hz, cycles)
    start_C = 25.0 if temperature_C is None else temperature_C
    done = simulate(model, time, stroke, temperature_C=start_C, ambient_C=ambient_C, isothermal=isothermal)
    for sentence in done.warnings:
        warn(sentence)
    over = float(stroke.max()) - model.curves.end_mm
    if over > 0.0:
        warn(f"the stroke goes {over:.2f} mm beyond the model's curves, into its stop")
    click.echo(
        f"{model.name}: {time[-1] - time[0]:.1f} s, up to {stroke.max():.1f} mm and "
        f"{done.force_kN.max():.1f} kN; {done.heat_J[-1]:.0f} J lost, spring "
        f"{done.temperature_C[0]:.1f} → {done.temperature_C[-1]:.1f} °C, sensor "
        f"{done.sensor_temperature_C[-1]:.1f} °C"
    )
    if out is not None:
        table = np.column_stack(
            [
                time,
                stroke,
                done.force_kN,
                done.sensor_temperature_C,
                done.temperature_C,
                done.heat_J,
                done.work_J,
            ]
        )
        rows = [",".join(f"{value:.9g}" for value in row) for row in table.tolist()]
        write_text(out, "\n".join([_COLUMNS, *rows]) + "\n")
        click.echo(f"written: {out}")
    if picture is not None:
        save_picture(picture_simulation(model, time, stroke, done), picture)
        click.echo(f"written: {picture}")
    return ExitStatus.DONE


def _sine(prestress: float, amplitude: float, frequency: float, cycles: int) -> tuple[Floats, Floats]:
    import numpy as np

    for name, value in (("--amplitude", amplitude), ("--frequency", frequency)):
        if not value > 0.0:
            raise BadInput(f"must be above 0, got {value:g}", file=name)
    if prestress < amplitude:
        raise BadInput(
            f"an amplitude of {amplitude:g} mm about {prestress:g} mm would leave the specimen",
            file="--amplitude",
            remedy=f"give at most {prestress:g}",
        )
    rate = max(_RATE_Hz, 200.0 * frequency)
    if (samples := cycles / frequency * rate) > _MOST_SAMPLES:
        raise BadInput(
            f"{cycles} cycles at {frequency:g} Hz are {samples:.2g} samples of the sine",
            file="--cycles",
            remedy=f"give at most {int(_MOST_SAMPLES / rate * frequency)}, or a greater --frequency",
        )
    low = prestress - amplitude
    ramp = np.linspace(0.0, low, max(2, round(low / 20.0 * rate) + 1))
    phase = np.linspace(0.0, 2.0 * np.pi * cycles, round(cycles / frequency * rate) + 1)
    stroke = np.concatenate([ramp[:-1], prestress - amplitude * np.cos(phase), ramp[-2::-1]])
    return np.arange(stroke.size) / rate, stroke


def _measured(path: Path) -> tuple[Floats, Floats]:
    from bufferstand.evaluation.loading import load_run
    from bufferstand.model.identification import reduce_run

    if path.suffix.lower() in (".csv", ".tsv", ".txt"):
        return _table(path)
    record, _ = load_run(path)
    drive = reduce_run(record.time_s, record.stroke_mm, record.force_kN, ambient_C=20.0, name=path.stem)
    return drive.time_s, drive.stroke_mm


def _table(path: Path) -> tuple[Floats, Floats]:
    """Read a plain table with columns ``time [s]`` and ``stroke [mm]``, comma separated."""
    import numpy as np

    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"cannot be read: {error}", file=path) from None
    heads = [head.strip() for head in lines[0].split(",")] if lines else []
    missing = [name for name in ("time [s]", "stroke [mm]") if name not in heads]
    if missing:
        raise BadInput(
            f"has no column “{missing[0]}”",
            file=path,
            place="line 1",
            remedy="other records are read by `bufferstand import`",
        )
    columns = [heads.index("time [s]"), heads.index("stroke [mm]")]
    values: list[list[float]] = []
    for number, line in enumerate(lines[1:], start=2):
        cells = line.split(",")
        try:
            row = [float(cells[column]) for column in columns]
        except (ValueError, IndexError):
            raise BadInput("is no row of numbers", file=path, place=f"line {number}") from None
        if not np.all(np.isfinite(row)) or (values and row[0] <= values[-1][0]):
            raise BadInput("time must rise, without gaps in the numbers", file=path, place=f"line {number}")
        values.append(row)
    if len(values) < 2:
        raise BadInput("has fewer than two rows", file=path)
    table = np.array(values)
    return table[:, 0], table[:, 1]
