"""`python -m tests.mutants [MODULE…]`: change the code place by place; each change must fail a test.

MODULE is a file or a folder of `--list`; all where none is named. Exit status 1: a change that no test
noticed and that `tests/mutants/accepted.toml` does not explain, or an entry there that no longer occurs.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.mutants.accepted import accepted, out_of_date, unexplained
from tests.mutants.generating import ROOT, is_set_up, mutants_of, set_up
from tests.mutants.running import CannotTry, Outcome, try_all
from tests.mutants.scores import remember
from tests.mutants.targets import MODULES, PARTS


def main() -> int:
    """Try what was asked for; print a row for each module, and every survivor."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("module", nargs="*", help="default: all")
    parser.add_argument("--list", action="store_true", help="name the modules and their tests")
    parser.add_argument("--setup", action="store_true", help="only make the environment with cosmic-ray")
    parser.add_argument("--limit", type=int, help="of each module at most so many mutants, drawn")
    parser.add_argument("--seed", type=int, default=0, help="of that drawing")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes at a time")
    parser.add_argument("--report", type=Path, metavar="FILE", help="every mutant and its end, as JSON")
    parser.add_argument(
        "--again",
        type=Path,
        metavar="FILE",
        help="only what survived by such a report: tests were added since",
    )
    parser.add_argument(
        "--remember", action="store_true", help="keep the scores for docs/mutants.md (whole modules only)"
    )
    a = parser.parse_args()
    if a.list:
        for part in PARTS:
            print(part.title)
            for module, tests in part.modules.items():
                print(f"  {module:42}{' '.join(tests)}")
        return 0
    if a.setup or not is_set_up():
        set_up()
    if a.setup:
        return 0
    wanted = [one.removesuffix("/") for one in a.module]
    chosen = [
        one
        for one in MODULES
        if not wanted or any(one == name or one.startswith(f"{name}/") for name in wanted)
    ]
    if unknown := [
        name for name in wanted if not any(one == name or one.startswith(f"{name}/") for one in MODULES)
    ]:
        parser.error(f"there is no module {', '.join(unknown)}; --list names them")
    outcomes, tried = [], []
    for module in chosen:
        try:
            outcomes += _try(module, a)
        except CannotTry as problem:
            print(problem, file=sys.stderr)
            return 2
        tried.append(module)
        if a.report:
            a.report.write_text(json.dumps([_row(one) for one in outcomes], indent=1), encoding="utf-8")
    survivors = [one.mutant for one in outcomes if one.ended == "survived"]
    missing = unexplained(survivors, accepted())
    old = [] if a.limit else out_of_date(tried, survivors, accepted())
    for mutant in missing:
        print(
            f"\n{mutant.module}:{mutant.first} {mutant.where} ({mutant.operator})\n"
            f"- {mutant.line}\n+ {mutant.mutant}"
        )
    for one in old:
        print(
            f"\naccepted.toml: no such survivor any more: {one.module} {one.where}\n"
            f"- {one.line}\n+ {one.mutant}"
        )
    return int(bool(missing or old))


def _try(module: str, a: argparse.Namespace) -> list[Outcome]:
    """Try a module's mutants and print its row."""
    began_s = time.monotonic()
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    mutants = mutants_of(module, (ROOT / module).read_text(encoding="utf-8"))
    before: Counter[str] = Counter()
    if a.again:
        rows = [one for one in json.loads(a.again.read_text(encoding="utf-8")) if one["module"] == module]
        survived = {(one["where"], one["line"], one["mutant"]) for one in rows if one["ended"] == "survived"}
        mutants = [one for one in mutants if one.identity[1:] in survived]
        others = (one for one in rows if (one["where"], one["line"], one["mutant"]) not in survived)
        before.update(one["ended"] for one in others)
    if a.limit and len(mutants) > a.limit:
        mutants = random.Random(a.seed).sample(mutants, a.limit)
    tests = [place for place in MODULES[module] if (ROOT / place).exists()]
    outcomes = list(try_all(module, mutants, tests, a.jobs))
    ends = before + Counter(one.ended for one in outcomes)
    noticed = ends.total() - ends["survived"]
    print(
        f"{module:42}{ends.total():5} mutants {noticed / max(ends.total(), 1):7.1%} noticed"
        f"  {ends['killed']} killed, {ends['timed out']} timed out, {ends['survived']} survived"
        f"  {time.monotonic() - began_s:.0f} s",
        flush=True,
    )
    if a.remember and not a.limit:
        remember(module, ends, commit.stdout.strip())
    return outcomes


def _row(one: Outcome) -> dict[str, object]:
    """Return an outcome as data."""
    mutant = one.mutant
    return {
        "module": mutant.module,
        "line_number": mutant.first,
        "where": mutant.where,
        "line": mutant.line,
        "mutant": mutant.mutant,
        "operator": mutant.operator,
        "ended": one.ended,
        "by": one.by,
    }


if __name__ == "__main__":
    sys.exit(main())
