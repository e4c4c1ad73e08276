"""Cycles are found from the stroke alone: none lost, none invented, ramps never taken for steady."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.cycles.harmonics import fitted_harmonics
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.signals import Ellipse, Floats, StaticTest


def counts(cycles: Sequence[Cycle]) -> tuple[int, int]:
    return sum(c.complete for c in cycles), sum(c.steady for c in cycles)


def cycles_of(time: Floats, stroke: Floats) -> tuple[Cycle, ...]:
    return find_cycles(make_record(time, stroke, stroke))


def stand_run(
    mean: float, amplitude: float, frequency: float, cycles: int, *, hold_s: float = 1.0, rate: float = 500.0
) -> tuple[Floats, Floats]:
    """Return a harmonic run as the stand drives it: ramp, amplitude in, cycles, amplitude out, ramp."""
    period = 1.0 / frequency

    def piece(duration: float) -> Floats:
        return np.arange(0.0, duration - 0.5 / rate, 1.0 / rate)

    def wave(at: Floats) -> Floats:
        return amplitude * np.sin(2.0 * np.pi * frequency * at)

    hold, ramp, one, full = piece(hold_s), piece(5.0), piece(period), piece(cycles * period)
    stroke = np.concatenate(
        (
            0.0 * hold,
            mean * ramp / 5.0,
            mean + 0.0 * hold,
            mean + one / period * wave(one),
            mean + wave(full),
            mean + (1.0 - one / period) * wave(one),
            mean + 0.0 * hold,
            mean * (1.0 - ramp / 5.0),
            0.0 * hold,
        )
    )
    return np.arange(stroke.size) / rate, stroke


@pytest.mark.parametrize("rate", [5.0, 50.0, 500.0])
@pytest.mark.parametrize("pause", [0.0, 0.5, 5.0, 60.0])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_static_test_has_three_cycles(rate: float, pause: float, noise: float) -> None:
    time, stroke, _ = StaticTest(top_mm=96.0, rate_Hz=rate, pause_s=pause, noise_mm=noise).columns()
    cycles = cycles_of(time, stroke)
    assert len(cycles) == 3
    assert counts(cycles) == (3, 3)
    for cycle in cycles:
        assert cycle.stroke_max_mm == pytest.approx(96.0, abs=0.01 + 2 * noise)
        assert cycle.stroke_min_mm == pytest.approx(0.0, abs=0.01 + 3 * noise + 0.15 * 5.0 / rate)
        # A dwell too short to be told from the turn counts in part.
        assert cycle.duration_s == pytest.approx(2 * 96.0 / 5.0, abs=1.0)


def test_pause_does_not_belong_to_a_cycle() -> None:
    time, stroke, _ = StaticTest(pause_s=30.0).columns()
    cycles = cycles_of(time, stroke)
    for before, after in pairwise(cycles):
        assert after.start_s - before.end_s == pytest.approx(30.0, abs=0.1)
        assert before.end.dwell_s == pytest.approx(30.0, abs=0.1)


def test_recovery_during_the_pause() -> None:
    """A residual stroke that creeps back while the buffer rests neither hides nor adds a cycle."""
    time, stroke, _ = StaticTest(top_mm=96.0, pause_s=60.0, noise_mm=0.0).columns()
    since = np.mod(time - 40.4, 98.4)
    creeping = np.maximum(stroke, np.where(time > 30.0, 0.8 * np.exp(-since / 30.0), 0.0))
    cycles = cycles_of(time, creeping)
    assert counts(cycles) == (3, 3)
    assert cycles[0].stroke_end_mm == pytest.approx(0.8, abs=0.1)
    assert cycles[1].stroke_min_mm < 0.4


def test_dwell_at_the_top_is_measured() -> None:
    time, stroke, _ = StaticTest(dwell_s=3.0).columns()
    assert [round(c.top.dwell_s, 1) for c in cycles_of(time, stroke)] == [3.0, 3.0, 3.0]


@pytest.mark.parametrize(
    ("mean", "amplitude", "frequency", "cycles"),
    [
        (50.0, 10.0, 1.0, 10),
        (20.0, 20.0, 1.27, 8),
        (80.0, 5.0, 2.55, 20),
        (80.0, 0.5, 2.5, 20),
        (50.0, 30.0, 0.42, 3),
        (40.0, 40.0, 0.32, 5),
    ],
)
@pytest.mark.parametrize("noise", [0.0, 5e-4])
@pytest.mark.parametrize("hold_s", [0.0, 1.0])
def test_ramps_are_not_steady(
    mean: float, amplitude: float, frequency: float, cycles: int, noise: float, hold_s: float
) -> None:
    time, stroke = stand_run(mean, amplitude, frequency, cycles, hold_s=hold_s)
    stroke = stroke + noise * 2.0 * amplitude * np.random.default_rng(1).standard_normal(time.size)
    found = cycles_of(time, np.round(stroke / 0.0076) * 0.0076)
    # n cycles of full amplitude have n lower turning points, so n - 1 cycles between them.
    assert sum(c.steady for c in found) == cycles - 1
    for cycle in found:
        if cycle.steady:
            assert cycle.range_mm == pytest.approx(2.0 * amplitude, rel=0.004, abs=0.01)
        else:
            assert cycle.why
    assert not found[0].complete
    assert "does not close" in found[0].why[0]


def test_drift_loses_nothing() -> None:
    time, stroke = stand_run(50.0, 10.0, 1.0, 10)
    assert counts(cycles_of(time, stroke + 0.05 * time))[1] == 9


@pytest.mark.parametrize("samples_a_cycle", [20, 100, 2000, 100_000])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5, 4.0, 5.5])
def test_any_phase_and_sampling(samples_a_cycle: int, phase: float) -> None:
    cycles_wanted = 3 if samples_a_cycle > 10_000 else 6
    time, stroke, _ = Ellipse().columns(
        1.0, float(samples_a_cycle), cycles_wanted + 1, phase=phase, noise=5e-4
    )
    complete, steady = counts(cycles_of(time, stroke))
    assert complete in (cycles_wanted, cycles_wanted + 1)
    assert steady == complete


TIME = np.arange(0.0, 10.0, 0.002)
TRIANGLE = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * TIME + 1.0))


@pytest.mark.parametrize(
    "stroke",
    [
        50.0 + 20.0 * TRIANGLE,
        50.0 + np.clip(40.0 * TRIANGLE, -20.0, 20.0),
        50.0 + 20.0 * np.sin(2.0 * np.pi * TIME + 0.6 * np.sin(2.0 * np.pi * TIME) + 2.0),
        50.0 + 20.0 * np.sin(2.0 * np.pi * TIME + 1.0) + 3.0 * np.sin(4.0 * np.pi * TIME),
        np.round((50.0 + 20.0 * np.sin(2.0 * np.pi * TIME + 1.0)) / 0.5) * 0.5,
        np.repeat((50.0 + 20.0 * np.sin(2.0 * np.pi * TIME + 1.0))[::10], 10),
    ],
    ids=["triangle", "trapezoid", "skewed", "two harmonics", "coarse steps", "held samples"],
)
def test_shapes(stroke: Floats) -> None:
    assert counts(cycles_of(TIME, stroke)) == (9, 9)


@pytest.mark.parametrize("start", [0.0, 0.03, -0.03])
def test_record_that_begins_at_the_turn(start: float) -> None:
    """Up to about 1 % of a period may be missing at an end; the frequency is right all the same."""
    stroke = 50.0 - 20.0 * np.cos(2.0 * np.pi * TIME + start)
    cycles = cycles_of(TIME, stroke)
    complete = [c for c in cycles if c.complete]
    assert len(complete) == 10
    for cycle in complete:
        assert 1.0 / cycle.duration_s == pytest.approx(1.0, rel=1e-3)


def test_record_that_cuts_a_cycle() -> None:
    stroke = 50.0 - 20.0 * np.cos(2.0 * np.pi * TIME + 0.3)
    cycles = cycles_of(TIME, stroke)
    assert counts(cycles) == (9, 9)
    assert not cycles[0].complete
    assert cycles[0].why


def test_gap_spoils_only_its_cycle() -> None:
    keep = np.delete(np.arange(TIME.size), slice(2150, 2175))
    cycles = cycles_of(TIME[keep], 50.0 - 20.0 * np.cos(2.0 * np.pi * TIME[keep]))
    assert [c.index for c in cycles if not c.complete] == [5]
    assert "gap of 0.052 s after 4.298 s" in cycles[4].why[0]


def test_gap_at_a_turn_spoils_both_cycles() -> None:
    keep = np.delete(np.arange(TIME.size), slice(2490, 2510))
    cycles = cycles_of(TIME[keep], 50.0 - 20.0 * np.cos(2.0 * np.pi * TIME[keep]))
    assert counts(cycles)[0] == 8
    assert not any(c.complete for c in cycles if c.start_s < 5.0 < c.end_s)


def test_nothing_to_find() -> None:
    still = np.full(TIME.size, 50.0)
    noise = 0.01 * np.random.default_rng(1).standard_normal(TIME.size)
    assert cycles_of(TIME, still) == ()
    assert not any(c.complete for c in cycles_of(TIME, still + noise))
    assert cycles_of(TIME, 5.0 * TIME) == ()


def test_single_cycle_is_not_steady() -> None:
    one = TIME < 1.0
    (cycle,) = cycles_of(TIME[one], 20.0 - 20.0 * np.cos(2.0 * np.pi * TIME[one]))
    assert cycle.complete
    assert not cycle.steady
    assert cycle.why == ("there is no other cycle to compare it with",)


def test_cycle_of_other_shape_is_not_steady() -> None:
    sine = 50.0 - 20.0 * np.cos(2.0 * np.pi * TIME)
    triangle = 50.0 + 20.0 * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * TIME - np.pi / 2))
    mixed = np.where((TIME > 4.0) & (TIME < 5.0), triangle, sine)
    cycles = cycles_of(TIME, mixed)
    assert counts(cycles) == (10, 9)
    assert "distorted" in cycles[4].why[0]


def test_distortion_of_known_shapes() -> None:
    sine = cycles_of(TIME, 50.0 + 20.0 * np.sin(2.0 * np.pi * TIME + 1.0))[2]
    assert sine.stroke_distortion == pytest.approx(0.0, abs=1e-6)
    # Triangle: odd harmonics 1/k², to the ninth.
    triangle = cycles_of(TIME, 50.0 + 20.0 * TRIANGLE)[2]
    assert triangle.stroke_distortion == pytest.approx(np.sqrt(sum(k**-4.0 for k in (3, 5, 7, 9))), rel=0.01)


def test_harmonics_of_uneven_samples() -> None:
    at = np.sort(np.random.default_rng(2).uniform(0.0, 2.0, 300))
    value = 3.0 + 2.0 * np.cos(np.pi * at) - 1.5 * np.sin(np.pi * at) + 0.5 * np.sin(3.0 * np.pi * at)
    share = at[None] / 2.0
    found = fitted_harmonics(share, value[None, None], np.ones_like(share, dtype=bool), 5)[0, 0]
    np.testing.assert_allclose(found[:2], [[3.0, 0.0], [2.0, -1.5]], atol=1e-9)
    np.testing.assert_allclose(found[3], [0.0, 0.5], atol=1e-9)
