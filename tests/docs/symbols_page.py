"""Make the page of symbols, its last table from the catalogue: python -m tests.docs.symbols_page

It is written in place: what stands before that table is kept.
"""

from __future__ import annotations

from pathlib import Path

from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.catalogue.quantity import KINDS, Quantity

PAGE = Path(__file__).parents[2] / "docs" / "symbols.md"
HEAD = """\
## Quantities of a cycle
Made from the catalogue (`evaluation/catalogue/cycle_quantities.py`) by `python -m tests.docs.symbols_page`.

| symbol | name | unit | meaning | source |
|---|---|---|---|---|
"""


def row(entry: Quantity) -> str:
    """Return the row of a quantity."""
    kinds = "" if entry.kinds == KINDS else f"; of {' and '.join(sorted(entry.kinds))} runs"
    cells = (entry.symbol, f"`{entry.name}`", entry.unit, entry.meaning + kinds, entry.source)
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def page() -> str:
    """Return the page."""
    before, _, _ = PAGE.read_text(encoding="utf-8").partition(HEAD)
    return f"{before.rstrip()}\n\n{HEAD}" + "".join(f"{row(entry)}\n" for entry in QUANTITIES)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
