"""What many worlds came to, as a table: how fast, what struck in which phase, what was broken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from tests.worlds.apart import Result
from tests.worlds.troubles import PHASES
from tests.worlds.world import draw

AGAIN = "python -m tests.worlds --first {seed} --seeds 1"


def table(results: Sequence[Result]) -> str:
    """Return the table of many results, as Markdown."""
    return "\n".join([*_figures(results), "", *_coverage(results), "", *_failures(results)]) + "\n"


def line(result: Result) -> str:
    """Return one line of one result."""
    if not result.broken:
        return ""
    world = draw(result.seed).words()
    said = "\n".join(f"  BROKEN {text}" for text in result.broken)
    ends = "\n".join(f"  start {number} came to: {text}" for number, text in enumerate(result.starts, 1))
    return f"{world}\n{ends}\n{said}\n  again: {AGAIN.format(seed=result.seed)}"


def _figures(results: Sequence[Result]) -> list[str]:
    spent_s = sum(one.spent_s for one in results)
    struck = sum(len(one.struck) for one in results)
    rows = {
        "seeds": f"{len(results)} ({results[0].seed} to {results[-1].seed})" if results else "0",
        "of them with a broken law": str(sum(bool(one.broken) for one in results)),
        "seeds an hour and core": f"{3600.0 * len(results) / spent_s:.0f}" if spent_s else "–",
        "stand time": f"{sum(one.stand_s for one in results) / 3600.0:.2f} h",
        "starts": str(sum(len(one.starts) for one in results)),
        "ends of starts": ", ".join(f"{count} × {end}" for end, count in _ends(results).most_common()),
        "runs, acknowledged samples": f"{sum(one.runs for one in results)}, "
        f"{sum(one.acknowledged for one in results)}",
        "troubles drawn, struck": f"{sum(one.drawn for one in results)}, {struck}: "
        f"{struck / max(len(results), 1):.2f} a seed",
        "figures judged, beyond U": f"{sum(one.judged_cycles for one in results)}, "
        f"{sum(one.beyond_U for one in results)}",
        "reports": str(sum(one.reports for one in results)),
    }
    return ["| | |", "|---|---|", *(f"| {name} | {text} |" for name, text in rows.items())]


def _ends(results: Sequence[Result]) -> Counter[str]:
    ends: Counter[str] = Counter()
    for result in results:
        for text in result.starts:
            ends["killed" if text.startswith("killed") else f"status {text.partition(':')[0]}"] += 1
    return ends


def _coverage(results: Sequence[Result]) -> list[str]:
    """Return how often each trouble struck in each phase; steps of kills have no phase of their own."""
    struck = Counter(pair for result in results for pair in result.struck)
    names = sorted({name for name, _ in struck})
    rows = [
        f"| {name} | "
        + " | ".join(str(struck[name, phase] or "") for phase in PHASES)
        + f" | {sum(count for (one, _), count in struck.items() if one == name)} |"
        for name in names
    ]
    return [
        f"| struck | {' | '.join(PHASES)} | all |",
        "|---|" + "---|" * (len(PHASES) + 1),
        *rows,
    ]


def _failures(results: Sequence[Result]) -> list[str]:
    wrong = [one for one in results if one.broken]
    if not wrong:
        return ["No law was broken."]
    return ["Broken:", "", *(f"```\n{line(one)}\n```" for one in wrong)]
