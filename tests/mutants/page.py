"""Make the page of mutants from scores and explanations: python -m tests.mutants.page > docs/mutants.md"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from tests.mutants.accepted import Survivor, accepted
from tests.mutants.scores import scores
from tests.mutants.targets import MODULES, PARTS

HEAD = (Path(__file__).with_name("page_head.md")).read_text(encoding="utf-8")


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
            ends = " | ".join(str(one[end]) for end in ("killed", "timed out", "survived"))
            share = f"{noticed / max(number, 1):.1%}"
            when = f"{one['day']} | `{one['commit']}`"
            yield f"| {part.title} | `{module}` | {number} | {share} | {ends} | {when} |"
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
