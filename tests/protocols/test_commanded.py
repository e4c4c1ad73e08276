"""Piston and specimen with the machine between them: closed forms, and what must hold for any stiffness."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.model.file import load_model
from bufferstand.protocols.prediction.machine_stroke import (
    Sine,
    piston_mm,
    piston_sine,
    stroke_behind,
    stroke_sine,
    strokes_behind,
)
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.protocols.prediction.sine_start import first_cycle

MODEL = Path(__file__).parents[2] / "sample_runs/models/category-a-elastomer.toml"


@cache
def predictor() -> ModelPredictor:
    return ModelPredictor(load_model(MODEL))


@given(stiffness=st.floats(1.0, 1e6), position=st.floats(0.1, 100.0), spring=st.floats(0.1, 50.0))
def test_two_linear_springs_in_series(stiffness: float, position: float, spring: float) -> None:
    """x = y k / (k + c): the closed form."""
    stroke = stroke_behind(position, lambda mm: spring * mm, 1.0 / stiffness)
    assert stroke == pytest.approx(position * stiffness / (stiffness + spring), rel=1e-6, abs=2e-6)
    sine = stroke_sine(
        Sine(position, position / 2.0),
        lambda at: (spring * at.lower_mm, spring * at.upper_mm),
        1.0 / stiffness,
    )
    share = stiffness / (stiffness + spring)
    assert (sine.mean_mm, sine.amplitude_mm) == pytest.approx(
        (position * share, position / 2.0 * share), rel=1e-4, abs=2e-3
    )


@pytest.mark.parametrize(("mean_mm", "amplitude_mm"), [(104.0, 10.0), (104.0, 30.0), (200.0, 40.0)])
@pytest.mark.parametrize("stiffness", [0.5, 5.0, 60.0])
def test_a_machine_that_takes_all_of_a_sine_leaves_one_all_the_same(
    mean_mm: float, amplitude_mm: float, stiffness: float
) -> None:
    """Asked far beyond what it can be: a plan refuses that, and must be able to reckon with it before."""
    found = predictor().harmonic(mean_mm, amplitude_mm, 0.1, 21.0, 1.0 / stiffness)
    assert found.stroke.amplitude_mm > 0.0
    assert found.stroke.lower_mm >= 0.0


def test_a_preload_holds_against_the_machine() -> None:
    """15 kN of preload on 150 kN/mm: the piston goes 0.1 mm before the specimen gives way."""

    def force(stroke_mm: float) -> float:
        return 15.0 + 2.0 * stroke_mm

    assert stroke_behind(0.09, force, 1.0 / 150.0) == 0.0
    assert stroke_behind(1.1, force, 1.0 / 150.0) == pytest.approx(1.0 * 150.0 / 152.0, abs=1e-5)
    position = np.array([0.05, 0.09, 1.1])
    stroke, _ = strokes_behind(position, lambda mm: 15.0 + 2.0 * mm, 1.0 / 150.0)
    assert stroke == pytest.approx([0.0, 0.0, 1.0 * 150.0 / 152.0], abs=2e-3)


@settings(max_examples=25, deadline=None)
@given(
    stiffness=st.floats(5.0, 1e5),
    mean=st.floats(10.0, 85.0),
    share=st.floats(0.05, 0.95),
    warm=st.floats(10.0, 40.0),
)
def test_piston_and_specimen_lead_to_each_other(
    stiffness: float, mean: float, share: float, warm: float
) -> None:
    """What the piston's sine makes of the specimen, commanded back, is the piston's sine."""
    give, asked = 1.0 / stiffness, Sine(mean, share * min(mean, 95.0 - mean))
    cycle = predictor().harmonic(asked.mean_mm, asked.amplitude_mm, 0.5, warm, give)
    back = piston_sine(cycle.stroke, cycle.lower_force_kN, cycle.peak_force_kN, give)
    if cycle.stroke.lower_mm > 0.0 and cycle.stroke.amplitude_mm > 0.01:
        assert (back.mean_mm, back.amplitude_mm) == pytest.approx(
            (asked.mean_mm, asked.amplitude_mm), abs=2e-3
        )
    assert cycle.stroke.upper_mm <= asked.upper_mm


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    stiffnesses=st.tuples(st.floats(10.0, 1e4), st.floats(1.2, 20.0)),
    mean=st.floats(10.0, 80.0),
    share=st.floats(0.1, 0.9),
)
def test_a_stiffer_machine_leaves_more_to_the_specimen(
    stiffnesses: tuple[float, float], mean: float, share: float
) -> None:
    softer, stiffer = stiffnesses[0], stiffnesses[0] * stiffnesses[1]
    amplitude = share * min(mean, 95.0 - mean)

    def all_of(give: float) -> tuple[float, float, float]:
        cycle = predictor().harmonic(mean, amplitude, 0.5, 21.0, give)
        way = first_cycle(
            predictor(), Sine(mean, amplitude), 0.5, 20.0, 21.0, give_mm_per_kN=give, compensated=False
        )
        return cycle.stroke.upper_mm, cycle.peak_force_kN, way.peak_force_kN

    soft, stiff, rigid = all_of(1.0 / softer), all_of(1.0 / stiffer), all_of(0.0)
    for less, more, most in zip(soft, stiff, rigid, strict=True):
        assert less <= more + 0.05
        assert more <= most + 0.05


def test_an_infinitely_stiff_machine_is_a_rigid_one() -> None:
    rigid = predictor().harmonic(80.0, 15.0, 0.85, 21.0)
    stiff = predictor().harmonic(80.0, 15.0, 0.85, 21.0, 1e-12)
    assert stiff.peak_force_kN == pytest.approx(rigid.peak_force_kN, rel=1e-8)
    assert stiff.absorbed_energy_J == pytest.approx(rigid.absorbed_energy_J, rel=1e-8)
    assert predictor().static(600.0, 90.0, 5.0, 21.0, 1e-12).end_stroke_mm == pytest.approx(90.0, abs=1e-6)


def test_the_paper_s_piston_gives_the_paper_s_buffer() -> None:
    """Required 50 mm were 48.5 mm, 80 mm were 78 mm (paper §§ 3.2, 4.2)."""
    for required, actual, amplitude in ((50.0, 48.5, 30.0), (80.0, 78.0, 15.0)):
        stroke = predictor().harmonic(required, amplitude, 0.85, 21.0, 1.0 / 150.0).stroke
        assert stroke.mean_mm == pytest.approx(actual, abs=0.3)


def test_a_static_stroke_limit_of_the_piston_is_more_than_the_specimen_s() -> None:
    give = 1.0 / 150.0
    cycle = predictor().static(600.0, 80.0, 5.0, 21.0, give)
    assert piston_mm(cycle.end_stroke_mm, cycle.peak_force_kN, give) == pytest.approx(80.0, abs=1e-4)
    by_force = predictor().static(300.0, 105.0, 5.0, 21.0, give)
    assert by_force == predictor().static(300.0, 105.0, 5.0, 21.0)
