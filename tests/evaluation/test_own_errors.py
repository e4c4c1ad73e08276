"""Hum and a drifting zero as errors of a run: against records that are made with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from pydantic import ValidationError

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.numerics.hum import HumLine
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.uncertainty.error_model import draw_errors
from bufferstand.evaluation.uncertainty.hum_and_drift import OwnErrors, own_errors
from bufferstand.evaluation.uncertainty.monte_carlo import CyclePropagation
from bufferstand.evaluation.uncertainty.noise import Noise
from bufferstand.evaluation.uncertainty.other_draws import cycle_draws
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from tests.evaluation.closed_loops import Progressive, measured
from tests.evaluation.disturbed import SURE_FORCE, SURE_WIRES
from tests.evaluation.signals import Floats

LOOP = Progressive()
RATE_HZ = 203.0
NOTHING = ChannelUncertainty(accuracy_percent=0.0, linearity=0.0)
ENERGIES = ("stored_energy_J", "absorbed_energy_J", "damping")
STIFFNESSES = ("tangent_stiffness_kN_per_mm", "storage_stiffness_kN_per_mm", "loss_stiffness_kN_per_mm")


def columns(cycles: float = 4.3, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    random = np.random.default_rng(seed)
    chain = {"rate_Hz": RATE_HZ, "force": SURE_FORCE, "wires": SURE_WIRES, "noise": (0.0, 0.0)}
    return measured(LOOP, random, cycles=cycles, **chain)  # type: ignore[arg-type]


class _Silent(OwnErrors):
    """As many errors that do nothing."""

    def rows(self, time_s: Floats) -> Floats:
        return 0.0 * super().rows(time_s)


def _silent(own: OwnErrors) -> OwnErrors:
    return _Silent(own.lines, own.drift_kN, own.start_s, own.end_s, own.sample_s)


def scatter(own: OwnErrors, record: Record, number: int) -> dict[str, float]:
    """Return the standard deviation that these errors alone make of a cycle's figures."""
    cycle = [c for c in find_cycles(record) if c.complete][number]

    def drawn_with(acting: OwnErrors) -> Mapping[str, Floats]:
        draws = draw_errors(NOTHING, (NOTHING,), 4000, 3, None, own)
        assert draws is not None
        return cycle_draws(draws, CyclePropagation(record, cycle, Noise(0.0, 0.0), None, acting))

    drawn, rest = drawn_with(own), drawn_with(_silent(own))
    names = (*ENERGIES, *STIFFNESSES)  # turning points have an error of their own, the same in both
    return {name: float(np.std(drawn[name] - rest[name])) for name in names}


def figures(record: Record, number: int) -> dict[str, float]:
    cycle = [c for c in find_cycles(record) if c.complete][number]
    values = evaluate_cycle(record, cycle).quantities._asdict()
    return {name: values[name] for name in (*ENERGIES, *STIFFNESSES)}


@pytest.mark.parametrize("number", [0, 2])
def test_a_drift_makes_of_a_cycle_what_is_drawn(number: int) -> None:
    """0.8 kN over the record, evaluated with it and without, against a rectangular error of that limit."""
    time, stroke, force = columns()
    plain = make_record(time, stroke, force)
    own = own_errors((), 0.8, time)
    ramp = 0.8 * (time - time[0]) / np.ptp(time)
    with_it, without = figures(make_record(time, stroke, force + ramp), number), figures(plain, number)
    for name, u in scatter(own, plain, number).items():
        # Of the stiffnesses a ramp moves little but K″; what is below 1e-5 of a value is no error.
        change = abs(with_it[name] - without[name])
        assert u == pytest.approx(change / np.sqrt(3.0), rel=0.05, abs=1e-5 * abs(without[name])), name


@pytest.mark.slow
@pytest.mark.parametrize("frequency_Hz", [3.1, 17.0, 50.0])
def test_hum_makes_of_a_cycle_what_is_drawn(frequency_Hz: float) -> None:
    """Waves of 24 phases laid on the force: the root mean square of what they change is the drawn u."""
    time, stroke, force = columns()
    plain = make_record(time, stroke, force)
    without = figures(plain, 1)
    changes: dict[str, list[float]] = {name: [] for name in without}
    for phase in np.arange(24) / 24.0:
        wave = 0.3 * np.cos(2.0 * np.pi * (frequency_Hz * time + phase))
        for name, value in figures(make_record(time, stroke, force + wave), 1).items():
            changes[name].append(value - without[name])
    drawn = scatter(own_errors((HumLine(frequency_Hz, 0.3),), 0.0, time), plain, 1)
    for name in (*ENERGIES, STIFFNESSES[0]):
        found = float(np.sqrt(np.mean(np.square(changes[name]))))
        # Hum that is faster than the loop moves its area by how the ends are read, by less than 1e-5.
        assert drawn[name] == pytest.approx(found, rel=0.15, abs=1e-5 * abs(without[name])), name


def test_means_of_samples_have_less_of_a_wave() -> None:
    """A wave of 50 Hz at 1 kHz, on points that are means of 12 samples."""
    time = np.arange(1200) / 1000.0
    wave = np.cos(2.0 * np.pi * 50.0 * time)
    own = own_errors((HumLine(50.0, 1.0),), 0.0, time)
    means = time.reshape(-1, 12).mean(axis=1)
    assert own.rows(means)[0] == pytest.approx(wave.reshape(-1, 12).mean(axis=1), abs=1e-3)


def evaluated(drift_kN: float | None, cycles: float = 4.3) -> RunEvaluation:
    force = ChannelUncertainty(accuracy_percent=0.01, zero=0.01, u_delay_s=1e-6, drift=drift_kN)
    facts = RunFacts("d", "harmonic", force_uncertainty=force, stroke_uncertainty=SURE_WIRES)
    return evaluate_run(make_record(*columns(cycles)), facts, Options(draws=500))


def test_a_stated_drift_is_in_the_budget_and_in_u() -> None:
    """Of W_a one cycle has its share: half the stroke range times what the zero drifts within the cycle."""
    run = evaluated(0.8)
    (line,) = [
        line
        for budget in run.budget
        if budget.quantity == "absorbed_energy_J"
        for line in budget.lines
        if line.source == "force: drift of the zero"
    ]
    expected = 0.5 * 70.0 * 0.8 / 4.3 / np.sqrt(3.0)
    assert (line.limit, line.unit, line.distribution) == (0.8, "kN", "rectangular")
    assert line.contribution == pytest.approx(expected, rel=0.02)
    measured_figure = run.summary.values["absorbed_energy_J"]
    assert measured_figure.expanded_uncertainty == pytest.approx(2.0 * expected, rel=0.1)
    most = run.extremes["force_max_kN"].expanded_uncertainty
    assert most == pytest.approx(2.0 * 0.8 / np.sqrt(3.0), rel=0.1)
    assert not any("drift" in error for error in (run.shared_errors.errors if run.shared_errors else ()))


def test_without_a_stated_drift_there_is_none() -> None:
    assert not any(line.source.endswith("of the zero") for b in evaluated(None).budget for line in b.lines)


def test_a_drift_is_stated_of_a_force_only() -> None:
    stated = ChannelUncertainty(drift=0.2)
    assert Channel(name="force", quantity="force", unit="kN", uncertainty=stated).uncertainty.drift == 0.2
    with pytest.raises(ValidationError, match="drift is for force channels"):
        Channel(name="stroke", quantity="stroke", unit="mm", uncertainty=stated)
    assert "drift" not in ChannelUncertainty(zero=0.1).model_dump()
