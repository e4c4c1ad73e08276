"""`python -m tests.fuzz [TARGET…] --inputs N --seed S [--seconds S]`: give targets mutated inputs.

Exit status 1: some input ended in something else than a value or one line. `--coverage-guided` needs Atheris
(`pip install atheris`) and takes one target.
"""

from __future__ import annotations

import argparse
import faulthandler
import importlib
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path


def main() -> int:
    """Run what was asked for; print a row for each target, and each failure with what repeats it."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("target", nargs="*", help="default: all; --list names them")
    parser.add_argument("--inputs", type=int, default=1000, help="for each target")
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="for each target, at most")
    parser.add_argument("--save", type=Path, help="folder for the inputs that end badly")
    parser.add_argument("--list", action="store_true", help="name the targets")
    parser.add_argument("--coverage-guided", action="store_true", help="by Atheris: one target")
    a = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    faulthandler.enable()
    if a.coverage_guided:
        guided = importlib.import_module("tests.fuzz.guided")
        guided.fuzz(a.target[0], a.seed, a.inputs, a.seconds, a.save)
        return 0
    from tests.fuzz.catalogue import TARGETS

    if a.list:
        print("\n".join(f"{one.name:26}{one.what}" for one in TARGETS.values()))
        return 0
    if unknown := sorted(set(a.target) - set(TARGETS)):
        parser.error(f"there is no target {', '.join(unknown)}; --list names them")
    numbers = range(a.first, a.first + a.inputs)
    failed = [_run(name, a.seed, numbers, a.seconds, a.save) for name in a.target or TARGETS]
    return int(any(failed))


def _run(name: str, seed: int, numbers: Sequence[int], seconds: float, save: Path | None) -> int:
    """Run a target, print its row and its failures; return how many there are."""
    from tests.fuzz.catalogue import TARGETS
    from tests.fuzz.running import run

    target, began_s = TARGETS[name], time.monotonic()
    with tempfile.TemporaryDirectory() as folder, target.begin(Path(folder)) as case:
        done, failures = run(target, case, seed, numbers, seconds)
    took_s = time.monotonic() - began_s
    print(f"{name:26}{done:9} inputs {took_s:8.0f} s {len(failures):6} failures", flush=True)
    kinds: dict[str, int] = {}
    for one in failures:
        kind = one.what.partition(":")[0] + one.what.rpartition("(")[2][-60:]
        kinds[kind] = kinds.get(kind, 0) + 1
        if kinds[kind] <= 3:
            print(f"  {one}", flush=True)
        if save is not None:
            save.mkdir(parents=True, exist_ok=True)
            (save / f"{name}-{seed}-{one.number}").write_bytes(one.content)
    return len(failures)


if __name__ == "__main__":
    sys.exit(main())
