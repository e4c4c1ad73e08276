"""The figures of a report, drawn on two cores where there are many."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Protocol

from bufferstand.evaluation.archive import handed_out, spawned_workers
from bufferstand.evaluation.figures import Plot, draw
from bufferstand.evaluation.wording import Language
from bufferstand.foundation.operating_system import usable_cores

_FEW = 8
"""So many figures are drawn here before another process could begin."""


class Drawn(Protocol):
    """What finishes the figures of a report."""

    def __call__(self) -> list[str]:
        """Return the figures as SVG, in their order."""


@contextmanager
def drawing(plots: Sequence[Plot], language: Language, jobs: int | None) -> Iterator[Drawn]:
    """Begin to draw figures in another process, and give what finishes them here.

    Parameters
    ----------
    plots : sequence of Plot
    language : Language
        Of their texts and numbers.
    jobs : int or None
        1: all are drawn here. None or more: the other process is spawned where it is worth it.

    Yields
    ------
    callable
        Draws the second half here and returns all figures: the same bytes, whoever drew them.
    """
    if jobs == 1 or len(plots) <= _FEW or usable_cores() == 1:
        yield lambda: [draw(plot, language) for plot in plots]
        return
    there = len(plots) // 2
    with spawned_workers(1) as pool:
        begun = [_begun(pool, plot, language) for plot in plots[:there]]

        def drawn() -> list[str]:
            here = [draw(plot, language) for plot in plots[there:]]
            first = zip(begun, plots, strict=False)
            return [*(_from_there(future, plot, language) for future, plot in first), *here]

        yield drawn


def _begun(pool: ProcessPoolExecutor, plot: Plot, language: Language) -> Future[str]:
    """Hand out a figure; the future of one that no process is left for has failed."""
    try:
        return handed_out(pool, draw, plot, language)
    except BrokenProcessPool as error:
        failed: Future[str] = Future()
        failed.set_exception(error)
        return failed


def _from_there(future: Future[str], plot: Plot, language: Language) -> str:
    """Return a figure that the other process draws; if that has died, draw it here."""
    try:
        return future.result()
    except BrokenProcessPool:
        return draw(plot, language)
