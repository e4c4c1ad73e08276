"""Long runs: ``python -m tests.soak virtual [--hours H] | real [--hours H]``, with curves and a verdict."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

# Before numpy is loaded: its threads wait for each other by spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.soak import real, virtual
from tests.soak.curves import Curves

ROOT = Path(__file__).resolve().parents[2]
VIRTUAL_H, REAL_H = 24.0, 2.0


def main(words: list[str] | None = None) -> int:
    """Do what is asked for; return 1 if something grew, or a sample was lost."""
    asked = _parser().parse_args(words)

    def save(curves: Curves) -> None:
        if asked.curves is not None:
            curves.save(asked.curves)

    def tell(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    faults: list[str] = []
    try:
        if asked.of == "virtual":
            limits = virtual.LIMITS
            curves = virtual.campaigns(asked.campaign, asked.hours or VIRTUAL_H, tell, save)
        else:
            limits = real.LIMITS
            curves, faults = real.campaign_with_page(asked.hours or REAL_H, asked.look_s, tell, save)
    except KeyboardInterrupt:
        tell("interrupted: --curves has what there is until now")
        return 130
    print(curves.table(limits))
    if asked.picture is not None:
        curves.draw(asked.picture)
    faults = [*faults, *curves.grown(limits)]
    for fault in faults:
        print(f"NOT FLAT: {fault}")
    return int(bool(faults))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("of", choices=("virtual", "real"), help="in-process stand, or commands and a page")
    parser.add_argument(
        "--hours", type=_hours, metavar="H", help=f"of the stand; {VIRTUAL_H:g} or {REAL_H:g}"
    )
    parser.add_argument(
        "--campaign", type=Path, default=ROOT / "sample_runs" / "demo.toml", metavar="FILE.toml",
        help="what virtual repeats",
    )  # fmt: skip
    parser.add_argument("--look-s", type=_hours, default=60.0, metavar="S", help="real: from look to look")
    parser.add_argument("--curves", type=Path, metavar="FILE.json", help="where the looks are kept")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="where they are drawn")
    return parser


def _hours(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1e5:
        raise argparse.ArgumentTypeError("above 0, below 100000")
    return value


if __name__ == "__main__":
    sys.exit(main())
