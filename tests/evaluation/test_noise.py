"""The noise of a record over frequency, against noise that was made with a known one."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.loops.cut import cut_loop
from bufferstand.evaluation.numerics.hum import lines_of, without_lines
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.uncertainty.noise import Noise, Spectrum, record_noise, white
from bufferstand.evaluation.uncertainty.speed_noise import speed_lean
from tests.evaluation.closed_loops import Progressive, measured
from tests.evaluation.disturbed import SURE_FORCE, SURE_WIRES, coloured
from tests.evaluation.signals import Floats

LOOP = Progressive()
RATE_HZ = 203.0
STEP_S = 1.0 / RATE_HZ
SIGMA_KN, FORGETS_S = 0.3, 0.02
WHITE_KN = 0.15


def noise_of(seed: int, added_kN: float = 0.0, cycles: float = 10.3) -> Noise:
    """Return the noise that is found in a record with white noise, and coloured noise of the force."""
    random = np.random.default_rng(seed)
    columns = measured(LOOP, random, cycles=cycles, rate_Hz=RATE_HZ, force=SURE_FORCE, wires=SURE_WIRES)
    time, stroke, force = columns
    record = make_record(time, stroke, force + added_kN * coloured(random, time.size, STEP_S, FORGETS_S))
    return record_noise(record, cycles=[c for c in find_cycles(record) if c.complete])


def density_kN2_s(frequency_Hz: Floats, added_kN: float) -> Floats:  # noqa: N802
    """Return the two-sided density of that noise, in closed form."""
    share = np.exp(-STEP_S / FORGETS_S)
    turn = np.exp(-2j * np.pi * frequency_Hz * STEP_S)
    of_share = (1.0 - share**2) / np.abs(1.0 - share * turn) ** 2
    return np.asarray((WHITE_KN**2 + added_kN**2 * of_share) * STEP_S)


@pytest.mark.slow
@pytest.mark.parametrize("added_kN", [0.0, SIGMA_KN])
def test_density_is_that_of_the_noise(added_kN: float) -> None:
    """From a third of a cycle's frequency to the fastest: the mean of eight records within 20 %."""
    frequency = np.array([0.2, 0.5, 2.0, 5.0, 10.0, 40.0, 80.0])
    found = []
    for seed in range(8):
        spectrum = noise_of(seed, added_kN).force
        assert spectrum is not None
        assert spectrum.lines == ()
        found.append(spectrum.at(frequency))
    share = np.sqrt(np.mean(found, axis=0) / density_kN2_s(frequency, added_kN))
    assert np.all(np.abs(share - 1.0) < 0.2), share


def test_cycles_that_settle_are_no_noise() -> None:
    """Half a per cent less force from cycle to cycle, the force in all places alike or at the top most."""
    plain = noise_of(1).force
    random = np.random.default_rng(1)
    columns = measured(LOOP, random, cycles=10.3, rate_Hz=RATE_HZ, force=SURE_FORCE, wires=SURE_WIRES)
    time, stroke, force = columns
    for bent in (force, force * (stroke - 10.0) / 70.0):
        settles = bent * 0.05 * np.exp(-time * LOOP.frequency_Hz / 10.0)
        record = make_record(time, stroke, force + settles)
        found = record_noise(record, cycles=[c for c in find_cycles(record) if c.complete]).force
        assert plain is not None
        assert found is not None
        share = np.sqrt(found.at(np.array([0.5, 2.0, 10.0])) / plain.at(np.array([0.5, 2.0, 10.0])))
        assert np.all(np.abs(share - 1.0) < 0.25), share


def test_sums_of_noise_scatter_as_the_density_says() -> None:
    """Sums of made noise (autoregression, and hum of any phase) by weights of four kinds."""
    points, line_Hz, line_kN = 400, 23.0, 0.4
    frequency = np.geomspace(0.05, 100.0, 200)
    time = STEP_S * np.arange(points)
    place = np.linspace(-1.0, 1.0, points)
    weights = np.stack((np.ones(points), np.sin(np.pi * place), place, np.exp(-((place / 0.05) ** 2))))
    random = np.random.default_rng(7)
    made = []
    for _ in range(3000):
        wave = line_kN * np.cos(2.0 * np.pi * (line_Hz * time + random.random()))
        noise = SIGMA_KN * coloured(random, points, STEP_S, FORGETS_S) + wave
        made.append(weights @ (noise + WHITE_KN * random.standard_normal(points)))
    noisy = wave[None] + WHITE_KN * random.standard_normal((1, points * 3))[:, :points]
    lines = lines_of(noisy, STEP_S, 2.0, 2.0)
    assert lines == ()  # so short a record shows none
    pure = line_kN * np.cos(2.0 * np.pi * line_Hz * STEP_S * np.arange(4000))
    hum = lines_of(pure[None], STEP_S, 2.0, 2.0)
    spectrum = Spectrum(frequency, density_kN2_s(frequency, SIGMA_KN), STEP_S, hum)
    expected = np.sqrt(spectrum.variance(time, weights))
    assert np.std(made, axis=0) == pytest.approx(expected, rel=0.06)
    again = spectrum.series(np.random.default_rng(3), 3000, points, STEP_S) @ weights.T
    assert np.std(again, axis=0) == pytest.approx(expected, rel=0.06)


def test_white_noise_is_what_it_was() -> None:
    """The root of the sum of squares, and on points that are means or lie between samples as much."""
    for each in (0.25, 1.0, 4.0):
        time = STEP_S * each * np.arange(300)
        weight = np.sin(np.linspace(0.0, np.pi, 300))
        expected = WHITE_KN * np.linalg.norm(weight) / np.sqrt(each)
        assert np.sqrt(white(WHITE_KN, STEP_S).variance(time, weight)) == pytest.approx(expected, rel=0.01)
    assert white(WHITE_KN, STEP_S).sigma == pytest.approx(WHITE_KN)
    assert white(WHITE_KN, STEP_S).mean_variance(25.0) == pytest.approx(WHITE_KN**2 / 25.0, rel=0.03)


@pytest.mark.parametrize("rate_Hz", [61.0, 203.0, 1009.0])
def test_hum_is_found_and_nothing_else(rate_Hz: float) -> None:
    """0.2 kN of 50 Hz, folded where samples are slow, on a loop with corners and noise; and none without."""
    step_s = 1.0 / rate_Hz
    loop = Progressive(0.0, 100.0, 0.1, 0.5, "static", 2.0)
    random = np.random.default_rng(4)
    time, _, force = measured(
        loop, random, cycles=6.3, rate_Hz=rate_Hz, force=SURE_FORCE, wires=SURE_WIRES, noise=(0.05, 0.002)
    )
    assert lines_of(force[None], step_s, 10.0, 10.0) == ()
    hum = 0.2 * np.sin(2.0 * np.pi * 50.0 * time + 1.0)
    (line,) = lines_of((force + hum)[None], step_s, 10.0, 10.0)
    assert line.frequency_Hz == pytest.approx(abs((50.0 + rate_Hz / 2.0) % rate_Hz - rate_Hz / 2.0), abs=2e-3)
    assert line.amplitude == pytest.approx(0.2, rel=0.08)
    left = without_lines((force + hum)[None], step_s, [line])[0] - force
    assert np.std(left) < 0.02


@pytest.mark.parametrize("hum_mm", [0.0, 0.05])
def test_a_stroke_that_is_flat_at_its_turns_does_not_hum(hum_mm: float) -> None:
    """Its two turns are alike: it has every other harmonic, far above noise, and none of them is hum."""
    time = np.arange(9000) / 1000.0
    since = np.mod(time, 0.6)
    angle = np.interp(since, [0.0, 0.25, 0.3, 0.55, 0.6], np.pi * np.array([0.0, 1.0, 1.0, 2.0, 2.0]))
    wave = hum_mm * np.sin(2.0 * np.pi * 50.9 * time)
    stroke = 10.0 * np.cos(angle) + 0.01 * np.random.default_rng(3).standard_normal(time.size) + wave
    lines = lines_of(stroke[None], 1e-3, 0.6, 0.6)
    if not hum_mm:
        assert lines == ()
        return
    (line,) = lines
    assert line.frequency_Hz == pytest.approx(50.9, abs=0.02)
    assert 0.5 * hum_mm <= line.amplitude <= 1.5 * hum_mm  # the corners have a part of it


@pytest.mark.slow
@pytest.mark.parametrize(
    "samples", [50, *(pytest.param(samples, marks=pytest.mark.long) for samples in (133, 1000))]
)
def test_largest_speed_leans_as_stated(samples: int) -> None:
    """Mean and scatter of the error of the largest speed over 150 cycles, against what is stated."""
    error, leans = [], []
    truth = LOOP.truth()["speed_loading_max_mm_per_s"]
    for seed in range(50):
        random = np.random.default_rng(seed)
        rate_Hz = samples * LOOP.frequency_Hz
        record = make_record(
            *measured(LOOP, random, cycles=4.2, rate_Hz=rate_Hz, force=SURE_FORCE, wires=SURE_WIRES)
        )
        sigma = record_noise(record).stroke_mm
        for cycle in [c for c in find_cycles(record) if c.complete][:3]:
            speed = evaluate_cycle(record, cycle).quantities.speed_loading_max_mm_per_s
            assert speed is not None
            error.append(speed - truth)
            loop = cut_loop(record, cycle)
            leans.append(speed_lean(loop, loop.loading, samples, white(sigma, 1.0 / rate_Hz)))
    mean, scatter = np.mean(leans, axis=0)
    off = np.hypot(np.mean(error) - mean, np.std(error) - scatter)
    assert off < 0.35 * np.hypot(np.mean(error), np.std(error))


@pytest.mark.slow
def test_an_even_speed_of_few_samples_leans_as_stated() -> None:
    """Strokes of 200 samples: noise that is left in the smoothed speed must not hide half of the lean.

    A quarter is made where the branch begins, between the turn and its first sample, and is not in it.
    """
    error, leans = [], []
    for seed in range(12):
        random = np.random.default_rng(seed)
        knots = np.cumsum([0.0, 3.0, 4.0, 4.0, 3.0, 4.0, 4.0, 3.0])
        time = np.arange(0.0, knots[-1], 0.02) + random.uniform(0.0, 0.02)
        stroke = np.interp(time, knots, [0.0, 0.0, 80.0, 0.0, 0.0, 80.0, 0.0, 0.0])
        read = stroke + 0.05 * random.standard_normal(time.size)
        record = make_record(time, read, 10.0 + 4.0 * read)
        for cycle in find_cycles(record):
            speed = evaluate_cycle(record, cycle).quantities.speed_loading_max_mm_per_s
            assert speed is not None
            error.append(speed - 20.0)
            loop = cut_loop(record, cycle)
            leans.append(speed_lean(loop, loop.loading, 400.0, white(0.05, 0.02), cycle.index).mean)
    assert len(error) == 24
    assert np.mean(leans) == pytest.approx(np.mean(error), rel=0.3)


def test_harmonics_of_a_loop_that_warms_up_are_no_hum_where_one_cycle_is_short() -> None:
    """The last cycle of a warming-up run was 4 % shorter, and its 13th, 15th and 17th harmonics were hum."""
    random = np.random.default_rng(7)
    step_s, cycle_s = 8e-3, 1.178
    time_s = step_s * np.arange(9862)
    angle = 2.0 * np.pi * time_s / cycle_s
    softer = 1.0 - 0.2 * time_s / time_s[-1]
    force = softer * (400.0 * np.sin(angle) + sum(40.0 / n * np.sin(n * angle) for n in range(3, 60, 2)))
    force += 0.2 * softer * sum(
        40.0 / n * np.cos(n * angle) for n in range(2, 60, 2)
    ) + 0.05 * random.standard_normal(time_s.size)
    assert lines_of(force[None], step_s, 0.96 * cycle_s, cycle_s) == ()
    hum = 5.0 * np.cos(2.0 * np.pi * 50.0 * time_s)
    (line,) = lines_of((force + hum)[None], step_s, 0.96 * cycle_s, cycle_s)
    assert line.frequency_Hz == pytest.approx(50.0, abs=0.02)
