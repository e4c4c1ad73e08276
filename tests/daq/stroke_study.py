"""How near the strokes come to what was asked, by the stand's own truth: a table over stands and controllers.

``python -m tests.daq.stroke_study`` prints it in Markdown; ``--cycles N`` for longer steps,
``--reversal S …`` for some of the stands.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.loading.load import load_run
from tests.daq.stroke_bench import Case, reached, run

Asked = tuple[float, float, float]
"""Mean and amplitude [mm], frequency [Hz]."""

FIRST: Asked = (40.0, 15.0, 1.0)
LATER: tuple[Asked, ...] = ((40.0, 5.0, 2.5), (60.0, 10.0, 0.5), (30.0, 10.0, 2.5), (55.0, 15.0, 1.5))
STATIC = """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
stroke_limit_mm = 100.0
force_limit_kN = 500.0
cycles = 1
"""
REVERSALS_S = (0.0, 0.01, 0.03, 0.05)
HEADS = (
    "reversal_s",
    "first step",
    "can change a running sine",
    "any cycle: amplitude %",
    "mean mm",
    "last cycle: amplitude %",
    "mean mm",
    "said − truth mm",
    "said − evaluated mm",
)
EDITIONS = (3, 2)
"""Of the ring profile: 3 can change a running sine."""


def sine(mean_mm: float, amplitude_mm: float, frequency_Hz: float, cycles: int = 5, more: str = "") -> str:
    """Return a harmonic step of a campaign file."""
    return f"""
[[step]]
kind = "harmonic"
prestress_mm = {mean_mm}
amplitude_mm = {amplitude_mm}
frequency_Hz = {frequency_Hz}
cycles = {cycles}
{more}
"""


@dataclass(frozen=True)
class Made:
    """One step: what was asked, off by truth in every full cycle, and what was said of the last one.

    Parameters
    ----------
    asked : (float, float, float)
    off_percent, off_mm : NDArray, shape (cycles,)
        Amplitude, in per cent of what was asked, and mean [mm].
    said_mm, truth_mm, evaluated_mm : float
        Amplitude of the last cycle that was looked at: as reached, by truth, and by the evaluation's turns.
    """

    asked: Asked
    off_percent: np.ndarray
    off_mm: np.ndarray
    said_mm: float
    truth_mm: float
    evaluated_mm: float

    def worst(self) -> list[float]:
        """Return how far off it is: any cycle, the last one, and what was said of it."""
        percent, mm = np.abs(self.off_percent), np.abs(self.off_mm)
        said = (self.said_mm - self.truth_mm, self.said_mm - self.evaluated_mm)
        return [percent.max(), mm.max(), percent[-1], mm[-1], *(abs(one) for one in said)]


def made(folder: Path, first: str, asked: tuple[Asked, ...], case: Case, cycles: int) -> list[Made]:
    """Run a first step and sines after it; return these."""
    steps = first + "".join(sine(*one, cycles) for one in asked)
    outcome, opened, _, _ = run(folder, steps, case)
    assert outcome.status == "complete", outcome.reason
    rows = [json.loads(line) for line in (folder / "out" / "strokes.jsonl").read_text().splitlines()]
    found = []
    outcome = replace(outcome, runs=outcome.runs[-len(asked) :])
    for one, true, path, row in zip(
        asked, reached(opened, outcome), outcome.runs, rows[-len(asked) :], strict=True
    ):
        (said,) = row["motions"]
        last = said["cycles"] - 1
        # The first and the last cycle grow and fall; one that is looked at ends with its lower turn.
        every = find_cycles(load_run(path)[0])[1 : cycles + 1]
        found.append(
            Made(
                one,
                100.0 * (true.amplitude_mm / one[1] - 1.0),
                true.mean_mm - one[0],
                said["reached_amplitude_mm"],
                float(true.amplitude_mm[last]),
                0.5 * (every[last].stroke_max_mm - every[last].stroke_end_mm),
            )
        )
    return found


def table(cycles: int, reversals_s: Sequence[float]) -> None:
    """Print the table, the worst of the later steps in each line."""
    for line in (
        f"| {' | '.join(HEADS)} |",
        "|" + "---|" * len(HEADS),
    ):
        print(line)
    for reversal_s, edition, first in product(reversals_s, EDITIONS, ("static", "harmonic")):
        begin = STATIC if first == "static" else sine(*FIRST, cycles)
        with tempfile.TemporaryDirectory() as folder:
            found = made(
                Path(folder), begin, LATER, Case(edition=edition, reversal_s=reversal_s, tick_s=0.01), cycles
            )
        worst = [
            max((abs(value) for one in found for value in values(one)), default=0.0)
            for values in (
                lambda one: one.off_percent,
                lambda one: one.off_mm,
                lambda one: one.off_percent[-1:],
                lambda one: one.off_mm[-1:],
                lambda one: [one.said_mm - one.truth_mm],
                lambda one: [one.said_mm - one.evaluated_mm],
            )
        ]
        figures = " | ".join(
            f"{value:.2f}" if n in (0, 2) else f"{value:.3f}" for n, value in enumerate(worst)
        )
        line = f"| {reversal_s:g} | {first} | {'yes' if edition == 3 else 'no'} | {figures} |"
        print(line, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=5)
    parser.add_argument("--reversal", type=float, nargs="*", default=REVERSALS_S, metavar="S")
    chosen = parser.parse_args()
    table(chosen.cycles, chosen.reversal)
