"""The matrix as a table: ``python -m tests.two_programs.table [--side-by-side N] [--short] [WORD…]``.

Words choose cells (``"hold" "resume"``: those whose text has all of them). Standard output is the table in
Markdown, a row a cell or (``--short``) one for all that differ only in the phase or in when the second came.
Standard error is what went wrong, as it comes.
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


SHORT_HEAD = (
    "first",
    "phases; watchdog",
    "second",
    "cells",
    "second came after",
    "safe after, of at most",
    "exit statuses",
    "commands of a refused second",
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


def short(rows: Iterable[Row]) -> str:
    """Return the rows in Markdown, those that differ only in the phase or in when the second came as one."""
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        cell = row.cell
        killed = "" if cell.kill_after_s is None else f"killed in {cell.phase}, {cell.watchdog_s:g} s"
        groups.setdefault((cell.first, killed, cell.second), []).append(row)
    lines = ["| " + " | ".join(SHORT_HEAD) + " |", "|" + "---|" * len(SHORT_HEAD)]
    for (first, killed, second), group in groups.items():
        phases = killed or ", ".join(dict.fromkeys(row.cell.phase for row in group))
        columns = (first, phases, second, str(len(group)), *_figures(group))
        lines.append("| " + " | ".join(columns) + " |")
    return "\n".join(lines)


def _figures(group: list[Row]) -> tuple[str, ...]:
    came = [row.came_s for row in group if row.came_s is not None]
    safe = [row.safe_s for row in group]
    statuses = sorted({f"{row.first_status}, {row.second_status}" for row in group})
    refused = [row.writes for row in group if row.second_status not in (0, 3)]
    stated = min((row.stated_s for row in group if row.stated_s is not None), default=None)
    safest = "never" if None in safe else f"{max(one for one in safe if one is not None):.1f} s"
    return (
        f"{min(came):.1f} to {max(came):.1f} s" if came else "–",
        safest + ("" if stated is None else f" of {stated:.1f} s"),
        " / ".join(statuses),
        str(max(refused)) if refused else "–",
        str(sum(bool(row.wrong) for row in group)),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side-by-side", type=int, default=SIDE_BY_SIDE)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("words", nargs="*")
    chosen = parser.parse_args()
    wanted = [cell for cell in cells() if all(word in str(cell) for word in chosen.words)]

    def told(row: Row) -> None:
        print(
            f"{row.cell}: {row.first_status}, {row.second_status}", *row.wrong, sep="\n    ", file=sys.stderr
        )

    with tempfile.TemporaryDirectory() as folder:
        rows = fill(wanted, Path(folder), chosen.side_by_side, told)
    print(short(rows) if chosen.short else table(rows))
    print(f"{sum(not row.wrong for row in rows)} of {len(rows)} as they must be", file=sys.stderr)


if __name__ == "__main__":
    main()
