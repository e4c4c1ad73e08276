"""Run benchmarks and print one table: ``python -m benchmarks [NAME …] [--smoke]``.

The table goes to standard output, the figures behind the ratios to standard error. Exit status 1 if a goal
was missed or a benchmark failed; what this machine cannot measure is said, and is no failure.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import traceback
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.common import NotHere, load, names, tell

WIDTHS = (15, 66, 8, 8)


def row(*cells: str) -> str:
    """Return a row of the table."""
    padded = (cell.ljust(width) for cell, width in zip(cells[:-1], WIDTHS, strict=True))
    return f"| {' | '.join((*padded, cells[-1]))} |"


def rows(name: str, *, smoke: bool) -> Iterator[tuple[str, bool]]:
    """Measure; yield a row for each goal, and whether the goal was met or nothing is judged."""
    try:
        benchmark = load(name)
        sizes = (benchmark.smoke if smoke else benchmark.full).keywords
        tell(f"\n{name}: {', '.join(f'{size} = {value}' for size, value in sizes.items())}")
        ratios = benchmark.ratios(smoke=smoke)
    except NotHere as lacking:
        yield row(name, str(lacking), "–", "–", "not measured"), True
    except Exception as error:  # noqa: BLE001 - one that fails must not hide the others
        traceback.print_exc()
        yield row(name, f"{type(error).__name__} (above)", "–", "–", "FAILED"), False
    else:
        for compared, ratio in ratios.items():
            goal = benchmark.goals[compared]
            met = ratio <= goal
            verdict = "not judged" if smoke else "yes" if met else "NO"
            yield row(name, compared, f"{ratio:.3f}", f"≤ {goal:.3g}", verdict), smoke or met


def load_of_machine() -> str:
    """Return how many processes want a processor, over one minute."""
    return f"{os.getloadavg()[0]:.1f}"


def main(words: Sequence[str] | None = None) -> int:
    """Measure and print; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Measure speed, as ratios.")
    parser.add_argument("name", nargs="*", metavar="NAME", help=f"of {', '.join(names())}; all without")
    parser.add_argument("--smoke", action="store_true", help="small sizes: only shows that each works")
    given = parser.parse_args(words)
    if unknown := [name for name in given.name if name not in names()]:
        parser.error(f"there is no benchmark {', '.join(unknown)}; there are {', '.join(names())}")
    before, well = load_of_machine(), True
    print(row("benchmark", "compared", "ratio", "goal", "met"))
    print(row(*("-" * width for width in WIDTHS), "---"), flush=True)
    for name in given.name or names():
        for line, fine in rows(name, smoke=given.smoke):
            print(line, flush=True)
            well &= fine
    print(
        f"\nMachine: {platform.machine()}, {os.cpu_count()} processors, load {before} before and "
        f"{load_of_machine()} after; Python {platform.python_version()}, numpy {np.__version__}."
    )
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
