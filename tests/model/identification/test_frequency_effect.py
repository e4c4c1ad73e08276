"""A spring whose stiffness rises with the frequency: found, foretold at other frequencies, missed without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.model.identification.procedure import SPECTRUM, FitSettings, Identification, identify
from bufferstand.model.prediction import predict_harmonic
from bufferstand.model.spring import ViscousBranch
from tests.model.identification.synthetic import (
    FINER,
    RATE_Hz,
    harmonic,
    measured,
    simulated,
    static,
    truth,
)

FINE_Hz = RATE_Hz * FINER
B = 0.04
HELD_OUT = [(p, a, f) for p, a in ((20.0, 20.0), (40.0, 40.0)) for f in (0.04, 0.16, 0.64)]
"""Strokes of Fig. 8a at frequencies of which no run has any."""


def with_spectrum(b=B):
    """The buffer of the coverage study, with branch and spectrum as fitted to the published dampings."""
    return replace(truth(), viscous=ViscousBranch(0.067, 4.7, b))


def campaign(model, seed=5):
    """A slow stroke and constant amplitude at five frequencies, in mixed order, while the spring warms up."""
    parts = [static(95.0, 5.0, FINE_Hz), 20.0]
    for prestress, amplitude in ((20.0, 20.0), (40.0, 40.0)):
        for frequency, cycles in ((0.32, 4), (0.02, 1), (1.27, 6), (0.08, 3), (2.0, 6)):
            if 2.0 * np.pi * frequency * amplitude < 260.0:  # mm/s, what such a stand reaches
                parts += [harmonic(prestress, amplitude, frequency, cycles, FINE_Hz), 20.0]
    parts += [harmonic(50.0, 10.0, 0.5, 3, FINE_Hz), 20.0, harmonic(75.0, 5.0, 1.5, 4, FINE_Hz)]
    return measured(seed, [simulated(model, parts, 22.0, 20.0)[0]])


def slope(model, prestress, amplitude):
    """Change of the damping per decade of frequency between 0.04 and 0.64 Hz."""
    low, high = (predict_harmonic(model, prestress, amplitude, f, 25.0).damping for f in (0.04, 0.64))
    return (high - low) / np.log10(0.64 / 0.04)


@pytest.fixture(scope="module")
def drives():
    return campaign(with_spectrum())


@pytest.fixture(scope="module")
def found(drives) -> Identification:
    return identify(drives, FitSettings(knots=7))


def test_the_spectrum_is_found_with_an_interval(found):
    (b,) = [estimate for estimate in found.estimates if estimate.name == SPECTRUM]
    assert b.identified
    assert b.value == pytest.approx(B, abs=0.003)  # knots are not those of the truth: beyond the interval
    assert 0.0 < b.low < b.value < b.high
    assert b.high - b.low < 0.3 * B
    assert found.model.viscous.spectrum_per_decade == b.value


@pytest.mark.parametrize(("prestress", "amplitude", "frequency"), HELD_OUT)
def test_damping_is_foretold_at_frequencies_that_no_run_had(found, prestress, amplitude, frequency):
    new, old = (
        predict_harmonic(model, prestress, amplitude, frequency, 25.0)
        for model in (found.model, with_spectrum())
    )
    assert new.damping == pytest.approx(old.damping, abs=0.002)
    assert new.peak_force_kN == pytest.approx(old.peak_force_kN, rel=0.003)


def test_without_it_the_dampings_slope_is_too_steep(drives, found):
    """Why it is a parameter: one branch has to explain stiffness and loss alike, and cannot."""
    bare = identify(drives, FitSettings(knots=7, without=(SPECTRUM,), hold_out=False)).model
    true, ours, theirs = (slope(model, 20.0, 20.0) for model in (with_spectrum(), found.model, bare))
    print(f"slope per decade: true {true:.4f}, with spectrum {ours:.4f}, without {theirs:.4f}")
    assert ours == pytest.approx(true, rel=0.1)
    assert abs(theirs / true - 1.0) > 0.2


def test_a_spring_without_it_is_given_none():
    made = identify(campaign(with_spectrum(0.0), seed=6), FitSettings(knots=7))
    (why,) = [unknown.why for unknown in made.unknown if unknown.name == SPECTRUM]
    assert "none" in why
    assert made.model.viscous.spectrum_per_decade == 0.0
