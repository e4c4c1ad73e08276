"""The 95 % intervals hold the truth as often as they say, over many records with errors as stated.

Truth is closed form, and the errors come from a simulation of the sensors of its own (``closed_loops``).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import binom

from evaluation.record import make_record
from evaluation.results import Options, RunFacts
from evaluation.run import evaluate_run
from tests.evaluation.closed_loops import FORCE, LOADING, WIRES, Progressive, measured, thermometer

TANGENT = "tangent_stiffness_kN_per_mm"
FIGURES = (
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
    TANGENT,
    "secant_stiffness_kN_per_mm",
    "dynamic_stiffness_kN_per_mm",
    "storage_stiffness_kN_per_mm",
    "loss_stiffness_kN_per_mm",
    "loss_factor",
    "force_max_kN",
    "prestress_mm",
    "amplitude_mm",
    "frequency_Hz",
)
"""Figures whose intervals are neither too narrow nor too wide."""
NOT_TOO_NARROW = (
    "force_min_kN",
    "stroke_min_mm",
    "stroke_max_mm",
    "temperature_start_C",
    "temperature_max_C",
)
"""Figures that the extreme of a noisy reading leans to one side, or whose error is a rectangle alone."""


@dataclass(frozen=True)
class Study:
    """A loop, how it is sampled, and for how many cycles."""

    loop: Progressive
    samples_a_cycle: int
    cycles: float

    def hits(self, seeds: range, draws: int = 1000) -> Counter[str]:
        """Count how often the truth lies within the 95 % interval."""
        counts: Counter[str] = Counter()
        facts = RunFacts("c", "harmonic", force_uncertainty=FORCE, stroke_uncertainty=WIRES)
        truth = self.loop.truth()
        for seed in seeds:
            random = np.random.default_rng(seed)
            rate_Hz = self.samples_a_cycle * self.loop.frequency_Hz
            time, stroke, force = measured(self.loop, random, cycles=self.cycles, rate_Hz=rate_Hz)
            sensors = [thermometer(time, random)]
            run = evaluate_run(
                make_record(time, stroke, force, temperatures=sensors), facts, Options(draws=draws)
            )
            for name in (*FIGURES, *NOT_TOO_NARROW):
                true, figure = truth[name], run.summary.values[name]
                assert figure.value is not None
                assert figure.half_width_95 is not None
                counts[name] += abs(figure.value - true) <= figure.half_width_95
        return counts


HARMONIC = Progressive()
STATIC = Progressive(0.0, 100.0, 0.025, 0.5, "static", 20.0)
STUDIES = {
    "harmonic, 100 samples a cycle": Study(HARMONIC, 100, 5.2),
    "harmonic, 1000": Study(HARMONIC, 1000, 3.2),
    "harmonic, 10 000": Study(HARMONIC, 10_000, 3.2),
    "static, 100": Study(STATIC, 100, 3.02),
    "static, 1000": Study(STATIC, 1000, 3.02),
    "static, 10 000": Study(STATIC, 10_000, 3.02),
}


@pytest.mark.parametrize("name", ["harmonic, 1000", "static, 1000"])
def test_a_dose(name: str) -> None:
    """40 records: of 93 to 97 % true coverage no count is outside what 1 in 10 000 doses have."""
    records = 40
    least, most = binom.ppf(1e-4, records, 0.93), binom.ppf(1.0 - 1e-4, records, 0.97)
    counts = STUDIES[name].hits(range(records), draws=500)
    assert {n: c for n, c in counts.items() if not least <= c <= most} == {}


@pytest.mark.long
@pytest.mark.parametrize("study", STUDIES.values(), ids=STUDIES)
def test_the_whole_study(study: Study) -> None:
    """2000 records: 93 to 97 %."""
    counts = study.hits(range(2000))
    shares = {name: count / 2000 for name, count in counts.items()}
    print({name: f"{100.0 * share:.1f}" for name, share in shares.items()})
    assert {name: shares[name] for name in FIGURES if not 0.93 <= shares[name] <= 0.97} == {}
    assert {name: shares[name] for name in NOT_TOO_NARROW if shares[name] < 0.93} == {}


@pytest.mark.parametrize("loop", [HARMONIC, STATIC], ids=["harmonic", "static"])
def test_the_closed_forms_agree_with_a_fine_grid(loop: Progressive) -> None:
    """The truth itself, by another way: 400 000 points of a cycle."""
    time = np.linspace(0.0, 1.0 / loop.frequency_Hz, 400_001)
    stroke, _ = loop.state(time)
    force, _ = loop.force(time)
    up = slice(0, time.size // 2 + 1)
    truth = loop.truth()
    stored = float(np.trapezoid(force[up], stroke[up]))
    assert truth["stored_energy_J"] == pytest.approx(stored, rel=1e-5)
    assert truth["absorbed_energy_J"] == pytest.approx(float(np.trapezoid(force, stroke)), rel=1e-5)
    turn = np.exp(-2j * np.pi * loop.frequency_Hz * time)
    first = complex(np.trapezoid(force * turn, time)) / complex(np.trapezoid(stroke * turn, time))
    assert truth["storage_stiffness_kN_per_mm"] == pytest.approx(first.real, rel=1e-5)
    assert truth["loss_stiffness_kN_per_mm"] == pytest.approx(first.imag, rel=1e-5)
    assert truth["force_max_kN"] == pytest.approx(float(np.max(force)), rel=1e-9)
    assert truth[TANGENT] == pytest.approx(float(LOADING.deriv()(0.5 * (loop.low_mm + loop.high_mm))))
