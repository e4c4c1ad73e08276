"""The matrix as a table: ``python -m tests.two_programs.table [--side-by-side N] [WORD…]``.

Words choose cells (``"hold" "resume"``: those whose text has all of them). Standard output is the table in
Markdown, standard error what went wrong, as it comes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from tests.two_programs.cells import Row
from tests.two_programs.matrix import SIDE_BY_SIDE, cells, fill

HEAD = (
    "first",
    "phase",
    "watchdog",
    "second",
    "came after",
    "it met",
    "safe after (stated)",
    "commands of the second",
    "exit statuses",
    "last line of the second",
    "wrong",
)


def line(row: Row) -> tuple[str, ...]:
    """Return a row's columns."""
    cell = row.cell
    phase = cell.phase if cell.kill_after_s is None else f"killed in {cell.phase}"
    stated = "" if row.stated_s is None else f" ({row.stated_s:.1f} s)"
    return (
        cell.first,
        phase,
        f"{cell.watchdog_s:g} s",
        cell.second,
        "–" if row.came_s is None else f"{row.came_s:.1f} s",
        row.met or "–",
        ("never" if row.safe_s is None else f"{row.safe_s:.1f} s") + stated,
        str(row.writes),
        f"{row.first_status}, {row.second_status}",
        row.second_line.replace("|", "/")[:100],
        "; ".join(row.wrong).replace("|", "/")[:200] or "nothing",
    )


def table(rows: Iterable[Row]) -> str:
    """Return the rows in Markdown."""
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    return "\n".join([*lines, *("| " + " | ".join(line(row)) + " |" for row in rows)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side-by-side", type=int, default=SIDE_BY_SIDE)
    parser.add_argument("words", nargs="*")
    chosen = parser.parse_args()
    wanted = [cell for cell in cells() if all(word in str(cell) for word in chosen.words)]

    def told(row: Row) -> None:
        print(
            f"{row.cell}: {row.first_status}, {row.second_status}", *row.wrong, sep="\n    ", file=sys.stderr
        )

    with tempfile.TemporaryDirectory() as folder:
        rows = fill(wanted, Path(folder), chosen.side_by_side, told)
    print(table(rows))
    print(f"{sum(not row.wrong for row in rows)} of {len(rows)} as they must be", file=sys.stderr)


if __name__ == "__main__":
    main()
