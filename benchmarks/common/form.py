"""The form of a benchmark, and the catalogue: every file in ``benchmarks`` is one."""

from __future__ import annotations

import pkgutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1]


class NotHere(Exception):  # noqa: N818 - it names the fact
    """This machine lacks what a benchmark compares with; the message says what."""


@dataclass(frozen=True)
class Benchmark:
    """What is compared, and how much of it.

    Parameters
    ----------
    goals : mapping of str to float
        The largest ratio that is wanted, by what is compared: ``"ours / reference, which time"``. Both sides
        are measured in the same run.
    full : partial
        Measures with full sizes. It is called with an empty folder, and returns the ratios in the order of
        the goals.
    smoke : partial
        The same with sizes so small that it ends in seconds. Its ratios say nothing but that it works.
    """

    goals: Mapping[str, float]
    full: partial[Sequence[float]]
    smoke: partial[Sequence[float]]

    def ratios(self, *, smoke: bool) -> dict[str, float]:
        """Measure; return the ratios by what is compared.

        Raises
        ------
        NotHere
            Where this machine lacks the reference.
        """
        with tempfile.TemporaryDirectory(prefix="bufferstand-", ignore_cleanup_errors=True) as folder:
            found = (self.smoke if smoke else self.full)(Path(folder))
        return dict(zip(self.goals, found, strict=True))


def names(folder: Path = FOLDER) -> list[str]:
    """Return the names of all benchmarks: of the files in the folder."""
    found = pkgutil.iter_modules([str(folder)])
    return sorted(one.name for one in found if not one.ispkg and one.name != "__main__")


def load(name: str) -> Benchmark:
    """Return a benchmark.

    Raises
    ------
    TypeError
        If its file does not state one.
    """
    found = getattr(import_module(f"benchmarks.{name}"), "BENCHMARK", None)
    if not isinstance(found, Benchmark):
        raise TypeError(
            f"benchmarks/{name}.py states no BENCHMARK (goals, full, smoke); what benchmarks share belongs "
            "in benchmarks/common"
        )
    return found


def tell(said: str) -> None:
    """Tell a figure behind a ratio on standard error, so that standard output has the table alone."""
    print(said, file=sys.stderr, flush=True)
