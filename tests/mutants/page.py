"""Make the page of mutants from the scores and the explained survivors: python -m tests.mutants.page > docs/mutants.md"""

from __future__ import annotations

from collections.abc import Iterator

from tests.mutants.accepted import Survivor, accepted
from tests.mutants.scores import scores
from tests.mutants.targets import MODULES, PARTS

HEAD = """\
# Mutants

A *mutant* is the code with one small change: `<` becomes `<=`, a number one more, a condition its opposite, a call is left out. Tests that still pass have not noticed it. `tests/mutants` makes every mutant of the modules below and runs their tests on it.

```
python -m tests.mutants --list                            # the modules, and the tests that must notice
python -m tests.mutants daq/motions/safe_stop.py          # one module; a folder takes all in it; without a name all
python -m tests.mutants daq/guards --limit 20 --seed 4    # 20 drawn mutants of each
python -m tests.mutants MODULE --jobs 4 --report FILE.json
python -m tests.mutants MODULE --remember                 # … and keep its score for this page
python -m tests.mutants.page > docs/mutants.md
```

Exit status 1: a mutant survived that `tests/mutants/accepted.toml` does not explain, or an entry there has no survivor any more. The slow lane of the tests tries a few mutants of a small module; `python3 start.py test --long tests/mutants` tries all.

- **What is changed** comes from the operators of [cosmic-ray](https://cosmic-ray.readthedocs.io) (MIT licence), in an environment of its own (`.mutants`, made by the first run or `--setup`, pinned by hash). Each comparison becomes its neighbour and its opposite, each operation one other. One operator is ours: a call that stands alone is left out.
- **Left out**: what says the same in other words; annotations of functions; `frozen` and `slots` of dataclasses; protocols. Texts are not changed.
- **How**: the tests are collected once, and each is watched for the lines it runs. For each mutant a forked process gets the changed functions, and runs the tests that run the changed statement, quickest first, until one fails (of the fast lane, at most 8 s together). What is run at import is imported anew.
- **Limits**: four times the processor time that the tests took, and 8 s. What takes longer has *timed out* and counts as noticed.
- Other processes that a test starts do not see the mutant. A survivor of these tests may be noticed by slower ones.
"""


def table() -> Iterator[str]:
    """Yield the rows of the scores."""
    yield "| part | module | mutants | noticed | killed | timed out | survived | day | commit |"
    yield "|---|---|---|---|---|---|---|---|---|"
    known, total = scores(), [0, 0]
    for part in PARTS:
        for module in part.modules:
            one = known.get(module)
            if one is None:
                continue
            noticed = one["killed"] + one["timed out"]
            number = noticed + one["survived"]
            total[0] += noticed
            total[1] += number
            yield (
                f"| {part.title} | `{module}` | {number} | {noticed / max(number, 1):.1%} | {one['killed']} | "
                f"{one['timed out']} | {one['survived']} | {one['day']} | `{one['commit']}` |"
            )
    if total[1]:
        yield f"| **all** | | {total[1]} | **{total[0] / total[1]:.1%}** | | | {total[1] - total[0]} | | |"


def explained(module: str, entries: list[Survivor]) -> Iterator[str]:
    """Yield the survivors of a module, each with its reason."""
    yield f"### {module}"
    yield ""
    for one in entries:
        change = "left out" if not one.mutant else f"`` {one.mutant} ``"
        yield f"- {one.where or 'the module'}: `` {one.line} `` → {change}. {one.why}"
    yield ""


def page() -> str:
    """Return the page."""
    entries = accepted()
    lines = [HEAD, "## Scores", "", *table(), ""]
    if open_ones := [module for module in MODULES if module not in scores()]:
        lines += ["Not yet tried in full: " + ", ".join(f"`{one}`" for one in open_ones) + ".", ""]
    lines += ["## Survivors, each explained", ""]
    for module in MODULES:
        own = [one for one in entries if one.module == module]
        if own:
            lines += explained(module, own)
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    print(page(), end="")
