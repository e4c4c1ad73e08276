"""Records for detectors: ellipses and static tests with noise, made wrong in one thing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bufferstand.evaluation.plausibility.detectors as room
from bufferstand.evaluation.facts.finding import Finding
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import STATED, Ellipse, StaticTest

Floats = NDArray[np.float64]
Change = Callable[[Floats, Floats, Floats], tuple[Floats, Floats, Floats]]
STRETCH = "stands for what detectors find"


def static(change: Change | None = None, *, noisy: bool = True, **test: Any) -> RunEvaluation:
    """Return a static test whose columns (time, stroke, force) are changed."""
    made = StaticTest(**test) if noisy else StaticTest(noise_mm=0.0, noise_kN=0.0, **test)
    record = made.record()
    columns = record.time_s, record.stroke_mm.copy(), record.force_kN.copy()
    time_s, stroke, force = columns if change is None else change(*columns)
    changed = make_record(time_s, stroke, force, temperatures=record.temperatures)
    return evaluate_run(changed, made.facts(), Options(draws=200))


def harmonic(
    change: Change | None = None,
    *,
    cycles: float = 6.2,
    rate_Hz: float = 500.0,
    noise: float = 5e-4,
    **ellipse: Any,
) -> RunEvaluation:
    """Return a harmonic run of 1 Hz whose columns (time, stroke, force) are changed."""
    columns = Ellipse(**ellipse).columns(1.0, rate_Hz, cycles, noise=noise)
    time_s, stroke, force = columns if change is None else change(*columns)
    facts = replace(RunFacts("h1", "harmonic"), **STATED)
    return evaluate_run(make_record(time_s, stroke, force), facts, Options(draws=200))


def of_kind(run: RunEvaluation, kind: str) -> list[Finding]:
    """Return the findings of one kind."""
    return [finding for finding in run.findings if finding.kind == kind]


def found(
    monkeypatch: pytest.MonkeyPatch,
    channel: str,
    cycles: tuple[int, ...],
    effect: room.Effect = "spoils",
    **changes: Any,
) -> None:
    """Let one finding stand for all that detectors find."""
    finding = Finding("spike", channel, 0.0, 0.0, cycles, 1.0, "kN", STRETCH, effect)
    monkeypatch.setattr(room, "DETECTORS", (lambda _: [replace(finding, **changes)],))
