"""What must not change the result, and what must change it in proportion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.evaluation.cycles.find import find_cycles
from bufferstand.evaluation.facts.results import Quantities
from bufferstand.evaluation.quantities.evaluate import evaluate_cycle
from bufferstand.evaluation.record.record import make_record
from bufferstand.foundation.units import to_inside
from tests.evaluation.signals import Ellipse, Floats

BASE = Ellipse().columns(1.0, 400.0, 3.4, noise=2e-4)


def figures(time: Floats, stroke: Floats, force: Floats) -> list[Quantities]:
    record = make_record(time, stroke, force)
    return [evaluate_cycle(record, c).quantities for c in find_cycles(record) if c.steady]


REFERENCE = figures(*BASE)
ENERGIES = ("stored_energy_J", "absorbed_energy_J")


def agree(found: list[Quantities], expected: list[Quantities], rel: float = 1e-9, **factors: float) -> None:
    assert len(found) == len(expected) > 0
    for one, two in zip(found, expected, strict=True):
        for name in ("stored_energy_J", "absorbed_energy_J", "damping", "loss_factor", "amplitude_mm"):
            assert getattr(one, name) == pytest.approx(getattr(two, name) * factors.get(name, 1.0), rel=rel)


@given(shift=st.floats(-1e4, 1e4))
@settings(max_examples=8)
def test_time_shift(shift: float) -> None:
    time, stroke, force = BASE
    agree(figures(time + shift, stroke, force), REFERENCE, rel=1e-5)


@given(factor=st.floats(0.01, 50.0))
@settings(max_examples=8)
def test_energies_scale_with_force(factor: float) -> None:
    time, stroke, force = BASE
    agree(figures(time, stroke, factor * force), REFERENCE, **dict.fromkeys(ENERGIES, factor))


@given(factor=st.floats(0.05, 20.0))
@settings(max_examples=8)
def test_energies_scale_with_stroke(factor: float) -> None:
    time, stroke, force = BASE
    scaled = figures(time, factor * stroke, force)
    agree(scaled, REFERENCE, rel=1e-6, **dict.fromkeys((*ENERGIES, "amplitude_mm"), factor))


@given(factor=st.floats(0.05, 20.0))
@settings(max_examples=8)
def test_energies_do_not_know_time(factor: float) -> None:
    time, stroke, force = BASE
    agree(figures(factor * time, stroke, force), REFERENCE, rel=1e-6)


@pytest.mark.parametrize(("unit_x", "unit_f"), [("in", "kip"), ("m", "N"), ("mm", "lbf")])
def test_units(unit_x: str, unit_f: str) -> None:
    time, stroke, force = BASE
    foreign_x = stroke / to_inside(1.0, "stroke", unit_x)
    foreign_f = force / to_inside(1.0, "force", unit_f)
    back = figures(time, to_inside(foreign_x, "stroke", unit_x), to_inside(foreign_f, "force", unit_f))
    agree(back, REFERENCE)


@pytest.mark.parametrize("rate", [150.0, 999.0, 4000.0])
def test_resampling(rate: float) -> None:
    """The same motion sampled otherwise gives the same figures."""
    clean = figures(*Ellipse().columns(1.0, 400.0, 3.4))
    agree(figures(*Ellipse().columns(1.0, rate, 3.4)), clean, rel=3e-4)


@given(st.floats(0.0, 6.28))
@settings(max_examples=15)
def test_start_phase(phase: float) -> None:
    ellipse = Ellipse()
    for q in figures(*ellipse.columns(1.0, 400.0, 3.4, phase=phase)):
        assert q.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=5e-4)
        assert q.stored_energy_J == pytest.approx(ellipse.stored, rel=5e-4)


@given(st.floats(-50.0, 50.0))
@settings(max_examples=5)
def test_force_offset_moves_stored_energy_only(offset: float) -> None:
    time, stroke, force = BASE
    for moved, base in zip(figures(time, stroke, force + offset), REFERENCE, strict=True):
        assert moved.absorbed_energy_J == pytest.approx(base.absorbed_energy_J, rel=1e-6)
        assert base.amplitude_mm is not None
        assert base.stored_energy_J is not None
        gained = 2.0 * base.amplitude_mm * offset
        assert moved.stored_energy_J == pytest.approx(base.stored_energy_J + gained, rel=1e-6)


def test_backward_in_time_the_loop_turns_round() -> None:
    """Run backwards, loading becomes unloading: the loop area changes its sign."""
    time, stroke, force = Ellipse().columns(1.0, 400.0, 3.4)
    reverse = figures(time, stroke[::-1], force[::-1])
    for q in reverse:
        assert q.absorbed_energy_J == pytest.approx(-Ellipse().absorbed, rel=5e-4)
    np.testing.assert_allclose([q.loss_stiffness_kN_per_mm for q in reverse], -0.6, rtol=1e-3)


def joined(gap_s: float) -> tuple[Floats, Floats, Floats]:
    """Two records one after the other; without a gap they meet where the next sample would be."""
    time, stroke, force = BASE
    later = time + time[-1] + gap_s + (time[1] - time[0])
    return np.concatenate((time, later)), np.tile(stroke, 2), np.tile(force, 2)


@given(gap_s=st.floats(2.0, 1e4))
@settings(max_examples=6)
def test_joining_two_records(gap_s: float) -> None:
    """The cycles of both are found with the same figures, and none across the place where they meet."""
    twice = figures(*joined(gap_s))
    agree(twice, REFERENCE * 2, rel=2e-4)


def test_joining_where_they_fit_is_one_record() -> None:
    whole = figures(*Ellipse().columns(1.0, 400.0, 8.4))
    time, stroke, force = Ellipse().columns(1.0, 400.0, 8.4)
    at = 1300
    pieces = [figures(time[part], stroke[part], force[part]) for part in (slice(None, at), slice(at, None))]
    for q in [*pieces[0], *pieces[1]]:
        agree([q], whole[:1], rel=1e-5)
    assert len(pieces[0]) + len(pieces[1]) == len(whole) - 1


@given(factor=st.floats(0.1, 10.0), stretch=st.floats(0.1, 10.0))
@settings(max_examples=8)
def test_stiffnesses_scale(factor: float, stretch: float) -> None:
    """Stiffness goes as force over stroke, energy as force times stroke, damping not at all."""
    time, stroke, force = BASE
    for one, two in zip(figures(time, stretch * stroke, factor * force), REFERENCE, strict=True):
        for name in ("tangent", "secant", "dynamic", "storage", "loss"):
            key = f"{name}_stiffness_kN_per_mm"
            assert getattr(one, key) == pytest.approx(getattr(two, key) * factor / stretch, rel=1e-5)
        assert one.damping == pytest.approx(two.damping, rel=1e-5)
        assert one.stored_energy_J == pytest.approx((two.stored_energy_J or 0.0) * factor * stretch, rel=1e-5)


@given(factor=st.floats(0.1, 10.0))
@settings(max_examples=6)
def test_a_force_that_counts_the_other_way_turns_every_energy_round(factor: float) -> None:
    """The sign of the loop area is kept, and no damping comes of a negative energy."""
    time, stroke, force = BASE
    for one, two in zip(figures(time, stroke, -factor * force), REFERENCE, strict=True):
        for name in ENERGIES:
            assert getattr(one, name) == pytest.approx(-factor * getattr(two, name), rel=1e-9)
        assert one.damping is None
        for name in ("tangent", "secant", "storage", "loss"):
            key = f"{name}_stiffness_kN_per_mm"
            assert getattr(one, key) == pytest.approx(-factor * getattr(two, key), rel=1e-6)


def test_both_signs_turned_give_the_same_area() -> None:
    """Stroke and force both counted the other way: loading begins at the other turn, the area is the same."""
    ellipse = Ellipse()
    time, stroke, force = ellipse.columns(1.0, 400.0, 4.4)
    turned = figures(time, -stroke, -force)
    assert len(turned) >= 3
    for q in turned:
        assert q.absorbed_energy_J == pytest.approx(ellipse.absorbed, rel=5e-4)
        assert q.loss_factor == pytest.approx(figures(time, stroke, force)[0].loss_factor, rel=1e-3)
