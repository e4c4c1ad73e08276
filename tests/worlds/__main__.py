"""Lives seeded worlds: ``python -m tests.worlds --seeds N [--first K] [--jobs J] [--report FILE.md]``."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

# Before numpy is loaded: its threads wait for each other by spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.worlds.apart import Result, live
from tests.worlds.table import line, table
from tests.worlds.world import draw


def main(words: list[str] | None = None) -> int:
    """Live the worlds that are asked for; return 1 if a law was broken in one of them."""
    parser = argparse.ArgumentParser(prog="python -m tests.worlds", description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="how many worlds")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="the first one's seed")
    parser.add_argument("--jobs", type=int, default=1, metavar="J", help="so many at a time")
    parser.add_argument("--report", type=Path, metavar="FILE.md", help="where the table goes")
    parser.add_argument("--words", action="store_true", help="only say what the worlds are")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep the files of each world there")
    asked = parser.parse_args(words)
    if asked.seeds < 1 or asked.first < 0 or asked.jobs < 1:
        parser.error("--seeds and --jobs are 1 or more, --first is 0 or more")
    seeds = range(asked.first, asked.first + asked.seeds)
    if asked.words:
        print("\n".join(draw(seed).words() for seed in seeds))
        return 0
    results: list[Result] = []
    for number in (signal.SIGINT, signal.SIGTERM):  # also in the background, where they may be ignored
        signal.signal(number, signal.default_int_handler)
    try:
        for result in _lived(seeds, asked.jobs, asked.keep):
            results.append(result)
            if text := line(result):
                print(f"\n{text}", flush=True)
            print(f"\r{len(results)} of {asked.seeds}", end="", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print("\ninterrupted: what there is until now", file=sys.stderr)
    print(file=sys.stderr)
    text = table(results)
    if asked.report is not None:
        asked.report.write_text(text, encoding="utf-8")
    print(text.partition("Broken:")[0])
    return int(any(result.broken for result in results))


def _lived(seeds: range, jobs: int, keep: Path | None) -> Iterator[Result]:
    """Live worlds in order, ``jobs`` at a time."""
    one = partial(_one, keep=keep)
    if jobs == 1:
        yield from map(one, seeds)
        return
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        yield from pool.map(one, seeds)


def _one(seed: int, keep: Path | None) -> Result:
    return live(draw(seed), keep=None if keep is None else keep / str(seed))


if __name__ == "__main__":
    sys.exit(main())
