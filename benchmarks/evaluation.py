"""What an evaluation costs beside a plain numpy one of the same arrays, and what its Monte Carlo costs.

Both take turns in one process, and the least processor time of each counts. The plain one finds cycles by
crossings of the mean stroke, takes extreme samples as turning points, and integrates both branches by the
trapezoidal rule: no fit, no check, no other figure, no uncertainty. The Monte Carlo of 10 000 draws, which is
the evaluation with it less that without, is set beside normal numbers that numpy draws: a hundred million of
them take about a second.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.common import Benchmark, best, tell
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from bufferstand.foundation.run_kinds import Kind

Floats = NDArray[np.float64]
RATE_HZ = 5000.0
PER_CYCLE = {100_000: 3.0, 20_000: 3.0, 1000: 3.0, 400: 2.0}
"""Samples a cycle, and the largest ratio that is wanted."""
STATED: dict[str, Any] = {
    "force_uncertainty": ChannelUncertainty(
        accuracy_percent=0.5, reversibility_percent=0.5, zero=0.3, u_delay_s=2e-5
    ),
    "stroke_uncertainty": (ChannelUncertainty(linearity=0.25, zero=0.05, u_delay_s=2e-5),) * 2,
}
NOT_STATED: dict[str, Any] = {}


def columns(samples: int, per_cycle: int) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke and force of a harmonic run, with noise of 0.05 % of the range."""
    random = np.random.default_rng(1)
    time_s = np.arange(samples) / RATE_HZ
    angle = 2.0 * np.pi * np.arange(samples) / per_cycle + 1.0
    stroke = 50.0 - 20.0 * np.cos(angle) + 0.02 * random.standard_normal(samples)
    force = 100.0 - 80.0 * np.cos(angle) + 12.0 * np.sin(angle) + 0.08 * random.standard_normal(samples)
    return time_s, stroke, force


def plain(stroke: Floats, force: Floats) -> list[tuple[float, float, float]]:
    """Return stored and absorbed energy and damping of each cycle, as one writes it in an afternoon."""
    low, high = np.quantile(stroke[:: max(1, stroke.size // 10_000)], [0.01, 0.99])
    side = np.where(stroke > 0.75 * high + 0.25 * low, 1, np.where(stroke < 0.75 * low + 0.25 * high, -1, 0))
    known = np.flatnonzero(side)
    turns = known[np.flatnonzero(np.diff(side[known]) > 0)]
    lows = [a + int(np.argmin(stroke[a:b])) for a, b in pairwise(turns)]
    results = []
    for a, b in pairwise(lows):
        top = a + int(np.argmax(stroke[a : b + 1]))
        stored = float(np.trapezoid(force[a : top + 1], stroke[a : top + 1]))
        absorbed = float(np.trapezoid(force[a : b + 1], stroke[a : b + 1]))
        results.append((stored, absorbed, absorbed / stored))
    return results


def task(data: tuple[Floats, Floats, Floats], facts: RunFacts, draws: int) -> Callable[[], object]:
    """Return the evaluation of a record."""
    return lambda: evaluate_run(make_record(*data), facts, Options(draws=draws))


def beside_plain(samples: int, per_cycle: int, rounds: int) -> float:
    """Measure an evaluation beside a plain one; return the ratio."""
    data = columns(samples, per_cycle)
    cycles = len(plain(*data[1:]))
    ours = task(data, RunFacts("bare", "harmonic", **NOT_STATED), 1)
    whole, simple = best([ours, lambda: plain(*data[1:])], rounds)
    tell(f"{cycles} cycles of {per_cycle} samples: plain numpy {simple:.3f} s, evaluation {whole:.3f} s")
    return whole / simple


def static_columns() -> tuple[Floats, Floats, Floats]:
    """Return a static run of three cycles to 105 mm that the requirements are judged on."""
    random = np.random.default_rng(2)
    knots_s = np.cumsum([0.0, 1.0, *[20.0, 20.0, 2.0] * 3])
    time_s = np.arange(0.0, knots_s[-1], 1e-3)
    stroke = np.interp(time_s, knots_s, [0.0, 0.0, *[100.0, 0.0, 0.0] * 3])
    rising = np.interp(time_s, knots_s, [1.0, 1.0, *[1.0, 0.5, 1.0] * 3])
    force = (10.0 + 3.0 * stroke + 0.03 * stroke**2) * rising * np.clip(stroke, 0.0, 1.0)
    return (
        time_s,
        stroke + 0.02 * random.standard_normal(time_s.size),
        force + 0.15 * random.standard_normal(time_s.size),
    )


def monte_carlo(
    data: tuple[Floats, Floats, Floats], kind: Kind, draws: int, rounds: int, specimen: dict[str, Any]
) -> float:
    """Measure the draws of a run beside ten thousand times as many plain ones; return the ratio."""
    bare, stated = (RunFacts("one", kind, specimen=specimen, **facts) for facts in (NOT_STATED, STATED))
    random = np.random.default_rng(3)

    def plain_draws() -> None:
        for _ in range(draws):
            random.standard_normal(10_000)

    drawn, simple, normal = best([task(data, stated, draws), task(data, bare, 1), plain_draws], rounds)
    tell(f"{kind}: {draws} draws {drawn - simple:.3f} s a run, {draws}0000 normal numbers {normal:.3f} s")
    return (drawn - simple) / normal


def measure(folder: Path, *, samples: int, draws: int, rounds: int) -> Sequence[float]:  # noqa: ARG001 - the form's
    """Measure records of every shape, then the draws of a harmonic run and of a static one that is judged."""
    specimen = {"category": "A", "kind": "buffer", "elastic_system": "elastomer", "max_stroke_mm": 105.0}
    return [
        *(beside_plain(samples, per_cycle, rounds) for per_cycle in PER_CYCLE),
        monte_carlo(columns(samples, 400), "harmonic", draws, rounds, {}),
        monte_carlo(columns(22_000, 1000), "harmonic", draws, rounds, specimen),
        monte_carlo(static_columns(), "static", draws, rounds, specimen),
    ]


BENCHMARK = Benchmark(
    {f"evaluation / plain numpy, {size} samples a cycle, processor": most for size, most in PER_CYCLE.items()}
    | {
        f"draws, {run} / 10 000 normal numbers a draw, processor": 1.0
        for run in ("long harmonic run", "short harmonic run", "static run")
    },
    full=partial(measure, samples=4_000_000, draws=10_000, rounds=3),
    smoke=partial(measure, samples=400_000, draws=100, rounds=1),
)
