"""``bufferstand compare``: what moved between two evaluations?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import FILE, check_named, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import ExitStatus

if TYPE_CHECKING:
    from bufferstand.evaluation.archive import EvaluationComparison, Move

MOST_SHOWN = 25
"""Moves and changed verdicts that are printed; all are in the table and the JSON."""


@click.command("compare", epilog="Example:  bufferstand compare before.json after.json --table moves.csv")
@click.argument("old", metavar="OLD.json", type=FILE)
@click.argument("new", metavar="NEW.json", type=FILE)
@click.option("--cycles", is_flag=True, help="Compare every cycle too, not only the means of the runs.")
@click.option(
    "--json", "json_file", metavar="FILE|-", help="Write the comparison as JSON; - is standard output."
)
@click.option(
    "--table", metavar="FILE", type=FILE, help="Write a row a figure that moved (.csv, .parquet, .xlsx)."
)
def command(old: Path, new: Path, cycles: bool, json_file: str | None, table: Path | None) -> int:
    """Compare two evaluations: which figures and verdicts moved, by how much, and beyond their uncertainty?

    OLD.json and NEW.json are what “evaluate --json” wrote: of the same runs with other settings or by another
    version, or of other recordings of the same steps.
    """
    from bufferstand.evaluation.archive import Move, compare_evaluations, load_evaluation
    from bufferstand.evaluation.document import check_table_name, write_frames

    if table is not None:
        check_table_name(table)
    check_named(json_file, table)
    found = compare_evaluations(load_evaluation(old), load_evaluation(new), cycles=cycles)
    if json_file is not None:
        write_json(_document(found), json_file)
    if table is not None:
        import pandas as pd

        columns = list(Move("", "", None, None, None, None).row())
        frame = pd.DataFrame([move.row() for move in found.moves], columns=columns)
        write_frames({"moves": frame}, table)
    if json_file != "-":
        _show(found)
    return ExitStatus.DONE


def _document(found: EvaluationComparison) -> dict[str, Any]:
    return {
        "schema": "bufferstand/comparison/1",
        "changed": {name: {"old": a, "new": b} for name, (a, b) in found.changed.items()},
        "runs_compared": found.compared,
        "other_recordings": list(found.other_recordings),
        "only_old": list(found.only_old),
        "only_new": list(found.only_new),
        "moves": [move.row() for move in found.moves],
        "verdicts": [asdict(change) for change in found.verdicts],
    }


def _show(found: EvaluationComparison) -> None:
    for name, (a, b) in found.changed.items():
        click.echo(f"{name}: {_short(a)} → {_short(b)}")
    counts = f"{found.compared} runs compared"
    if found.other_recordings:
        counts += f", {len(found.other_recordings)} of them other recordings of the same id"
    click.echo(counts)
    for names, where in ((found.only_old, "old"), (found.only_new, "new")):
        if names:
            click.echo(f"only in the {where} evaluation: {_listed(names)}")
    if not found.moves:
        click.echo("no figure moved")
    else:
        _show_quantities(found.moves)
        _show_largest(found.moves)
    for change in found.verdicts[:MOST_SHOWN]:
        of = f" {change.requirement}" if change.requirement else " verdict"
        cycle = "" if change.cycle is None else f", cycle {change.cycle}"
        click.echo(f"{change.run}:{of}{cycle}: {change.old or 'none'} → {change.new or 'none'}")
    if len(found.verdicts) > MOST_SHOWN:
        click.echo(f"… and {len(found.verdicts) - MOST_SHOWN} more verdicts (--json names them)")


def _show_quantities(moves: Sequence[Move]) -> None:
    """Print a line a quantity: how many moved, by how much at most, and how many beyond their uncertainty."""
    groups: dict[str, list[Move]] = {}
    for move in moves:
        groups.setdefault(move.quantity, []).append(move)
    rows = []
    for quantity, own in groups.items():
        shares = [share for move in own if (share := move.share_of_uncertainty) is not None]
        relative = [abs(value) for move in own if (value := move.relative) is not None]
        rows.append(
            (
                quantity,
                str(len(own)),
                f"{max(relative):.3%}" if relative else "—",
                f"{max(shares):.2f}" if shares else "—",
                str(sum(share > 1.0 for share in shares)),
                str(len(own) - len(shares)),
            )
        )
    click.echo()
    show_table(
        [("quantity", "left"), ("moved", "right"), ("at most", "right"), ("at most, of U", "right"),
         ("beyond U", "right"), ("U unknown", "right")],
        rows,
    )  # fmt: skip


def _show_largest(moves: Sequence[Move]) -> None:
    """Print the moves one by one, the largest against their uncertainty first."""
    ordered = sorted(
        moves, key=lambda move: (-(move.share_of_uncertainty or 0.0), -abs(move.relative or 0.0))
    )
    click.echo()
    show_table(
        [("run", "whole"), ("cycle", "right"), ("quantity", "left"), ("old", "right"), ("new", "right"),
         ("difference", "right"), ("%", "right"), ("U", "right"), ("beyond U", "left")],
        [
            (
                move.run,
                "mean" if move.cycle is None else str(move.cycle),
                move.quantity,
                _number(move.old),
                _number(move.new),
                "—" if move.difference is None else f"{move.difference:+.3g}",
                "—" if move.relative is None else f"{100.0 * move.relative:+.3g}",
                _number(move.expanded_uncertainty, 3),
                {True: "yes", False: "no", None: "not known"}[move.beyond],
            )
            for move in ordered[:MOST_SHOWN]
        ],
    )  # fmt: skip
    if len(moves) > MOST_SHOWN:
        click.echo(f"… and {len(moves) - MOST_SHOWN} more (--table FILE has all)")
    click.echo()


def _number(value: float | None, digits: int = 6) -> str:
    return "—" if value is None else f"{value:.{digits}g}"


def _short(value: object) -> str:
    text = "none" if value is None else str(value)
    return f"{text[:12]}…" if len(text) == 64 else text


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:10])
    return shown if len(names) <= 10 else f"{shown} and {len(names) - 10} more"
