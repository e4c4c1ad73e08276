"""A stand that stands while it reverses: the dwell belongs to the cycle, and is no rest of the specimen."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.settings import simulation_settings
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.clean_stand import IMPERFECTIONS, SAMPLE_STAND
from tests.drivers.simulated.standing import FrictionSpring, device, stand_file
from tests.evaluation.signals import Floats, StaticTest

PRELOAD_KN, STIFF_KN_PER_MM, DAMPING_KN_PER_MM, MEAN_MM = 40.0, 5.0, 3.0, 50.0
FORCE_FACTS = ChannelUncertainty(accuracy_percent=0.1, reversibility_percent=0.0, zero=0.05, u_delay_s=0.0)
STROKE_FACTS = (ChannelUncertainty(accuracy_percent=0.01, linearity=0.01, zero=0.02, u_delay_s=0.0),)
RATE_HZ = 1000.0
FLICKER_COVERAGE = 2.0
"""U knows white noise and hum; that of as much flicker is larger by so much at most."""


def flicker(random: np.random.Generator, samples: int) -> Floats:
    """Return noise of which the density falls as 1 / f, of unit deviation."""
    spectrum = np.fft.rfft(random.standard_normal(samples))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    spectrum[0] = 0.0
    found = np.fft.irfft(spectrum, samples)
    return np.asarray(found / np.std(found))


def dwelling_sine(
    moving_Hz: float,
    dwell_s: float,
    noise: str,
    *,
    amplitude_mm: float = 10.0,
    cycles: float = 8.4,
    begins: float = 0.3,
) -> tuple[Record, dict[str, float]]:
    """Return half sines that alternate with dwells, and the truth of each cycle.

    Along F = F_0 + k x + c A sin(phase) the area is π c A², whatever the motion's pace. ``begins``: share of
    the period at which the record begins, from leaving the lower turn.
    """
    half_s = 0.5 / moving_Hz
    period_s = 2.0 * (half_s + dwell_s)
    time = np.arange(int(cycles * period_s * RATE_HZ)) / RATE_HZ
    since = np.mod(time + begins * period_s, period_s)
    knots = np.cumsum([0.0, half_s, dwell_s, half_s, dwell_s])
    phase = np.interp(since, knots, np.pi * np.array([0.0, 1.0, 1.0, 2.0, 2.0]))
    stroke = MEAN_MM - amplitude_mm * np.cos(phase)
    force = PRELOAD_KN + STIFF_KN_PER_MM * stroke + DAMPING_KN_PER_MM * amplitude_mm * np.sin(phase)
    random = np.random.default_rng(5)
    hum = np.sin(2.0 * np.pi * 50.0 * time + 1.0)
    white, pink = random.standard_normal(time.size), flicker(random, time.size)
    disturbed = {"white": 0.01 * white, "flicker": 0.01 * pink, "hum": 0.005 * (white + pink) + 0.003 * hum}
    stroke = np.round((stroke + disturbed[noise]) / 0.0076) * 0.0076
    force = force + 0.1 * random.standard_normal(time.size) + 0.05 * hum * (noise == "hum")
    absorbed_J = np.pi * DAMPING_KN_PER_MM * amplitude_mm**2
    mean_kN = PRELOAD_KN + STIFF_KN_PER_MM * MEAN_MM
    truth = {
        "frequency_Hz": 1.0 / period_s,
        "stroke_min_mm": MEAN_MM - amplitude_mm,
        "stroke_max_mm": MEAN_MM + amplitude_mm,
        "absorbed_energy_J": absorbed_J,
        "stored_energy_J": 2.0 * amplitude_mm * mean_kN + 0.5 * absorbed_J,
    }
    return make_record(time, stroke, force), truth


def evaluated(record: Record) -> RunEvaluation:
    facts = RunFacts("i", "harmonic", force_uncertainty=FORCE_FACTS, stroke_uncertainty=STROKE_FACTS)
    return evaluate_run(record, facts, Options(draws=200, seed=1))


@pytest.mark.parametrize(
    "dwell_s", [0.02, 0.1, *(pytest.param(dwell_s, marks=pytest.mark.long) for dwell_s in (0.005, 0.05))]
)
@pytest.mark.parametrize("moving_Hz", [0.3, pytest.param(1.0, marks=pytest.mark.long), 2.5])
@pytest.mark.parametrize("noise", ["white", "flicker", "hum"])
def test_a_dwell_at_the_turns_belongs_to_the_cycle(
    moving_Hz: float,
    dwell_s: float,
    noise: str,
) -> None:
    record, truth = dwelling_sine(moving_Hz, dwell_s, noise)
    run = evaluated(record)
    steady = [result for result in run.cycles if result.cycle.steady]
    assert len(steady) == 7
    for before, after in pairwise(result.cycle for result in steady):
        assert after.start_s == before.end_s
    allowed = FLICKER_COVERAGE if noise == "flicker" else 1.0
    for name, true in truth.items():
        error = np.array([getattr(result.quantities, name) - true for result in steady])
        expanded = np.array([result.expanded_uncertainty[name] for result in steady])
        # U holds 95 of 100: of seven cycles one may miss.
        assert np.sum(np.abs(error) > allowed * expanded) <= 1, (name, error / expanded)
        assert abs(float(np.mean(error))) <= 2e-3 * abs(true), name


@pytest.mark.parametrize("begins", [0.92, 0.95, 0.97, 0.0])
def test_a_record_that_begins_and_ends_within_a_dwell(begins: float) -> None:
    """What is missing of the dwell is in the U of the frequency, and nothing else suffers."""
    record, truth = dwelling_sine(2.5, 0.05, "white", begins=begins, cycles=6.0)
    results = [result for result in evaluated(record).cycles if result.cycle.complete]
    assert len(results) == 6
    for result in results:
        for name in ("frequency_Hz", "absorbed_energy_J", "stored_energy_J"):
            expanded = result.expanded_uncertainty[name]
            assert expanded is not None
            assert abs(getattr(result.quantities, name) - truth[name]) <= 1.5 * expanded, name
    inner = np.array([result.quantities.frequency_Hz for result in results[1:-1]], dtype=np.float64)
    np.testing.assert_allclose(inner, truth["frequency_Hz"], rtol=1e-3)


@pytest.mark.parametrize("pause_s", [0.5, 5.0])
def test_a_pause_between_strokes_stays_a_pause(pause_s: float) -> None:
    time, stroke, _ = StaticTest(top_mm=96.0, rate_Hz=500.0, pause_s=pause_s, noise_mm=0.01).columns()
    for before, after in pairwise(find_cycles(make_record(time, stroke, stroke))):
        assert after.start_s - before.end_s == pytest.approx(pause_s, abs=0.05)
        assert before.end.method == "plateau"


def test_a_pause_longer_than_the_strokes_beside_it_stays_one() -> None:
    """Strokes of 80 ms with pauses of 150 ms: an actuator that is struck, not one that reverses."""
    phase = np.arange(0.0, 10.0, 0.001 / 0.31)
    stroke = np.interp(
        np.mod(phase + 0.2, 1.0), np.array([0.0, 0.15, 0.23, 0.31]) / 0.31, [0.0, 0.0, 20.0, 0.0]
    )
    cycles = find_cycles(make_record(0.31 * phase, stroke, stroke))
    assert {cycle.start.method for cycle in cycles[1:-1]} == {"plateau"}


@pytest.mark.dose(4)
@pytest.mark.parametrize("reversal_s", [0.01, 0.02, 0.05])
@pytest.mark.parametrize(("frequency_Hz", "amplitude_mm"), [(0.5, 20.0), (1.273, 20.0), (2.546, 5.0)])
def test_the_simulated_stand_with_a_valve_that_takes_time(
    tmp_path: Path,
    frequency_Hz: float,
    amplitude_mm: float,
    reversal_s: float,
) -> None:
    record, truth = stand_record(tmp_path, frequency_Hz, amplitude_mm, reversal_s)
    run = evaluated(record)
    steady = [result for result in run.cycles if result.cycle.steady]
    assert len(steady) == 7  # eight of full amplitude have eight lower turns
    for result in steady:
        expanded_Hz = result.expanded_uncertainty["frequency_Hz"] or 0.0
        # Beside the ramps, a dwell that passes for smooth leaves the turn where it was fitted within it.
        beside = 0.25 * reversal_s * frequency_Hz if result in (steady[0], steady[-1]) else 0.0
        within = pytest.approx(frequency_Hz, rel=2e-3 + beside, abs=1.5 * expanded_Hz)
        assert result.quantities.frequency_Hz == within
        expanded_J = result.expanded_uncertainty["absorbed_energy_J"]
        assert expanded_J is not None
        inside = slice(*np.searchsorted(record.time_s, (result.cycle.start_s, result.cycle.end_s)).tolist())
        force, stroke = truth["force_kN"][inside], truth["stroke_mm"][inside]
        true_J = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke)))
        assert result.quantities.absorbed_energy_J == pytest.approx(true_J, abs=expanded_J + 5e-3 * true_J)
    mean = run.summary.values["frequency_Hz"]
    assert mean.value == pytest.approx(frequency_Hz, rel=2e-3)


def stand_record(
    folder: Path,
    frequency_Hz: float,
    amplitude_mm: float,
    reversal_s: float,
) -> tuple[Record, dict[str, Floats]]:
    """Return what the imperfect sample stand puts into its ring during eight cycles, and the truth."""
    sample = simulation_settings(load_stand(SAMPLE_STAND)).model_dump()
    imperfect = {key: value for key, value in sample.items() if key in IMPERFECTIONS} | {
        "reversal_s": reversal_s
    }
    stand = device(folder, FrictionSpring(), **imperfect)
    controller = stand.controller
    controller.control(0x000F)
    harmonic = Command(
        2, CommandCode.HARMONIC, mean_mm=50.0, amplitude_mm=amplitude_mm, frequency_Hz=frequency_Hz, cycles=8
    )
    for command in (Command(1, CommandCode.RAMP, target_mm=50.0, speed_mm_per_s=100.0), harmonic):
        controller.arm(command)
        controller.execute(command.sequence)
        while controller.done_sequence != command.sequence:
            stand.advance(100)
        stand.advance(500)
    truth = {name: np.asarray(column) for name, column in stand.truth.arrays().items()}  # type: ignore[union-attr]
    last = truth["time_us"].size
    first = max(0, last - stand.ring.capacity + 1)
    raw = stand.ring.window(first, last)[1]
    channels = {
        c.name: np.asarray(c.calibration.apply(raw[c.name])) for c in stand_file(folder).controller.channel
    }
    own = {name: column[first:] for name, column in truth.items()}
    time = (own["time_us"] - own["time_us"][0]) * 1e-6
    stroke = 0.5 * (channels["stroke_1"] + channels["stroke_2"])
    delay_s = next(c.delay_s for c in stand_file(folder).controller.channel if c.name == "force")
    force = np.interp(time + delay_s, time, channels["force"])
    return make_record(time, stroke, force), own
