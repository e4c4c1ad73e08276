"""Static tests made cycle by cycle, so that one requirement or condition of one cycle can be broken alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, Temperature, make_record
from bufferstand.evaluation.requirements.limit_set import LimitSet
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import BUFFER, STARTED, STATED, Floats

Branch = Callable[[Floats], Floats]


def usual(stroke_mm: Floats) -> Floats:
    """Return a loading branch in the middle of every window."""
    return np.asarray(20.0 + 2.0 * stroke_mm + 3.8e-6 * stroke_mm**4)


def bent(branch: Branch, at_mm: float, by_kN: float, width_mm: float = 10.0) -> Branch:
    """Return a branch with a smooth bump at a stroke."""
    return lambda stroke: branch(stroke) + by_kN * np.exp(-(((stroke - at_mm) / width_mm) ** 2))


@dataclass(frozen=True)
class OneCycle:
    """One cycle that meets everything; ``residual_mm`` is what stays after it."""

    top_mm: float = 102.0
    up_mm_per_s: float = 20.0
    down_mm_per_s: float = 20.0
    dwell_s: float = 0.0
    residual_mm: float = 0.0
    pause_s: float = 3.0
    loss: float = 0.56
    temperature_C: tuple[float, float] = (20.0, 20.0)
    """At the start of the cycle and in the middle of it."""
    branch: Branch = usual


GOOD_CYCLE = OneCycle()


@dataclass(frozen=True)
class MadeTest:
    """A static test of given cycles."""

    cycles: tuple[OneCycle, ...] = (GOOD_CYCLE,) * 3
    rate_Hz: float = 50.0
    started: datetime | None = STARTED
    specimen: tuple[tuple[str, Any], ...] = tuple(BUFFER.items())

    def changed(self, *numbers: int, **changes: Any) -> MadeTest:
        """Return the test with some of its cycles (from 1) changed."""
        cycles = tuple(
            replace(cycle, **changes) if number in numbers else cycle
            for number, cycle in enumerate(self.cycles, start=1)
        )
        return replace(self, cycles=cycles)

    def record(self) -> Record:
        """Return the record, with noise of 2 µm and 20 N."""
        parts: list[tuple[Floats, Floats]] = [self._rest(0.0, 2.0, 20.0)]
        temperatures: list[tuple[float, float]] = []
        low, now = 0.0, parts[0][0].size / self.rate_Hz
        for cycle in self.cycles:
            pieces = (
                self._leg(cycle, low, cycle.top_mm, cycle.up_mm_per_s),
                self._rest(cycle.top_mm, cycle.dwell_s, float(cycle.branch(np.array([cycle.top_mm]))[0])),
                self._leg(cycle, cycle.top_mm, cycle.residual_mm, cycle.down_mm_per_s),
                self._rest(cycle.residual_mm, cycle.pause_s, 8.0),
            )
            parts += pieces
            moving_s = sum(stroke.size for stroke, _ in pieces[:3]) / self.rate_Hz
            start, middle = cycle.temperature_C
            temperatures += [(now, start), (now + 0.5 * moving_s, middle), (now + moving_s, start)]
            low, now = cycle.residual_mm, now + moving_s + pieces[3][0].size / self.rate_Hz
        stroke, force = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        random = np.random.default_rng(7)
        time = np.arange(stroke.size) / self.rate_Hz
        stroke = stroke + 0.002 * random.standard_normal(stroke.size)
        force = force + 0.02 * random.standard_normal(stroke.size)
        at = np.arange(0.0, time[-1] + 0.25, 0.25)
        warm = np.interp(at, *np.array(temperatures).T) if temperatures else np.full_like(at, 20.0)
        return make_record(
            time, stroke, force, temperatures=[Temperature("temperature_1", at, warm, accuracy_C=0.5)]
        )

    def _leg(self, cycle: OneCycle, start: float, end: float, speed: float) -> tuple[Floats, Floats]:
        samples = max(2, round(abs(end - start) / speed * self.rate_Hz))
        stroke = start + (end - start) * np.arange(1, samples + 1) / samples
        force = cycle.branch(stroke)
        if end < start:
            force = force * (1.0 - cycle.loss * (1.0 - np.exp(-(cycle.top_mm - stroke))))
        return stroke, force

    def _rest(self, stroke_mm: float, seconds: float, force_kN: float) -> tuple[Floats, Floats]:
        samples = round(seconds * self.rate_Hz)
        return np.full(samples, stroke_mm), np.full(samples, force_kN)

    def evaluate(self, limits: LimitSet | None = None, **options: Any) -> RunEvaluation:
        """Evaluate the test with few draws."""
        facts = RunFacts("static-1", "static", specimen=dict(self.specimen), started=self.started, **STATED)  # type: ignore[arg-type]
        return evaluate_run(self.record(), facts, Options(**({"draws": 300} | options)), limits)


def table(run: RunEvaluation) -> dict[tuple[str, int | None], str]:
    """Return every verdict of a run by id and cycle."""
    return {(row.id, row.cycle): row.verdict for row in run.requirements}


def measured(run: RunEvaluation, identity: str, cycle: int) -> tuple[float, float]:
    """Return value and expanded uncertainty of a row."""
    row = next(r for r in run.requirements if (r.id, r.cycle) == (identity, cycle))
    assert row.measured is not None
    assert row.expanded_uncertainty is not None
    return row.measured, row.expanded_uncertainty


def ids(run: RunEvaluation, *, condition: bool) -> Sequence[str]:
    """Return the ids of a run's rows, each once."""
    return list(dict.fromkeys(row.id for row in run.requirements if row.condition is condition))
