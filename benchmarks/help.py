"""What ``bufferstand --help`` costs beside a bare Python.

Both are started in turn, and the least wall time of each counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from benchmarks.common import Benchmark, cost, tell

COMMANDS = ("", "evaluate ", "run ", "report ")


def measure(folder: Path, *, rounds: int) -> Sequence[float]:  # noqa: ARG001 - the form's
    """Measure each command's help."""
    ratios = []
    for command in COMMANDS:
        words = ("-m", "bufferstand", *command.split(), "--help")
        pairs = [(cost(*words).wall_s, cost("-c", "pass").wall_s) for _ in range(rounds)]
        ours, bare = (min(pair[i] for pair in pairs) for i in (0, 1))
        tell(f"bufferstand {command}--help: {ours:.3f} s; python -c pass: {bare:.3f} s")
        ratios.append(ours / bare)
    return ratios


BENCHMARK = Benchmark(
    {f"bufferstand {command}--help / python -c pass, wall": 8.0 for command in COMMANDS},
    full=partial(measure, rounds=15),
    smoke=partial(measure, rounds=1),
)
