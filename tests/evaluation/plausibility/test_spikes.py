"""Spikes: single samples or pairs that both neighbours deny, and no tips, jumps or noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.plausibility.run_view.lone_samples import least_apart, lone_rows
from tests.evaluation.plausibility.records import Change, Floats, harmonic, of_kind, static


def spiked(column: int, rows: list[int], share: float) -> Change:
    def change(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = (c.copy() for c in columns)
        values = (time_s, stroke, force)[column]
        values[rows] += share * np.ptp(values)
        return time_s, stroke, force

    return change


@pytest.mark.parametrize("share", [0.02, -0.1, 0.6])
@pytest.mark.parametrize("column", [1, 2])
def test_single_samples(column: int, share: float) -> None:
    (finding,) = of_kind(harmonic(spiked(column, [1300], share)), "spike")
    assert finding.channel == ("stroke" if column == 1 else "force")
    assert finding.start_s == finding.end_s == 1300 / 500.0
    assert finding.cycles
    assert finding.effect == "noted"


def test_two_in_a_row() -> None:
    (finding,) = of_kind(harmonic(spiked(2, [1300, 1301], 0.2)), "spike")
    assert finding.start_s == 2.6
    assert finding.end_s == 2.602


@pytest.mark.parametrize("column", [1, 2])
@pytest.mark.parametrize("shares", [(0.5, -0.5), (-0.3, 0.2), (0.05, -0.1)])
def test_two_in_a_row_on_either_side(column: int, shares: tuple[float, float]) -> None:
    """Each denies the other, too: the larger step is that between them."""

    def change(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = (c.copy() for c in columns)
        values = (time_s, stroke, force)[column]
        values[1300:1302] = values[1299] + np.array(shares) * np.ptp(values)
        return time_s, stroke, force

    run = harmonic(change)
    (finding,) = of_kind(run, "spike")
    assert (finding.start_s, finding.end_s) == (2.6, 2.602)
    assert not any(of_kind(run, kind) for kind in ("stroke-jump", "offset-jump", "gain-jump"))


@pytest.mark.parametrize(
    "row", [50, 1500, *(pytest.param(row, marks=pytest.mark.long) for row in (700, 2200, 3000))]
)
@pytest.mark.parametrize(("column", "share"), [(1, 0.3), (1, -0.5), (2, 0.5), (2, -0.1)])
def test_a_spike_is_left_out_as_if_it_were_lost(column: int, share: float, row: int) -> None:
    """Cycles, verdicts and figures are those of the record without it, within U; its size matters nothing."""
    good, run = static(), static(spiked(column, [row], share))
    assert len(of_kind(run, "spike")) == 1
    assert len(run.cycles) == len(good.cycles)
    assert run.verdict == good.verdict == "pass"
    for one, other in zip(run.cycles, good.cycles, strict=True):
        for name in ("stored_energy_J", "absorbed_energy_J", "stroke_max_mm", "force_max_kN"):
            U = one.expanded_uncertainty[name]
            assert U is not None
            assert abs(getattr(one.quantities, name) - getattr(other.quantities, name)) < 0.3 * U
    assert any("spike" in text and "left out" in text for text in run.warnings)


def test_the_extremes_are_those_of_all_samples_with_a_doubt() -> None:
    extreme = static(spiked(2, [2200], 0.5)).extremes["force_max_kN"]
    assert extreme.time_s == 22.0
    assert extreme.doubt


def test_too_many_of_them_spoil_the_cycles() -> None:
    run = harmonic(spiked(2, list(range(200, 3000, 40)), 0.3))
    assert {finding.effect for finding in of_kind(run, "spike")} == {"spoils"}
    assert run.unfit


@pytest.mark.parametrize("kind", [static, harmonic])
def test_clean_records_have_none(kind: object) -> None:
    assert not kind().findings  # type: ignore[operator]


def test_a_stop_that_is_met_at_each_turn_is_none() -> None:
    def stop(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        every = slice(None, None, 25)
        return time_s[every], stroke[every], (force + 150.0 * np.maximum(stroke - 69.8, 0.0))[every]

    assert not of_kind(harmonic(stop, noise=0.0), "spike")


SHAPES = {
    "triangle": lambda t: np.abs(t % 2.0 - 1.0),
    "square": lambda t: np.sign(np.sin(np.pi * t)),
    "saw": lambda t: t % 1.0,
    "sine": lambda t: np.sin(np.pi * t),
}


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(SHAPES)),
    st.integers(14, 400),
    st.floats(0.0, 1.0),
    st.floats(0.0, 0.01),
    st.integers(0, 99),
)
def test_no_shape_of_a_loop_is_a_spike(
    shape: str, samples: int, phase: float, noise: float, seed: int
) -> None:
    time = np.arange(6 * samples) * 2.0 / samples + phase
    value = SHAPES[shape](time) + noise * np.random.default_rng(seed).standard_normal(time.size)
    least = least_apart("force", noise, 0.0, 2.0) * 1.0
    assert not lone_rows(time, value, least, [slice(0, value.size)]).size


@settings(max_examples=60, deadline=None)
@given(st.integers(60, 400), st.floats(0.2, 2.0), st.booleans(), st.integers(5, 300))
def test_a_lone_sample_of_a_sine_is_found(samples: int, size: float, up: bool, at: int) -> None:
    time = np.arange(6 * samples) * 2.0 / samples
    value = np.sin(np.pi * time)
    value[at] += size if up else -size
    found = lone_rows(time, value, least_apart("force", 0.0, 0.0, 2.0), [slice(0, value.size)])
    assert found.tolist() == [at]


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_a_step_that_swings_over_is_none(noise: float) -> None:
    """A damper's friction turns within a sample or two as the motion does, and swings about the new level."""
    value = np.concatenate((np.linspace(7.0, 11.4, 30), [-3.8, -0.75], np.full(30, -0.82)))
    value = value + noise * np.random.default_rng(3).standard_normal(value.size)
    time = 0.04 * np.arange(value.size)
    assert not lone_rows(time, value, least_apart("force", noise, 0.0, 20.0), [slice(0, value.size)]).size


def test_a_lone_sample_beside_a_step_is_found() -> None:
    value = np.concatenate((np.linspace(7.0, 11.4, 30), np.full(30, -0.82)))
    value[31] -= 15.0
    time = 0.04 * np.arange(value.size)
    assert lone_rows(time, value, 0.2, [slice(0, value.size)]).tolist() == [31]


def test_tips_of_a_force_that_sticks_and_slips_are_none() -> None:
    """Waves that come and go, with others of 4 samples: as public records of a friction damper."""
    time = np.arange(4000) / 1024.0
    waves = 1.6 * np.sin(2.0 * np.pi * 41.0 * time) + 0.2 * np.sin(2.0 * np.pi * 251.0 * time)
    waves *= 1.0 + 0.8 * np.sin(2.0 * np.pi * 3.0 * time)
    for seed in range(5):
        value = waves + 0.02 * np.random.default_rng(seed).standard_normal(time.size)
        assert not lone_rows(time, value, 0.11, [slice(0, time.size)]).size


def test_the_last_sample_before_a_rest_in_a_log_by_event_is_none() -> None:
    time = np.concatenate((0.04 * np.arange(30), 5.0 + 0.04 * np.arange(30)))
    value = np.concatenate((np.linspace(36.0, 22.5, 29), [0.3], np.linspace(25.0, 60.0, 30)))
    assert not lone_rows(time, value, 1.0, [slice(0, value.size)]).size
    assert lone_rows(0.04 * np.arange(60), value, 1.0, [slice(0, value.size)]).tolist() == [29]
