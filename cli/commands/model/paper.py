"""``bufferstand model paper``: the paper's Figs 4 to 12 anew, and its figures beside ours."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.samples import sample
from bufferstand.foundation import BadInput, ExitStatus

if TYPE_CHECKING:
    from bufferstand.evaluation.figures.model_comparison import PaperComparison, PaperRow


@click.command("paper", epilog="Example:  bufferstand model paper --out paper-figures")
@click.option(
    "--out",
    required=True,
    metavar="DIR",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the pictures (SVG and PNG) and the table (comparison.md, comparison.csv).",
)
def command(out: Path) -> int:
    """Simulate the paper's runs with the shipped specimens; draw its Figs 4 to 12; compare its figures.

    The runs are evaluated like measured ones. The table says for each published figure what it is here, the
    difference, and why it cannot agree where it does not.
    """
    from bufferstand.evaluation.figures import draw, draw_png
    from bufferstand.evaluation.figures.model_comparison import compare_with_paper
    from bufferstand.model import load_model

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=out) from None
    models = sample("models")
    found = compare_with_paper(
        load_model(models / "category-a-frequency.toml"), load_model(models / "draw-hook-elastomer.toml")
    )
    try:
        for figure in found.figures:
            (out / f"{figure.name}.svg").write_text(draw(figure.plot), encoding="utf-8")
            (out / f"{figure.name}.png").write_bytes(draw_png(figure.plot))
        (out / "comparison.md").write_text(page(found), encoding="utf-8")
        (out / "comparison.csv").write_text(as_csv(found.rows), encoding="utf-8")
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=out) from None
    click.echo(f"{len(found.figures)} pictures and {len(found.rows)} figures in {out}")
    return int(ExitStatus.DONE)


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
