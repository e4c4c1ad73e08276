"""``bufferstand model paper``: the paper's Figs 4 to 12 anew, and its figures beside ours."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE, SPRING_C, warn
from bufferstand.cli.samples import sample
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import BadInput, ExitStatus

if TYPE_CHECKING:
    from bufferstand.evaluation.figures.model_comparison import (
        MeasuredComparison,
        PaperComparison,
        PaperFigure,
        PaperRow,
    )
    from bufferstand.model import SpringModel


@click.command("paper", epilog="Example:  bufferstand model paper --out paper-figures")
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=EXISTING)
@click.option(
    "--out",
    required=True,
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the pictures (SVG and PNG) and the table (comparison.md, comparison.csv).",
)
@click.option(
    "--model",
    "model_file",
    metavar="MODEL.toml",
    type=FILE,
    help="The buffer's model (default the shipped one); to be given with runs, see model fit.",
)
@click.option(
    "--temperature",
    "temperature_C",
    metavar="C",
    type=SPRING_C,
    default=35.0,
    show_default=True,
    help="Of the model's spring in Fig. 10 beside measured loops.",
)
def command(paths: tuple[Path, ...], out: Path, model_file: Path | None, temperature_C: float) -> int:
    """Simulate the paper's runs with the shipped specimens; draw its Figs 4 to 12; compare its figures.

    The runs are evaluated like measured ones. The table says for each published figure what it is here, the
    difference, and why it cannot agree where it does not. With recorded runs (PATH...), Figs 10 and 12 are
    drawn from these as well: measured loops, and those of their own model over the same strokes.
    """
    from bufferstand.evaluation.figures.model_comparison import compare_with_paper
    from bufferstand.model import load_model

    if paths and model_file is None:
        raise BadInput(
            "is to be given with recorded runs: the shipped model is not that of your specimen",
            file="--model",
            remedy="make it: bufferstand model fit PATH... --out MODEL.toml",
        )
    models = sample("models")
    buffer = load_model(model_file or models / "category-a-frequency.toml")
    measured = _measured(paths, buffer, temperature_C) if paths else None
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=out) from None
    found = compare_with_paper(buffer, load_model(models / "draw-hook-elastomer.toml"))
    try:
        _draw(found.figures, out)
        (out / "comparison.md").write_text(page(found), encoding="utf-8", newline="\n")
        (out / "comparison.csv").write_text(as_csv(found.rows), encoding="utf-8", newline="\n")
        if measured is not None:
            _draw(measured.figures, out)
            (out / "measured.csv").write_text(measured_csv(measured), encoding="utf-8", newline="\n")
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=out) from None
    click.echo(f"{len(found.figures)} pictures and {len(found.rows)} figures in {out}")
    if measured is not None:
        _show_measured(measured)
    return int(ExitStatus.DONE)


def _measured(paths: tuple[Path, ...], model: SpringModel, temperature_C: float) -> MeasuredComparison:
    from bufferstand.cli.model import read_runs
    from bufferstand.evaluation.figures.model_comparison import compare_measured

    runs = read_runs(paths)
    static, harmonic = (
        [run.drive for run in runs if run.facts.kind == kind] for kind in ("static", "harmonic")
    )
    return compare_measured(model, static, harmonic, temperature_C)


def _draw(figures: tuple[PaperFigure, ...], out: Path) -> None:
    from bufferstand.evaluation.figures import draw, draw_png

    for figure in figures:
        (out / f"{figure.name}.svg").write_text(draw(figure.plot), encoding="utf-8", newline="\n")
        (out / f"{figure.name}.png").write_bytes(draw_png(figure.plot))


def _show_measured(found: MeasuredComparison) -> None:
    """Print the measured figures beside the model's, and what could not be drawn."""
    if found.rows:
        show_table(
            [
                ("Fig.", "left"),
                ("run", "whole"),
                ("quantity", "left"),
                ("measured", "right"),
                ("model", "right"),
                ("unit", "left"),
            ],
            [
                [r.figure, r.run, r.quantity, f"{r.measured:.4g}", f"{r.model:.4g}", r.unit]
                for r in found.rows
            ],
            title="Figs 10 and 12, measured and by the model",
        )
    for sentence in found.missing:
        warn(f"not drawn: {sentence}")


def measured_csv(found: MeasuredComparison) -> str:
    """Return the measured figures beside the model's as CSV with all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["figure", "run", "quantity", "unit", "measured", "model"])
    for row in found.rows:
        writer.writerow([row.figure, row.run, row.quantity, row.unit, row.measured, row.model])
    return text.getvalue()


def page(found: PaperComparison) -> str:
    """Return the comparison as a Markdown page: the table, then the pictures."""
    lines = ["# The paper's figures, simulated", "", *table(found.rows), ""]
    for figure in found.figures:
        lines += [f"## {figure.name}: {figure.caption}", "", f"![{figure.caption}]({figure.name}.png)", ""]
    return "\n".join(lines)


def table(rows: tuple[PaperRow, ...]) -> list[str]:
    """Return the lines of the Markdown table."""
    lines = ["| Fig. | quantity | paper | ours | difference | remark |", "|---|---|---|---|---|---|"]
    for row in rows:
        unit = "" if row.unit == "1" else f" {row.unit}"
        paper = "–" if row.paper is None else f"{row.paper:g}{unit}".replace("-", "−")
        difference = "–" if row.difference is None else f"{_number(row.difference, sign=True)}{unit}"
        ours = f"{_number(row.ours)}{unit}"
        lines.append(f"| {row.figure} | {row.quantity} | {paper} | {ours} | {difference} | {row.remark} |")
    return lines


def as_csv(rows: tuple[PaperRow, ...]) -> str:
    """Return the table as CSV with all digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["figure", "quantity", "unit", "paper", "ours", "difference", "remark"])
    for row in rows:
        writer.writerow([row.figure, row.quantity, row.unit, row.paper, row.ours, row.difference, row.remark])
    return text.getvalue()


def _number(value: float, *, sign: bool = False) -> str:
    """Return four significant digits, but no more than four decimals, with a real minus sign."""
    size = abs(value)
    decimals = 4 if size < 1.0 else 3 if size < 10.0 else 2 if size < 100.0 else 1
    rounded = round(value, decimals) + 0.0
    return (
        f"{rounded:+.{decimals}f}".replace("-", "−") if sign else f"{rounded:.{decimals}f}".replace("-", "−")
    )
