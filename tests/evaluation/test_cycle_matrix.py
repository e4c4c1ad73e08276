"""No cycle lost, none invented: shapes × samples a cycle × start phase × noise, against the known motion.

A cycle is complete when the motion leaves one lower turn and arrives at the next one on record. Where the
record begins after a lower turn or ends before one, the stroke that is missing there decides: a smooth turn
that lacks no more than 0.2 % of the range must count, one that lacks 0.5 % must not; a sharp one, of which
nothing but its end is known, 1.5 % and 2.5 %. Between them either is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Floats

MEAN_MM, HALF_MM, NOISE_MM = 50.0, 20.0, 0.02
PHASES = (*(k / 16.0 for k in range(16)), 0.005, 0.02, 0.98, 0.995)
SHORT, LONG = (20, 50, 100, 200, 1000), (10_000, 100_000)
STEPS_MM = {"draw-wire": 500.0 / 65536.0, "coarse": 0.1}


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
    """``leaves``, ``arrives``: when the motion leaves and reaches its lower turn, in periods from it.

    ``may_lack``: share of the range that may be missing at an end of the record: must count, may count.
    """

    name: str
    leaves: float
    arrives: float
    may_lack: tuple[float, float] = (0.002, 0.005)

    def motion(self, p: Floats) -> Floats:
        functions = (sine, triangle, trapezoid, distorted, paused)
        return next(f for f in functions if f.__name__ == self.name)(p)

    def lacks(self, at: float, turn: float, way: int) -> float:
        """Return the share of the range that is missing at a record's end ``at`` beyond a lower turn."""
        beyond = way * (at - turn)
        if beyond <= 1e-9:
            return 0.0
        if beyond > 0.25:
            return 1.0
        return 0.5 * float(np.diff(self.motion(np.array([turn, at])))[0])

    def complete(self, first: float, last: float, samples: int, blur: float) -> range:
        """Return the numbers of complete cycles that are right for a record from ``first`` to ``last``.

        ``blur``: share of the range that noise and converter steps hide. Of 20 samples a cycle, a turn nearer
        to an end of the record than a sample may count or not.
        """
        least = most = 0
        margin = 1.0 / samples if samples <= 20 else 0.0
        for m in range(-2, 30):
            begin, end = m + self.leaves, m + 1 + self.arrives
            inside = first <= begin - margin + 1e-9 and end + margin <= last + 1e-9
            lacking = max(self.lacks(first, begin, 1), self.lacks(last, end, -1))
            least += inside if margin else lacking <= max(0.0, self.may_lack[0] - blur)
            outer = max(self.lacks(first, begin + margin, 1), self.lacks(last, end - margin, -1))
            most += outer <= self.may_lack[1] + blur
        return range(least, most + 1)


LOWEST = float(np.linspace(-0.5, 0.5, 100_001)[np.argmin(distorted(np.linspace(-0.5, 0.5, 100_001)))])
SHAPES = (
    Shape("sine", 0.0, 0.0),
    Shape("triangle", 0.0, 0.0, (0.015, 0.025)),
    Shape("trapezoid", 0.1, -0.1, (0.015, 0.025)),
    Shape("distorted", LOWEST, LOWEST, (0.002, 0.025)),  # straight beyond its turn: no bend says where it is
    Shape("paused", 0.2, -0.2),
)
ILL_SEEN = {20: ("triangle", "trapezoid", "paused"), 50: ("paused",)}
"""Samples a cycle at which corners are known too little to call every cycle of these steady."""
CHANGES = ("plain", "drift", "draw-wire", "coarse")


def stroke_of(shape: Shape, p: Floats, change: str, noise: bool) -> Floats:
    half = HALF_MM + (0.05 * p if change == "drift" else 0.0)
    stroke = MEAN_MM + half * shape.motion(p) + (0.1 * p if change == "drift" else 0.0)
    if noise:
        stroke = stroke + NOISE_MM * np.random.default_rng(7).standard_normal(p.size)
    step = STEPS_MM.get(change)
    return stroke if step is None else np.round(stroke / step) * step


def cycles_of(p: Floats, stroke: Floats) -> tuple[Cycle, ...]:
    return find_cycles(make_record(0.4 * p, stroke, stroke))


def failures(shape: Shape, samples: int, change: str, noise: bool, phases: tuple[float, ...]) -> list[str]:
    """Return a line for every record of which the cycles are not those of the motion."""
    found = []
    blur = (3.0 * NOISE_MM * noise + STEPS_MM.get(change, 0.0)) / (2.0 * HALF_MM)
    for phase in phases:
        p = phase + np.arange(round((3.3 if samples > 5000 else 6.3) * samples) + 1) / samples
        cycles = cycles_of(p, stroke_of(shape, p, change, noise))
        complete = [c for c in cycles if c.complete]
        right = shape.complete(float(p[0]), float(p[-1]), samples, blur)
        unsaid = any(not c.why for c in cycles if not (c.complete and c.steady))
        # A cycle at an end of the record is only as sure as the one side of its turn that is there, or as
        # the part of its rest.
        margin = 0.3 if samples <= 20 or shape.name in ("trapezoid", "paused") else 0.1
        inner = [
            c for c in complete if c.start_s > 0.4 * (p[0] + margin) and c.end_s < 0.4 * (p[-1] - margin)
        ]
        unsteady = [c.why for c in inner if not c.steady]
        if shape.name in ILL_SEEN.get(samples, ()):
            unsteady = []
        if len(complete) not in right or unsaid or unsteady:
            found.append(f"{phase:.4f}: {len(complete)} complete, right is {right}, not steady: {unsteady}")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.name)
@pytest.mark.parametrize("samples", [20, 100, 1000])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
def test_cycles_are_those_of_the_motion(shape: Shape, samples: int, noise: bool) -> None:
    """A part of the matrix: each change of the stroke with two or three of the phases."""
    for i, change in enumerate(CHANGES):
        assert failures(shape, samples, change, noise, PHASES[i :: 7 if samples < 1000 else 10]) == []


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: s.name)
@pytest.mark.parametrize("samples", [*SHORT, *LONG])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
@pytest.mark.parametrize("change", CHANGES)
def test_whole_matrix(shape: Shape, samples: int, noise: bool, change: str) -> None:
    assert failures(shape, samples, change, noise, PHASES) == []


def beside_a_gap(
    p: Floats, gap: tuple[float, float], beside: float, samples: int, blur: float
) -> tuple[range, range]:
    """Return the right numbers of cycles before and after a gap, made wider by ``beside`` on each side."""
    before = SHAPES[0].complete(float(p[0]), float(gap[0]) - beside, samples, blur)
    return before, SHAPES[0].complete(float(gap[1]) + beside, float(p[-1]), samples, blur)


@pytest.mark.parametrize("samples", [20, 100, 1000])
@pytest.mark.parametrize("noise", [False, True], ids=["clean", "noisy"])
def test_gap_is_never_integrated_across(samples: int, noise: bool) -> None:
    for phase in PHASES[::4]:
        whole = phase + np.arange(6 * samples) / samples
        missing = slice(int(2.4 * samples), int(2.4 * samples) + max(2, samples // 10))
        kept = np.delete(np.arange(whole.size), missing)
        gap = (whole[missing.start - 1], whole[missing.stop])
        stroke = stroke_of(SHAPES[0], whole, "plain", noise)
        cycles = cycles_of(whole[kept], stroke[kept])
        across = [c for c in cycles if c.start_s / 0.4 < gap[1] and c.end_s / 0.4 > gap[0]]
        assert not any(c.complete for c in across)
        assert all(c.why for c in across)
        blur = 3.0 * NOISE_MM * noise / (2.0 * HALF_MM)

        # A turn that noise moves into the gap is none on record: only those well beside it must count.
        least = sum(numbers.start for numbers in beside_a_gap(whole, gap, 0.03, samples, blur))
        most = sum(numbers.stop - 1 for numbers in beside_a_gap(whole, gap, 0.0, samples, blur))
        assert least <= sum(c.complete for c in cycles) <= most


@pytest.mark.slow
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
