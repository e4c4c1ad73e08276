"""Cuts the power: ``python -m tests.power_cut --cuts N [--seed S] [--first K]``."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter

# Before numpy is loaded: its threads wait for each other by spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.power_cut.tapes import share, tape_of


def main(words: list[str] | None = None) -> int:
    """Cut the power as often as is asked for; return 1 if anything promised was lost."""
    parser = argparse.ArgumentParser(prog="python -m tests.power_cut", description=__doc__)
    parser.add_argument("--cuts", type=int, default=30, metavar="N", help="how many cuts")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="what they are drawn by")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first one")
    asked = parser.parse_args(words)
    if asked.cuts < 1 or asked.first < 0:
        parser.error("--cuts is 1 or more, --first is 0 or more")
    from tests.power_cut.cuts import cut

    began_s = time.monotonic()
    failed: list[str] = []
    counts: Counter[str] = Counter()
    for number in range(asked.first, asked.first + asked.cuts):
        workload = share(number)
        made = cut(tape_of(workload), workload, asked.seed, number)
        counts[workload] += 1
        counts[made.manner.name] += 1
        counts["twice"] += made.twice
        if made.losses:
            failed.append(made.line())
            print(made.line(), flush=True)
        print(f"\r{number + 1 - asked.first} of {asked.cuts}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    for name, count in counts.items():
        print(f"{count:6d}  {name}")
    print(
        f"{asked.cuts} cuts, {len(failed)} with a loss, seed {asked.seed}, {time.monotonic() - began_s:.0f} s"
    )
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
