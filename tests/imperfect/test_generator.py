"""The world itself: the same record for the same number, and a truth that closed forms confirm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from . import chain, motions, specimens, truth, world


def _plain_spring() -> specimens.Spring:
    spring = specimens.random_spring(np.random.default_rng(0))
    return replace(
        spring,
        preload_kN=20.0,
        linear_kN_per_mm=3.0,
        power_kN=100.0,
        power=3.0,
        stage_kN_per_mm=0.0,
        loss_0=0.0,
        loss_100=0.0,
        seating_mm=1e-3,
        rate_shares=(0.0, 0.0),
        softening=0.0,
        softening_per_K=0.0,
    )


def test_a_record_is_the_same_for_the_same_number() -> None:
    a, b = world.make(17), world.make(17)
    assert np.array_equal(a.force_read_kN, b.force_read_kN, equal_nan=True)
    assert [x.size for x in a.applied] == [x.size for x in b.applied]
    assert not np.array_equal(a.force_read_kN, world.make(18).force_read_kN, equal_nan=True)


def test_an_elastic_spring_stores_the_closed_form_and_absorbs_nothing() -> None:
    t = np.linspace(0.0, 40.0, 400_001)
    x = np.interp(t, [0.0, 20.0, 40.0], [0.0, 104.0, 0.0])
    cycle = truth.cycles(t, x, _plain_spring().force(t, x, np.full_like(t, 20.0)), t, static=True)[0]
    stored = 20.0 * 104.0 + 1.5 * 104.0**2 + 100.0 * 104.0**4 / (4.0 * 100.0**3)
    assert cycle.figures["stored_energy_J"][0] == pytest.approx(stored, rel=1e-5)
    assert cycle.figures["absorbed_energy_J"][0] == pytest.approx(0.0, abs=1e-6 * stored)
    assert cycle.figures["tangent_stiffness_kN_per_mm"][0] == pytest.approx(
        3.0 + 3.0 * 52.0**2 / 1e4, rel=1e-4
    )
    assert cycle.readings["force-at-60mm"] == pytest.approx((20.0 + 180.0 + 21.6,) * 2, rel=1e-5)


def test_a_constant_loss_absorbs_its_share() -> None:
    t = np.linspace(0.0, 40.0, 400_001)
    x = np.interp(t, [0.0, 20.0, 40.0], [0.0, 104.0, 0.0])
    lossy = replace(_plain_spring(), loss_0=0.5, loss_100=0.5, transition_mm=1e-3, transition_power=4.0)
    cycle = truth.cycles(t, x, lossy.force(t, x, np.full_like(t, 20.0)), t, static=True)[0]
    assert cycle.figures["damping"][0] == pytest.approx(0.5, rel=1e-3)


def test_a_stroke_that_ends_in_a_rest_not_released_is_whole() -> None:
    t = np.linspace(0.0, 50.0, 50_001)
    released = np.interp(t, [0.0, 20.0, 40.0], [0.0, 104.0, 3.3])
    warm = np.full_like(t, 20.0)
    for end_s, whole in ((50.0, True), (39.99, False)):
        on = t <= end_s
        force = _plain_spring().force(t[on], released[on], warm[on])
        found = truth.cycles(t[on], released[on], force, warm[on], static=True)
        assert [cycle.whole for cycle in found] == [whole]


def test_a_maxwell_branch_has_its_closed_form_also_across_a_rest() -> None:
    t = np.arange(0.0, 6.0, 1e-3)
    w, tau = 2.0 * np.pi, 0.2
    q = specimens.high_pass(np.sin(w * t), np.diff(t, prepend=0.0), tau)
    settled = t > 4.0
    wanted = w * tau / (1.0 + (w * tau) ** 2) * (np.cos(w * t) + w * tau * np.sin(w * t))
    assert np.max(np.abs(q - wanted)[settled]) < 1e-4
    late = np.where(t > 4.5, t + 100.0, t)
    across = specimens.high_pass(np.sin(w * np.minimum(t, 4.0)), np.diff(late, prepend=0.0), tau)
    assert abs(across[-1]) < 1e-6


def test_a_damper_has_a_linear_closed_form() -> None:
    t = np.linspace(0.0, 4.0, 40_001)
    damper = specimens.Damper("elastomer", viscous_kN=20.0, power=1.0, linear_kN_per_mm=0.3)
    x = 10.0 * np.cos(2.0 * np.pi * t)
    cycle = truth.cycles(t, x, damper.force(t, x, t), t, static=False)[1]
    assert cycle.figures["absorbed_energy_J"][0] == pytest.approx(np.pi * 0.2 * 2 * np.pi * 100.0, rel=1e-3)
    assert cycle.figures["storage_stiffness_kN_per_mm"][0] == pytest.approx(0.3, rel=1e-3)
    assert cycle.figures["frequency_Hz"][0] == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize("frequency_Hz", [0.2833, 0.9371, 2.417])
def test_a_period_is_known_better_than_a_step_of_the_grid(frequency_Hz: float) -> None:
    t = np.arange(0.0, 6.0 / frequency_Hz, 1e-3)
    damper = specimens.Damper("elastomer", viscous_kN=20.0, power=1.0, linear_kN_per_mm=0.3)
    x = 10.0 * np.cos(2.0 * np.pi * frequency_Hz * t + 0.4)
    for cycle in truth.cycles(t, x, damper.force(t, x, t), t, static=False)[1:-1]:
        assert cycle.figures["frequency_Hz"][0] == pytest.approx(frequency_Hz, rel=2e-6)


@pytest.mark.parametrize("number", range(40))
def test_strokes_are_as_many_as_were_made(number: int) -> None:
    motion = motions.static(np.random.default_rng([1, number]))
    assert len(truth.find_strokes(motion.stroke_mm)) == motion.facts["strokes"]
    assert motion.time_s[0] <= motion.begin_s < motion.end_s
    assert np.all(np.diff(motion.time_s) > 0.0)


def test_a_specimen_is_warmed_in_the_pause_before_its_stroke() -> None:
    """What it begins with is on its thermometer, which is read once in a second or two."""
    made = [motions.static(np.random.default_rng([2, number])) for number in range(300)]
    warm = [motion for motion in made if motion.shape == "warm"]
    assert len(warm) >= 5
    for motion in warm:
        from_s = motion.facts["warm_from_s"]
        assert any(start + 0.9 < from_s < end - 0.9 for start, end in motion.rests)


def test_a_wire_deviates_as_its_limit_says() -> None:
    """0.46 of the limit about its own line; from contact √(2 (1 - mean of the cosines)) times that."""
    rng, places = np.random.default_rng(1), np.array([30.0, 60.0, 105.0])
    found = np.std([chain.unstraight(rng, places, 0.5) for _ in range(3000)], axis=0)
    cosines = np.mean([np.cos(np.pi * k * places / 120.0) for k in (1, 2, 3)], axis=0)
    assert found == pytest.approx(0.5 * 0.46 * np.sqrt(2.0 * (1.0 - cosines)), rel=0.06)


def test_a_clock_is_within_its_limit() -> None:
    scenes = [world.make(number, "clean") for number in range(3)]
    wrong = [scene.time_s[-1] / scene.true_time_s[-1] - 1.0 for scene in scenes]
    assert 0.0 < np.max(np.abs(wrong)) <= world.CLOCK
    assert np.ptp(wrong) > 0.0
