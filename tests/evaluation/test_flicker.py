"""Absorbed energy amid noise that falls as 1/f: what noise makes of ∮ F dx, and what U states of it.

What is right is made here by itself: Σ wᵢ wⱼ R(tᵢ - tⱼ) with the covariance R of the noise in closed form,
and loops whose area is known. Flicker is the sum of three processes whose time constants are a decade apart.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.uncertainty.noise import Spectrum
from tests.evaluation.disturbed import SURE_FORCE, SURE_WIRES
from tests.evaluation.signals import Floats

STEP_S = 0.002
FORGETS_S = (0.03, 0.3, 3.0)
FLICKER_KN, WHITE_KN, WHITE_MM = 0.5, 0.05, 0.003
AMPLITUDE_MM, STIFF, LOSS = 2.0, 4.0, 3.0  # mm, kN/mm, kN/mm
PLACE_MM = 18.0


def flicker(random: np.random.Generator, size: int) -> Floats:
    """Return noise of standard deviation 1 that falls as 1/f between 0.05 and 5 Hz."""
    made = np.zeros(size)
    for forgets_s in FORGETS_S:
        keeps = np.exp(-STEP_S / forgets_s)
        steps = random.standard_normal(size) * np.sqrt(1.0 - keeps**2)
        steps[0] = random.standard_normal()
        made += lfilter([1.0], [1.0, -keeps], steps)
    return made / np.sqrt(len(FORGETS_S))


def density(frequency_Hz: Floats) -> Floats:
    """Return its two-sided density [1/Hz]."""
    parts = [2.0 * tau / (1.0 + (2.0 * np.pi * frequency_Hz * tau) ** 2) for tau in FORGETS_S]
    return np.asarray(np.sum(parts, axis=0) / len(FORGETS_S))


def weights_of(stroke_mm: Floats) -> Floats:
    """Return what the noise of each point counts in ∮ F dx: half of what the stroke moves about it."""
    half = 0.5 * np.diff(stroke_mm)
    return np.append(half, 0.0) + np.append(0.0, half)


@pytest.mark.parametrize("frequency_Hz", [0.5, 1.0, 2.0])
def test_the_variance_of_a_loop_is_that_of_its_noise_at_all_pairs_of_samples(frequency_Hz: float) -> None:
    time_s = np.arange(round(1.0 / frequency_Hz / STEP_S) + 1) * STEP_S
    weights = weights_of(-AMPLITUDE_MM * np.cos(2.0 * np.pi * frequency_Hz * time_s))
    apart_s = np.abs(time_s[:, None] - time_s[None, :])
    covariance = np.mean([np.exp(-apart_s / tau) for tau in FORGETS_S], axis=0)
    exact = float(np.sqrt(weights @ covariance @ weights))
    random = np.random.default_rng(1)
    made = [float(weights @ flicker(random, time_s.size)) for _ in range(1500)]
    assert np.std(made) == pytest.approx(exact, rel=0.06)
    at_Hz = np.geomspace(0.01, 250.0, 400)
    whole = Spectrum(at_Hz, density(at_Hz), STEP_S)
    assert float(np.sqrt(whole.variance(time_s, weights))) == pytest.approx(exact, rel=0.06)
    seen = at_Hz > 3.9 * frequency_Hz  # where cycles that follow each other begin to show it
    goes_on = Spectrum(at_Hz[seen], density(at_Hz)[seen], STEP_S, slope=1.0, slowest_Hz=0.06)
    assert float(np.sqrt(goes_on.variance(time_s, weights))) == pytest.approx(exact, rel=0.15)


def shares(frequency_Hz: float, cycles: int, seeds: range, flicker_kN: float) -> tuple[Floats, Floats]:
    """Return errors of W_a and their stated standard uncertainties [J], of the complete cycles of records.

    The stand goes to a prestress, makes sines about it and goes back, with rests between.
    """
    begins_s = 2.0
    ends_s = begins_s + cycles / frequency_Hz
    time_s = np.arange(0.0, ends_s + 3.0, STEP_S)
    last_s = float(time_s[-1])
    angle = 2.0 * np.pi * frequency_Hz * np.clip(time_s - begins_s, 0.0, ends_s - begins_s)
    ramp = np.interp(time_s, [0.3, 1.5, last_s - 1.5, last_s - 0.3], [0.0, PLACE_MM, PLACE_MM, 0.0])
    stroke = ramp + AMPLITUDE_MM * (1.0 - np.cos(angle))
    force = STIFF * stroke + LOSS * AMPLITUDE_MM * np.sin(angle)
    true_J = np.pi * LOSS * AMPLITUDE_MM**2
    facts = RunFacts("f", "harmonic", force_uncertainty=SURE_FORCE, stroke_uncertainty=SURE_WIRES[:1])
    errors, stated = [], []
    for seed in seeds:
        random = np.random.default_rng((7, seed))
        noise = flicker_kN * flicker(random, time_s.size) + WHITE_KN * random.standard_normal(time_s.size)
        wire = stroke + WHITE_MM * random.standard_normal(time_s.size)
        run = evaluate_run(make_record(time_s, wire, force + noise), facts, Options(draws=400))
        for result in run.cycles:
            found_J = result.quantities.absorbed_energy_J
            expanded_J = result.expanded_uncertainty.get("absorbed_energy_J")
            if found_J is not None and expanded_J is not None:
                errors.append(found_J - true_J)
                stated.append(0.5 * expanded_J)
    return np.array(errors), np.array(stated)


@pytest.mark.slow
@pytest.mark.parametrize(("frequency_Hz", "cycles"), [(0.5, 3), (1.0, 3), (1.0, 6)])
def test_u_of_the_absorbed_energy_holds_amid_flicker(frequency_Hz: float, cycles: int) -> None:
    """It was 3 to 20 times too small; what is left is that flicker of three processes is no exact 1/f."""
    errors, stated = shares(frequency_Hz, cycles, range(10), FLICKER_KN)
    assert 0.6 < float(np.sqrt(np.mean(errors**2) / np.mean(stated**2))) < 1.5
    assert errors.size >= 8
    assert float(np.mean(np.abs(errors) < 2.0 * stated)) > 0.7


@pytest.mark.slow
def test_u_of_the_absorbed_energy_stays_small_amid_white_noise() -> None:
    errors, stated = shares(1.0, 6, range(8), 0.0)
    assert 0.5 < float(np.sqrt(np.mean(errors**2) / np.mean(stated**2))) < 1.3
