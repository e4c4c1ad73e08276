"""A force that rings where play closes, and chatters as it slides: what specimens with friction do.

As public records of a friction damper with backlash show it (docs/public-records.md): 40 to 120 Hz that die
out after each blow, never twice alike, and a chatter of some 300 Hz, a third of the sample rate.
"""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.finding import Finding
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind

RATE_Hz, FREQUENCY_Hz, FRICTION_kN, CYCLES = 1000.0, 0.5, 20.0, 7
JUMPS = ("gain-jump", "offset-jump")


def damper(seed: int) -> tuple[Floats, Floats, Floats]:
    """Return time, stroke and force: dry friction behind 8 mm of play, with blows."""
    random = np.random.default_rng(seed)
    time_s = np.arange(0.0, CYCLES / FREQUENCY_Hz, 1.0 / RATE_Hz)
    angle = 2.0 * np.pi * FREQUENCY_Hz * time_s
    stroke_mm = 30.0 - 20.0 * np.cos(angle)
    force_kN = np.zeros_like(time_s)
    for half in range(2 * CYCLES):
        turn_s, way = half / (2.0 * FREQUENCY_Hz), 1.0 - 2.0 * (half % 2)
        closed_s = turn_s + np.arccos(1.0 - 8.0 / 20.0) / (2.0 * np.pi * FREQUENCY_Hz)
        since_s = time_s - closed_s
        own = (since_s > 0.0) & (time_s < turn_s + 0.5 / FREQUENCY_Hz)
        rings_Hz, blow = random.uniform(40.0, 120.0), random.choice((0.2, 0.3, 1.6))
        wave = np.exp(-since_s[own] / 0.12) * np.cos(2.0 * np.pi * rings_Hz * since_s[own])
        force_kN[own] = way * FRICTION_kN * (1.0 - np.exp(-since_s[own] / 0.004)) * (1.0 - blow * wave)
    beat = 0.5 + 0.5 * np.sin(2.0 * np.pi * 3.3 * time_s)
    force_kN += 1.6 * beat * np.sin(2.0 * np.pi * 305.0 * time_s + 0.7 * np.sin(9.0 * time_s))
    return time_s, stroke_mm, force_kN + random.normal(0.0, 0.02, time_s.size)


def findings(columns: tuple[Floats, Floats, Floats]) -> list[Finding]:
    run = harmonic(lambda *_: columns)
    assert len([result for result in run.cycles if result.cycle.complete]) >= CYCLES - 1
    return [finding for kind in ("spike", "gain-jump", "offset-jump") for finding in of_kind(run, kind)]


@pytest.mark.parametrize("seed", range(6))
def test_it_is_neither_spikes_nor_jumps(seed: int) -> None:
    assert findings(damper(seed)) == []


@pytest.mark.parametrize("seed", range(3))
def test_a_spike_in_it_is_found(seed: int) -> None:
    time_s, stroke_mm, force_kN = damper(seed)
    row = 4700  # it slides, and the blow has died out
    force_kN[row] += 12.0
    (finding,) = findings((time_s, stroke_mm, force_kN))
    assert (finding.kind, finding.start_s) == ("spike", time_s[row])


@pytest.mark.parametrize("seed", range(3))
def test_a_jump_in_it_is_found(seed: int) -> None:
    time_s, stroke_mm, force_kN = damper(seed)
    force_kN[6700:] += 40.0
    (finding,) = findings((time_s, stroke_mm, force_kN))
    assert finding.kind in ("gain-jump", "offset-jump")
    assert finding.start_s <= 6.7 < finding.end_s  # by the cycles before and after: blows hide the instant
