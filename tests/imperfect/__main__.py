"""`python -m tests.imperfect NUMBER --out DIR`, or a study: `--count N [--first N] [--report FILE.md]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import study, world
from .imperfections import KINDS


def main() -> None:
    """Write one record with its truth and its judgement, or judge many."""
    parser = argparse.ArgumentParser(prog="python -m tests.imperfect", description=__doc__)
    parser.add_argument("number", type=int, nargs="?", help="the record to make")
    parser.add_argument("--out", type=Path, help="folder for its files")
    parser.add_argument(
        "--only", choices=["clean", *(k.name for k in KINDS)], help="with this imperfection alone"
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--report", type=Path)
    a = parser.parse_args()
    if a.number is None:
        print(study.run(a.first, a.count, a.jobs, a.only, a.report))
        return
    scene = world.make(a.number, a.only)
    print(f"record {a.number}: {scene.facts}, {scene.motion.facts}, {scene.motion.shape}")
    print(f"stated: {scene.stated}")
    for fault in scene.applied:
        print(f"  {fault.name}: {fault.size}")
    for c in scene.cycles:
        print(
            f"  stroke {c.number}: {c.start_s:.3f} to {c.end_s:.3f} s, top {c.top_s:.3f} s, whole {c.whole}"
        )
        print("    " + ", ".join(f"{k} {v[0]:.6g}" for k, v in c.figures.items()))
        print("    " + ", ".join(f"{k} {v}" for k, v in c.readings.items()))
    for finding in study.one(a.number, a.only, a.out).findings:
        print("  !", *finding, sep=" | ")


if __name__ == "__main__":
    main()
