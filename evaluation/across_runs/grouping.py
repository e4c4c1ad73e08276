"""Groups of runs that belong together, for trends and comparisons."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bufferstand.evaluation.facts import RunEvaluation


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


def specimen_of(run: RunEvaluation) -> tuple[str, bool]:
    """Return what a run must have in common with another to be compared with it, apart from the step.

    Returns
    -------
    tuple of str and bool
        The specimen's id (empty: not known), and whether the run is a simulated one: what a model does in
        place of a specimen is another thing than the specimen, though it has its id.
    """
    return str(run.facts.specimen.get("id") or ""), run.facts.simulated is True


def mixture(runs: Sequence[RunEvaluation]) -> tuple[str, ...]:
    """Return a warning where some runs are simulated and others are not."""
    simulated = sum(run.facts.simulated is True for run in runs)
    if simulated in (0, len(runs)):
        return ()
    text = (
        f"{simulated} of {len(runs)} runs were made on a simulated stand, the others not: "
        "they are in no trend or comparison together"
    )
    return (text,)
