"""How often noisy runs choose the family that they came from.

``python -m tests.model.families.study [TRIALS]`` in the project's folder prints how often.
"""

from __future__ import annotations

import sys
from collections import Counter

from bufferstand.model.families import FAMILIES, rank_families
from tests.model.families.worlds import FRAME, TRUE, measured, start


def trials(count: int) -> list[tuple[str, int]]:
    """Return family and seed of so many trials, all families in turn."""
    return [(tuple(TRUE)[number % len(TRUE)], number // len(TRUE)) for number in range(count)]


def chosen(name: str, seed: int) -> tuple[str, bool]:
    """Return the likeliest family, and whether the generating one is it or not told from it."""
    ranking = rank_families(FAMILIES, FRAME, start(), measured(name, seed))
    left = {one.family.name for one in ranking.not_told_apart}
    best = ranking.fitted[0].family.name
    return best, name == best or name in left


def main() -> None:
    """Print how often each family was chosen."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    found: Counter[str] = Counter()
    of: Counter[str] = Counter()
    within: Counter[str] = Counter()
    for name, seed in trials(count):
        best, kept = chosen(name, seed)
        of[name] += 1
        found[name] += best == name
        within[name] += kept
        if best != name:
            print(f"{name}, seed {seed}: {best}{' (not told apart)' if kept else ''}", flush=True)
    print("| generating family | trials | likeliest | likeliest or not told from it |\n|---|---|---|---|")
    for name, total in of.items():
        print(f"| {name} | {total} | {found[name]} | {within[name]} |")
    print(f"| all | {count} | {found.total()} | {within.total()} |")


if __name__ == "__main__":
    main()
