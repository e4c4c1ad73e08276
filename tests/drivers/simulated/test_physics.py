"""Actuator and contact: exact steps, balance of energy, stability."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.drivers.simulated.machine.physics import Actuator, ActuatorFacts, SpecimenAndFrame
from tests.drivers.simulated.standing import FrictionSpring, LinearSpring

DT_S = 0.001
FRAME = 150.0


def test_actuator_loses_3_db_at_its_bandwidth() -> None:
    actuator = Actuator(ActuatorFacts(bandwidth_Hz=15.0, speed_max_mm_per_s=1e9), 1e-5)
    time_s = np.arange(60_000) * 1e-5
    position = np.array([actuator.follow(math.sin(2 * math.pi * 15.0 * t)) for t in time_s])
    settled = position[-20_000:]
    assert 0.5 * np.ptp(settled) == pytest.approx(math.sqrt(0.5), rel=2e-3)


def test_actuator_step_is_the_closed_form_whatever_the_step() -> None:
    """The step response of a second-order system with damping 0.8, sampled."""
    facts = ActuatorFacts(bandwidth_Hz=15.0, damping=0.8, speed_max_mm_per_s=1e9)
    ratio = math.sqrt(1 - 2 * 0.64 + math.sqrt(4 * 0.8**4 - 4 * 0.64 + 2))
    omega = 2 * math.pi * 15.0 / ratio
    damped = omega * math.sqrt(1 - 0.64)
    for dt_s in (0.001, 0.01):
        actuator = Actuator(facts, dt_s)
        for number in range(1, 21):
            t = number * dt_s
            decay = math.exp(-0.8 * omega * t)
            exact = 1 - decay * (math.cos(damped * t) + 0.8 * omega / damped * math.sin(damped * t))
            assert actuator.follow(1.0) == pytest.approx(exact, abs=1e-12)


def test_actuator_keeps_its_speed_limit_and_still_arrives() -> None:
    actuator = Actuator(ActuatorFacts(speed_max_mm_per_s=800.0), DT_S)
    positions = [0.0, *(actuator.follow(100.0) for _ in range(600))]
    steps = [b - a for a, b in pairwise(positions)]
    assert max(steps) == pytest.approx(0.8)
    assert positions[-1] == pytest.approx(100.0, abs=1e-6)
    assert max(positions) < 103.0


def test_leak_creeps_back_with_the_force_only() -> None:
    actuator = Actuator(ActuatorFacts(leak_mm_per_s_kN=0.02), DT_S)
    actuator.position_mm = 50.0
    actuator.leak(0.0, 1000)
    assert actuator.position_mm == 50.0
    actuator.leak(500.0, 1000)
    assert actuator.position_mm == pytest.approx(40.0)


@pytest.mark.parametrize("position_mm", [0.05, 0.2, 10.0, 80.0])
def test_contact_is_in_equilibrium_with_the_frame(position_mm: float) -> None:
    """Preload 15 kN, 5 kN/mm, frame 150 kN/mm: below 0.1 mm of position the specimen is rigid."""
    contact = SpecimenAndFrame(LinearSpring(5.0, 15.0), FRAME, DT_S)
    for _ in range(5):
        contact.push(position_mm)
    expected = max(0.0, (FRAME * position_mm - 15.0) / (FRAME + 5.0))
    assert contact.stroke_mm == pytest.approx(expected, abs=2e-6)
    assert contact.force_kN == pytest.approx(FRAME * (position_mm - expected), abs=3e-4)


def test_no_contact_no_force() -> None:
    contact = SpecimenAndFrame(LinearSpring(), FRAME, DT_S)
    contact.push(20.0)
    assert contact.force_kN > 0.0
    assert contact.push(-1.0) == 0.0
    assert contact.stroke_mm == 0.0


@settings(max_examples=20)
@given(
    mean=st.floats(10.0, 60.0),
    share=st.floats(0.1, 0.95),
    frequency=st.floats(0.5, 2.5),
    reach=st.floats(2.0, 8.0),
)
def test_contact_stays_in_step_through_steep_transitions(
    mean: float, share: float, frequency: float, reach: float
) -> None:
    """70 kN/mm at each reversal: stroke, force and frame agree at once, without chatter."""
    spring = FrictionSpring(stiffness=4.0, friction_kN=66.0 * reach / 2.0, reach_mm=reach)
    contact = SpecimenAndFrame(spring, FRAME, DT_S)
    time_s = np.arange(0.0, 1.5 / frequency, DT_S)
    position = mean * np.minimum(1.0, time_s * frequency * 2.0)
    position += mean * share * np.sin(2 * np.pi * frequency * time_s) * np.minimum(1.0, time_s * frequency)
    rows = []
    for x in position:
        contact.push(float(x))
        rows.append((contact.stroke_mm, contact.force_kN))
    stroke, force = np.array(rows).T
    speed = np.abs(np.diff(position)).max()
    gap = position - stroke - force / FRAME
    inside = (position > 0.0) & (stroke > 0.0)
    assert np.abs(gap[inside]).max() <= speed + 1e-6
    still = position[-1]
    for _ in range(20):
        contact.push(float(still))
    assert contact.stroke_mm + contact.force_kN / FRAME == pytest.approx(
        max(still, contact.stroke_mm), abs=1e-6
    )


@settings(max_examples=15)
@given(amplitude=st.floats(3.0, 30.0), frequency=st.floats(0.5, 2.5))
def test_what_the_piston_puts_in_is_in_specimen_and_frame(amplitude: float, frequency: float) -> None:
    """∫F dx of the piston = work on the specimen + what the frame has stored, at every sample."""
    contact = SpecimenAndFrame(FrictionSpring(), FRAME, DT_S)
    phase = 2 * np.pi * frequency * np.arange(0.0, 2.0 / frequency, DT_S)
    put_in = balance = scale = 0.0
    before = (0.0, 0.0)
    for x in 40.0 * np.minimum(1.0, phase / 6.0) + amplitude * (1.0 - np.cos(phase)) / 2.0:
        force = contact.push(float(x))
        put_in += 0.5 * (force + before[1]) * (float(x) - before[0])
        before = (float(x), force)
        scale = max(scale, put_in)
        balance = max(balance, abs(put_in - contact.work_J - force**2 / (2 * FRAME)))
    assert balance < 2e-3 * scale


def test_closed_loop_takes_what_friction_takes() -> None:
    """Between two turning points R apart a saturating band of ±f absorbs 2 f (R − reach)."""
    contact = SpecimenAndFrame(FrictionSpring(5.0, 70.0, 2.0), 1e6, DT_S)
    path = np.concatenate((np.linspace(0.0, 60.0, 6000), np.linspace(60.0, 20.0, 4000)))
    for x in path:
        contact.push(float(x))
    start = contact.work_J
    for x in np.concatenate((np.linspace(20.0, 60.0, 4000), np.linspace(60.0, 20.0, 4000))):
        contact.push(float(x))
    assert contact.work_J - start == pytest.approx(2 * 70.0 * (40.0 - 2.0), rel=2e-3)


def test_frame_must_be_stiff() -> None:
    with pytest.raises(ValueError, match="stiffness must be positive"):
        SpecimenAndFrame(LinearSpring(), 0.0, DT_S)
