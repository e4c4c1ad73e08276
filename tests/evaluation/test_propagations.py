"""Cycles prepared for drawing: cut together, and each as if it was the only one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.evaluation.loops.cut import LoopStack, cut_loop, cut_loops
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.uncertainty import cycle_propagations as propagations
from bufferstand.evaluation.uncertainty.cycle_propagations import Propagations


def _noisy(cycles: int = 30) -> Record:
    """Return a harmonic record at 1 kHz, whose loops differ by their noise alone."""
    random = np.random.default_rng(11)
    time_s = np.arange(200 * cycles + 150) / 1000.0
    angle = 2.0 * np.pi * time_s / 0.2 + 0.7
    stroke = 40.0 - 15.0 * np.cos(angle) + 0.02 * random.standard_normal(angle.size)
    force = 90.0 - 70.0 * np.cos(angle) + 15.0 * np.sin(angle) + 0.3 * random.standard_normal(angle.size)
    return make_record(time_s, stroke, force)


def test_loops_that_are_cut_alone_are_those_of_each_cycle() -> None:
    record = _noisy()
    cycles = [cycle for cycle in find_cycles(record) if cycle.complete]
    assert len(cycles) > 25  # more than are asked for windows where cycles share them
    for stack in cut_loops(record, cycles, alone=True):
        for row, cycle in enumerate(stack.cycles):
            found, expected = stack.loop(row), cut_loop(record, cycle)
            np.testing.assert_allclose(found.force_kN, expected.force_kN, rtol=1e-9)
            np.testing.assert_allclose(found.stroke_mm, expected.stroke_mm, rtol=1e-12)
            for one, other in zip(found.ends, expected.ends, strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9)


def test_cycles_that_are_prepared_together_are_cut_once(monkeypatch: pytest.MonkeyPatch) -> None:
    record = _noisy(6)
    cut: list[int] = []

    def counted(record: Record, cycles: Sequence[Cycle], *own: Any, **named: Any) -> Iterator[LoopStack]:
        cut.append(len(cycles))
        return cut_loops(record, cycles, *own, **named)

    monkeypatch.setattr(propagations, "cut_loops", counted)
    prepared = Propagations(record, find_cycles(record))
    prepared.prepare(prepared)
    assert len(prepared) >= 5
    assert [prepared[index].cycle.index for index in prepared] == list(prepared)
    assert cut == [len(prepared)]
