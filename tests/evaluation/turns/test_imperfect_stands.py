"""Stands that round, lag, rest and creep at their turns: the stated U holds what they really did."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.turns.imperfect_stands import (
    CHECKED,
    DISTURBANCES,
    FORCE_FACTS,
    STROKE_FACTS,
    Disturbance,
    Sampling,
    Stand,
    recorded,
)

STANDS = (
    Stand("static", "sharp"),
    Stand("static", "rounded", 0.02),
    Stand("static", "rounded", 0.1),
    Stand("static", "lag", 0.02),
    Stand("static", "lag", 0.1),
    Stand("static", "second-order", 0.1),
    Stand("static", "dwell", 1.0),
    Stand("static", "creep", 1.0),
    Stand("harmonic", "sharp"),
    Stand("harmonic", "second-order", 0.02),
)
HELD = (
    "force_max_kN",
    "force_min_kN",
    "secant_stiffness_kN_per_mm",
    "stroke_max_mm",
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
)
"""What the turning points make; the rest is reported by the long study."""


@dataclass
class Count:
    """How often U holds the truth, and how far fitted strokes go beyond it at worst, in U."""

    held: int = 0
    of: int = 0

    @property
    def share(self) -> float:
        return self.held / max(1, self.of)


def count(stand: Stand, sampling: Sampling, seed: int, counts: dict[str, Count]) -> None:
    """Evaluate one record and count, figure by figure, where U holds the truth."""
    record, truth = recorded(stand, sampling, np.random.default_rng(seed))
    facts = RunFacts("i", stand.kind, force_uncertainty=FORCE_FACTS, stroke_uncertainty=STROKE_FACTS)
    run = evaluate_run(record, facts, Options(draws=300, seed=seed))
    # Of few samples a cycle is not evaluated where what lies between them may change too much.
    whole = [result for result in run.cycles if result.cycle.complete or not result.cycle.bounded]
    assert len(whole) == len(truth)
    highest_mm = float(np.max(record.stroke_mm))
    for result, true in zip(whole, truth, strict=True):
        counts["evaluated"].of += 1
        counts["evaluated"].held += result.cycle.complete
        if not result.cycle.complete:
            continue
        for name in CHECKED:
            value, expanded = getattr(result.quantities, name), result.expanded_uncertainty.get(name)
            assert value is not None
            assert expanded is not None
            counts[name].of += 1
            counts[name].held += abs(value - true[name]) <= expanded
        expanded = result.expanded_uncertainty["stroke_max_mm"]
        assert expanded is not None
        # A smooth motion is interpolated between samples, and the tip of a coarse triangle lies between them.
        if stand.kind == "static" and sampling.samples_a_cycle >= 1000:
            # U is drawn (4 % with 300 draws), and no stand is taken to need more than 0.2 s to turn.
            assert result.cycle.stroke_max_mm <= highest_mm + 1.25 * expanded


def test_a_dose() -> None:
    """Ten stands by two noises: what was +0.25 mm and +0.8 % of W_s is within U."""
    counts: dict[str, Count] = defaultdict(Count)
    for seed, (stand, noise) in enumerate(product(STANDS, (0.005, 0.05))):
        count(stand, Sampling(1000, noise, 5.0 * noise), seed, counts)
    assert {name: counts[name].share for name in HELD if counts[name].share < 0.85} == {}


@pytest.mark.parametrize("disturbance", ["coloured", "hum", "quantised", "held"])
def test_other_noise_than_white(disturbance: Disturbance) -> None:
    """A smaller dose of what the long study counts; forces at turns alone, which are what is new here."""
    counts: dict[str, Count] = defaultdict(Count)
    for seed, stand in enumerate(STANDS):
        count(stand, Sampling(1000, 0.03, 0.15, disturbance), seed, counts)
    assert {name: counts[name].share for name in HELD[:3] if counts[name].share < 0.75} == {}


@pytest.mark.long
@pytest.mark.parametrize("disturbance", DISTURBANCES)
@pytest.mark.parametrize("samples", [200, 1000])
def test_noise_of_every_kind(samples: int, disturbance: Disturbance) -> None:
    """Prints the share in which U holds the truth, of all stands."""
    counts: dict[str, Count] = defaultdict(Count)
    for seed, (stand, noise) in enumerate(product(STANDS * 2, (0.01, 0.05))):
        count(stand, Sampling(samples, noise, 5.0 * noise, disturbance), 2000 + seed, counts)
    print(samples, disturbance, {name: f"{100.0 * one.share:.1f}" for name, one in counts.items()})
    assert {name: counts[name].share for name in HELD[:3] if counts[name].share < 0.75} == {}


@pytest.mark.long
@pytest.mark.parametrize("samples", [100, 1000, 20_000])
@pytest.mark.parametrize("kind", ["static", "harmonic"])
def test_the_whole_study(kind: str, samples: int) -> None:
    """White noise of 0 to 100 µm; prints the table of the docs.

    NOT MET: 100 samples a cycle of a static run are 115 ms apart, more than a stand needs to turn: what they
    leave of a turn is held in 82 to 88 % only.
    """
    counts: dict[str, Count] = defaultdict(Count)
    for seed, (stand, noise) in enumerate(product(STANDS * 5, (0.0, 0.005, 0.03, 0.1))):
        if stand.kind == kind:
            count(stand, Sampling(samples, noise, 5.0 * noise), 1000 + seed, counts)
    print(kind, samples, {name: f"{100.0 * one.share:.1f}" for name, one in counts.items()})
    least = 0.85 if samples >= 1000 else 0.75
    assert {name: counts[name].share for name in HELD if counts[name].share < least} == {}


def test_hum_as_fast_as_the_samples_hides_no_misfit() -> None:
    """Differences of neighbours see it twice: a turn that lags for 0.1 s was read 0.1 mm too low, by 2 U."""
    counts: dict[str, Count] = defaultdict(Count)
    for seed in range(4):
        count(STANDS[4], Sampling(1000, 0.05, 0.25, "hum"), 7000 + seed, counts)
    assert min(counts[name].share for name in ("stroke_max_mm", "stored_energy_J")) > 0.7


def test_the_branch_ends_where_the_creep_begins() -> None:
    """It was read 0.06 mm further, at the level an eighth of the rest later: 1 kN beyond every sample."""
    counts: dict[str, Count] = defaultdict(Count)
    for seed in range(4):
        count(STANDS[7], Sampling(1000, 0.01, 0.05), 9100 + seed, counts)
    assert min(counts[name].share for name in ("secant_stiffness_kN_per_mm", "force_max_kN")) > 0.8
