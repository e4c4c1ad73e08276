"""No cycle lost, none invented: shapes × samples a cycle × start phase × noise, against the known motion.

A cycle is complete when the motion leaves one lower turn and arrives at the next one on record. Where the
record begins or ends within 2.5 % of a period beyond a lower turn (0.6 % of a sine's stroke is missing then),
the one-sided fit may count that cycle or not; everywhere else the number is exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from evaluation.cycles import find_cycles
from evaluation.motion import Cycle
from evaluation.record import make_record
from tests.evaluation.signals import Floats

MEAN_MM, HALF_MM, NOISE_MM = 50.0, 20.0, 0.02
GREY = 0.025
PHASES = (*(k / 16.0 for k in range(16)), 0.005, 0.02, 0.98, 0.995)
SHORT, LONG = (20, 50, 100, 200, 1000), (10_000, 100_000)
STEP_MM = 500.0 / 65536.0


def sine(p: Floats) -> Floats:
    return np.asarray(-np.cos(2.0 * np.pi * p))


def triangle(p: Floats) -> Floats:
    return 1.0 - 4.0 * np.abs(np.mod(p, 1.0) - 0.5)


def trapezoid(p: Floats) -> Floats:
    """Lower dwell for 0.2 periods about 0, upper one about 0.5."""
    return np.asarray(
        np.interp(np.mod(p + 0.1, 1.0), [0.0, 0.2, 0.5, 0.7, 1.0], [-1.0, -1.0, 1.0, 1.0, -1.0])
    )


def distorted(p: Floats) -> Floats:
    """A tenth of second and of third harmonic."""
    return np.asarray(
        -np.cos(2.0 * np.pi * p) + 0.1 * np.cos(4.0 * np.pi * p) + 0.1 * np.sin(6.0 * np.pi * p)
    )


def paused(p: Floats) -> Floats:
    """A sine that rests for 0.4 periods about each lower turn."""
    return np.asarray(-np.cos(2.0 * np.pi * np.clip((np.mod(p, 1.0) - 0.2) / 0.6, 0.0, 1.0)))


@dataclass(frozen=True)
class Shape:
    """``leaves``, ``arrives``: when the motion leaves and reaches its lower turn, in periods from it."""

    name: str
    leaves: float
    arrives: float

    def motion(self, p: Floats) -> Floats:
        functions = (sine, triangle, trapezoid, distorted, paused)
        return next(f for f in functions if f.__name__ == self.name)(p)

    def complete(self, first: float, last: float) -> range:
        """Return the numbers of complete cycles that are right for a record from ``first`` to ``last``."""
        begins, ends = first - self.leaves, last - self.arrives
        inside = [m for m in range(-2, 30) if begins <= m + 1e-9 and m + 1 <= ends + 1e-9]
        near = 2.0 * GREY if self.name == "distorted" else GREY  # its lower turn is flatter on one side
        grey = [m for m in range(-2, 30) if begins - near <= m and m + 1 <= ends + near]
        least = [m for m in range(-2, 30) if begins + 1e-9 <= m and m + 1 <= ends - 1e-9]
        return range(min(len(inside), len(least)), len(grey) + 1)


LOWEST = float(np.linspace(-0.5, 0.5, 100_001)[np.argmin(distorted(np.linspace(-0.5, 0.5, 100_001)))])
SHAPES = (
    Shape("sine", 0.0, 0.0),
    Shape("triangle", 0.0, 0.0),
    Shape("trapezoid", 0.1, -0.1),
    Shape("distorted", LOWEST, LOWEST),
    Shape("paused", 0.2, -0.2),
)
CHANGES = ("plain", "drift", "draw-wire", "coarse")


def stroke_of(shape: Shape, p: Floats, change: str, noise: bool) -> Floats:
    half = HALF_MM + (0.05 * p if change == "drift" else 0.0)
    stroke = MEAN_MM + half * shape.motion(p) + (0.1 * p if change == "drift" else 0.0)
    if noise:
        stroke = stroke + NOISE_MM * np.random.default_rng(7).standard_normal(p.size)
    step = {"draw-wire": STEP_MM, "coarse": 0.1}.get(change)
    return stroke if step is None else np.round(stroke / step) * step


def cycles_of(p: Floats, stroke: Floats) -> tuple[Cycle, ...]:
    return find_cycles(make_record(0.4 * p, stroke, stroke))


def failures(shape: Shape, samples: int, change: str, noise: bool, phases: tuple[float, ...]) -> list[str]:
    """Return a line for every record of which the cycles are not those of the motion."""
    found = []
    for phase in phases:
        p = phase + np.arange(round((3.3 if samples > 5000 else 6.3) * samples) + 1) / samples
        cycles = cycles_of(p, stroke_of(shape, p, change, noise))
        complete = [c for c in cycles if c.complete]
        wrong = len(complete) not in shape.complete(float(p[0]), float(p[-1]))
        unsaid = any(not c.why for c in cycles if not (c.complete and c.steady))
        # A cycle at an end of the record is only as sure as the one side of its turn that is there.
        inner = [c for c in complete if c.start.method != "edge" and c.end.method != "edge"]
        if samples > 20:
            inner = [c for c in inner if c.start_s > 0.4 * p[0] + 0.1 and c.end_s < 0.4 * p[-1] - 0.1]
        unsteady = [c.why for c in inner if not c.steady]
        if wrong or unsaid or (unsteady and samples > 20):
            found.append(f"{phase:.3f}: {len(complete)} complete, not steady: {unsteady}")
    return found


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.name)
@pytest.mark.parametrize("samples", [20, 100, 1000])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
def test_cycles_are_those_of_the_motion(shape: Shape, samples: int, noise: bool) -> None:
    for change in CHANGES:
        assert failures(shape, samples, change, noise, PHASES[::3]) == []


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.name)
@pytest.mark.parametrize("samples", [*SHORT, *LONG])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
@pytest.mark.parametrize("change", CHANGES)
def test_whole_matrix(shape: Shape, samples: int, noise: bool, change: str) -> None:
    assert failures(shape, samples, change, noise, PHASES) == []


@pytest.mark.parametrize("samples", [20, 100, 1000])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
def test_gap_is_never_integrated_across(samples: int, noise: bool) -> None:
    for phase in PHASES[::2]:
        whole = phase + np.arange(6 * samples) / samples
        missing = slice(int(2.4 * samples), int(2.4 * samples) + max(2, samples // 10))
        kept = np.delete(np.arange(whole.size), missing)
        gap = (whole[missing.start - 1], whole[missing.stop])
        stroke = stroke_of(SHAPES[0], whole, "plain", noise)
        cycles = cycles_of(whole[kept], stroke[kept])
        across = [c for c in cycles if c.start_s / 0.4 < gap[1] and c.end_s / 0.4 > gap[0]]
        assert not any(c.complete for c in across)
        assert all(c.why for c in across)
        before, after = (
            Shape("sine", 0, 0).complete(whole[0], gap[0]),
            Shape("sine", 0, 0).complete(gap[1], whole[-1]),
        )
        assert before.start + after.start <= sum(c.complete for c in cycles) < before.stop + after.stop


@pytest.mark.parametrize("samples", [20, 50, 200, 1000])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
def test_ramped_amplitude(samples: int, noise: bool) -> None:
    """Amplitude in over two periods and out over two: all are cycles, those of full amplitude are steady."""
    for phase in (0.2, 0.35, 0.5, 0.65):
        p = phase + np.arange(10 * samples) / samples
        envelope = np.interp(p, [phase, phase + 2.0, phase + 8.0, phase + 10.0], [0.2, 1.0, 1.0, 0.2])
        stroke = MEAN_MM + HALF_MM * envelope * sine(p)
        if noise:
            stroke = stroke + NOISE_MM * np.random.default_rng(3).standard_normal(p.size)
        cycles = cycles_of(p, stroke)
        assert sum(c.complete for c in cycles) == 9
        full = [c for c in cycles if c.start_s / 0.4 > phase + 2.0 and c.end_s / 0.4 < phase + 8.0]
        assert all(c.steady for c in full)
        assert len(full) == 5
        ramped = [c for c in cycles if c.end_s / 0.4 < phase + 1.9 or c.start_s / 0.4 > phase + 8.1]
        assert not any(c.steady for c in ramped)
