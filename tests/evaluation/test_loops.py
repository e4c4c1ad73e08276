"""Loops of sparse records: a turning point next to a sample must not bend the loop."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.loops.cut import cut_loop
from bufferstand.evaluation.quantities.loop_readings import absorbed_energy_J, stored_energy_J
from bufferstand.evaluation.record.record import make_record


@pytest.mark.parametrize("samples", [40, 60, 101, 150, 199])
@pytest.mark.parametrize("phase", [0.0, 0.02, 0.3, 0.5, 0.98])
def test_energies_of_sparse_triangles(samples: int, phase: float) -> None:
    """Whatever the phase of sampling: 20 kJ stored and half of it absorbed, with noise on both channels."""
    time = np.arange(4 * 2 * samples) + phase
    along = time / samples
    stroke = 100.0 * np.abs(along - 2.0 * np.round(0.5 * along))
    rising = np.floor(along) % 2 == 0
    force = np.where(rising, 4.0, 2.0) * stroke
    random = np.random.default_rng(samples)
    record = make_record(
        time,
        stroke + 0.01 * random.standard_normal(time.size),
        force + 0.05 * random.standard_normal(time.size),
    )
    cycles = [cycle for cycle in find_cycles(record) if cycle.complete]
    assert len(cycles) >= 2
    for cycle in cycles[:-1]:
        loop = cut_loop(record, cycle)
        assert stored_energy_J(loop) == pytest.approx(20000.0, rel=0.02)
        assert absorbed_energy_J(loop) == pytest.approx(10000.0, rel=0.03)
        assert np.max(loop.force_kN) < 420.0  # the force jumps at the turn: a spline swings by a few per cent
        # At the turn itself the force jumps: two points at one moment and one stroke.
        after = np.diff(loop.time_s)
        assert np.min(after) >= 0.0
        assert np.flatnonzero(after == 0.0).tolist() == [loop.top]
        assert loop.stroke_mm[loop.unload] == loop.stroke_mm[loop.top]
        assert loop.force_kN[loop.top] == pytest.approx(400.0, rel=0.01)
        assert loop.force_kN[loop.unload] == pytest.approx(200.0, rel=0.01)
