"""What an evaluation costs beside a plain numpy one of the same arrays, and what its Monte Carlo costs.

    .venv/bin/python -m benchmarks.evaluation [--samples 4000000] [--per-cycle 100000 20000 1000 400]

Both are measured in one process, alternating, best of three in processor time; only their ratio means
anything. The plain one finds cycles by crossings of the mean stroke, takes extreme samples as turning points,
and integrates both branches by the trapezoidal rule: no fit, no check, no other figure, no uncertainty.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from bufferstand.foundation.run_kinds import Kind

Floats = NDArray[np.float64]
RATE_HZ = 5000.0
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


def best(task: Callable[[], object], others: Callable[[], object]) -> tuple[float, float]:
    """Return the shortest of three processor times of two tasks that take turns [s]."""
    times = []
    for _ in range(3):
        start = time.process_time()
        task()
        middle = time.process_time()
        others()
        times.append((middle - start, time.process_time() - middle))
    return min(t[0] for t in times), min(t[1] for t in times)


def measure(samples: int, per_cycle: int) -> None:
    """Measure one shape of record and print what it costs."""
    data = columns(samples, per_cycle)

    def ours(facts: RunFacts, draws: int) -> Callable[[], object]:
        return lambda: evaluate_run(make_record(*data), facts, Options(draws=draws))

    size = 3 * data[0].nbytes / 1e6
    print(f"{samples} samples of 3 channels, {size:.0f} MB, {len(plain(*data[1:]))} cycles of {per_cycle}")
    bare = RunFacts("bare", "harmonic", **NOT_STATED)
    whole, simple = best(ours(bare, 1), lambda: plain(*data[1:]))
    print(f"  plain numpy            {simple:7.3f} s")
    print(f"  evaluation             {whole:7.3f} s = {whole / simple:.2f} x plain (at most 3)")
    stated, again = best(ours(RunFacts("stated", "harmonic", **STATED), 10_000), ours(bare, 1))
    print(f"  Monte Carlo, 10 000    {stated - again:7.3f} s a run (at most 1)", flush=True)


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


def measure_draws() -> None:
    """Measure the Monte Carlo of a run that is judged, and of a short harmonic one, and print it."""
    specimen = {"category": "A", "kind": "buffer", "elastic_system": "elastomer", "max_stroke_mm": 105.0}
    cases: dict[str, tuple[tuple[Floats, Floats, Floats], Kind]] = {
        "static run, three cycles judged": (static_columns(), "static"),
        "harmonic run, 20 cycles": (columns(22_000, 1000), "harmonic"),
    }
    for name, (data, kind) in cases.items():

        def run(
            facts: RunFacts, draws: int, data: tuple[Floats, Floats, Floats] = data
        ) -> Callable[[], object]:
            return lambda: evaluate_run(make_record(*data), facts, Options(draws=draws))

        bare, stated = (RunFacts("one", kind, specimen=specimen, **facts) for facts in (NOT_STATED, STATED))
        judged = evaluate_run(make_record(*data), stated, Options(draws=100)).requirements
        drawn, simple = best(run(stated, 10_000), run(bare, 1))
        print(f"{name}, {len(judged)} requirements and conditions")
        print(f"  Monte Carlo, 10 000    {drawn - simple:7.3f} s a run (at most 1)", flush=True)


def main() -> None:
    """Measure every shape and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=4_000_000)
    parser.add_argument("--per-cycle", type=int, nargs="+", default=[100_000, 20_000, 1000, 400])
    chosen = parser.parse_args()
    for per_cycle in chosen.per_cycle:
        measure(chosen.samples, per_cycle)
    measure_draws()


if __name__ == "__main__":
    main()
