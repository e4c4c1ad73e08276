"""Groups of runs that belong together, for trends and comparisons."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from evaluation.results import RunEvaluation


def grouped(
    runs: Sequence[RunEvaluation], same: Callable[[RunEvaluation, RunEvaluation], bool]
) -> list[list[RunEvaluation]]:
    """Return groups of runs; a run joins the first group whose first run it agrees with."""
    groups: list[list[RunEvaluation]] = []
    for run in runs:
        group = next((g for g in groups if same(g[0], run)), None)
        if group is None:
            groups.append([run])
        else:
            group.append(run)
    return groups
