"""What is learned of frame, actuator and spring, on stands in closed form, and the steps that follow."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.correction_steps import StrokeBounds, corrected, within_force
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.daq.strokes.sine_watch import CycleSeen, Period, SineWatch
from bufferstand.protocols.prediction.machine_stroke import Sine, piston_sine
from bufferstand.protocols.steps.turning import ExpectedTurns

RATE_HZ = 1000.0
WIDE = StrokeBounds(250.0, 250.0, 1e6, 1e6)


@dataclass(frozen=True)
class LinearStand:
    """A linear spring behind an elastic frame and a position loop: everything is a sine."""

    spring_kN_per_mm: float = 5.0
    preload_kN: float = 10.0
    give_mm_per_kN: float = 1.0 / 105.0
    offset_mm: float = 0.0
    static_gain: float = 1.0
    natural_Hz: float = 9.0
    damping: float = 0.7

    def response(self, frequency_Hz: float) -> complex:
        ratio = frequency_Hz / self.natural_Hz
        return self.static_gain / complex(1.0 - ratio**2, 2.0 * self.damping * ratio)

    def samples(
        self, command: Sine, frequency_Hz: float, noise_mm: float = 0.0
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """One period of every channel."""
        time = np.arange(round(RATE_HZ / frequency_Hz)) / RATE_HZ
        phase = 2.0 * math.pi * frequency_Hz * time
        answer = self.response(frequency_Hz)
        told = command.mean_mm + command.amplitude_mm * np.sin(phase)
        lagged = command.amplitude_mm * abs(answer) * np.sin(phase + np.angle(answer))
        position = command.mean_mm + lagged
        # position = stroke + offset + give (preload + c stroke)
        soft = 1.0 + self.give_mm_per_kN * self.spring_kN_per_mm
        stroke = (position - self.offset_mm - self.give_mm_per_kN * self.preload_kN) / soft
        random = np.random.default_rng(1)

        def felt(values: np.ndarray) -> np.ndarray:
            return values + noise_mm * random.standard_normal(len(values))

        force = self.preload_kN + self.spring_kN_per_mm * stroke
        return time, {"command": told, "position": felt(position), "stroke": felt(stroke), "force": force}

    def cycle(self, command: Sine, frequency_Hz: float, noise_mm: float = 0.0) -> CycleSeen:
        time, values = self.samples(command, frequency_Hz, noise_mm)
        found = Period(time, values, frequency_Hz, {}).seen()
        assert found is not None
        return found

    def expected(self, asked: Sine, factor: float = 1.0) -> ExpectedTurns:
        """The forces of a model that is wrong by a factor."""
        low, high = (
            (self.preload_kN + self.spring_kN_per_mm * one) / factor
            for one in (asked.lower_mm, asked.upper_mm)
        )
        return ExpectedTurns(asked.lower_mm, asked.upper_mm, low, high, asked.lower_mm, asked.upper_mm)


def commanded(
    known: StrokeKnowledge, asked: Sine, frequency_Hz: float, expected: ExpectedTurns | None
) -> Sine:
    lower_kN, upper_kN = known.forces(asked.lower_mm, asked.upper_mm, expected)
    piston = piston_sine(asked, lower_kN, upper_kN, known.give_mm_per_kN)
    return Sine(piston.mean_mm + known.offset_mm, piston.amplitude_mm / known.gain(frequency_Hz))


STANDS = st.builds(
    LinearStand,
    spring_kN_per_mm=st.floats(2.0, 8.0),
    give_mm_per_kN=st.floats(1.0 / 400.0, 1.0 / 60.0),
    offset_mm=st.floats(-0.3, 0.3),
    static_gain=st.floats(0.9, 1.05),
    natural_Hz=st.floats(5.0, 30.0),
    damping=st.floats(0.5, 1.0),
)


@settings(deadline=None, max_examples=60)
@given(
    stand=STANDS,
    factor=st.floats(0.7, 1.3),
    mean=st.floats(30.0, 70.0),
    share=st.floats(0.2, 0.8),
    frequency_Hz=st.floats(0.2, 2.5),
)
def test_what_two_steps_taught_gives_the_stroke_that_is_asked_for(
    stand: LinearStand, factor: float, mean: float, share: float, frequency_Hz: float
) -> None:
    known = StrokeKnowledge(1.0 / 150.0)
    for taught in (Sine(30.0, 15.0), Sine(60.0, 20.0)):
        expected = stand.expected(taught, factor)
        for _ in range(5):
            known.take(stand.cycle(commanded(known, taught, frequency_Hz, expected), frequency_Hz), expected)
    asked = Sine(mean, share * min(mean, 30.0))
    expected = stand.expected(asked, factor)
    seen = stand.cycle(commanded(known, asked, frequency_Hz, expected), frequency_Hz).stroke
    assert seen.mean_mm == pytest.approx(asked.mean_mm, abs=0.1)
    assert seen.amplitude_mm == pytest.approx(asked.amplitude_mm, rel=0.005)


def test_a_loop_that_was_seen_at_two_frequencies_is_known_between_and_beyond() -> None:
    stand, known = LinearStand(natural_Hz=9.0, damping=0.7), StrokeKnowledge(1.0 / 150.0)
    for frequency_Hz in (0.5, 1.5):
        for _ in range(3):
            known.take(stand.cycle(Sine(40.0, 15.0), frequency_Hz), None)
    for frequency_Hz in (0.3, 0.5, 1.0, 1.5, 2.0, 2.5):
        assert known.gain(frequency_Hz) == pytest.approx(abs(stand.response(frequency_Hz)), rel=0.005)


def test_a_machine_that_cannot_be_is_said_and_not_used() -> None:
    for give, stated in ((-1.0 / 100.0, 150.0), (1.0 / 15.0, 150.0)):
        known = StrokeKnowledge(1.0 / stated)
        said = [
            text
            for _ in range(20)
            for text in known.take(LinearStand(give_mm_per_kN=give).cycle(Sine(50.0, 20.0), 0.5), None)
        ]
        assert any("cannot be; what the stand file states is used" in text for text in said)
        assert known.give_mm_per_kN == 1.0 / stated


@pytest.mark.parametrize(
    ("give", "told"),
    [(-1e-6, ""), (-4e-4, ""), (-0.01, "cannot be; it is taken for rigid: look at the draw")],
)
def test_a_machine_of_which_nothing_is_stated_may_be_rigid(give: float, told: str) -> None:
    known = StrokeKnowledge()
    said = [
        text
        for _ in range(20)
        for text in known.take(LinearStand(give_mm_per_kN=give).cycle(Sine(50.0, 20.0), 0.5), None)
    ]
    assert any(told in text for text in said) if told else said == []
    assert known.give_mm_per_kN == 0.0


def test_a_zero_that_was_not_set_is_said_and_not_made_up_for() -> None:
    known = StrokeKnowledge(1.0 / 150.0)
    for _ in range(10):
        said = known.take(LinearStand(offset_mm=3.0).cycle(Sine(50.0, 20.0), 0.5), None)
    assert any("touch off" in text for text in said)
    assert known.offset_mm == 0.0


def test_what_was_learned_survives_a_file() -> None:
    known = StrokeKnowledge(1.0 / 150.0)
    stand = LinearStand()
    for frequency_Hz in (0.5, 2.0):
        known.take(stand.cycle(Sine(50.0, 20.0), frequency_Hz), stand.expected(Sine(50.0, 20.0), 0.9))
    again = StrokeKnowledge(1.0 / 150.0)
    again.restore(json.loads(json.dumps(known.as_dict())))
    assert again == known


def test_noise_does_not_overreach_a_turn() -> None:
    seen = LinearStand().cycle(Sine(50.0, 20.0), 1.0, noise_mm=0.05)
    true = LinearStand().cycle(Sine(50.0, 20.0), 1.0)
    assert seen.stroke.amplitude_mm == pytest.approx(true.stroke.amplitude_mm, abs=0.02)
    assert true.top_kN_per_mm == pytest.approx(5.0, rel=0.01)
    assert true.bottom_kN_per_mm == pytest.approx(5.0, rel=0.01)


def test_a_command_that_still_grows_is_no_cycle() -> None:
    time, values = LinearStand().samples(Sine(50.0, 20.0), 1.0)
    values["command"] = 50.0 + (values["command"] - 50.0) * np.linspace(0.9, 1.0, len(time))
    assert Period(time, values, 1.0, {}).seen() is None


def block(first: int, time: np.ndarray, values: dict[str, np.ndarray], lost: int = 0) -> ScaledBlock:
    return ScaledBlock("controller", first, np.round(time * 1e6).astype(np.int64), values, lost, 0.0)


def test_nothing_is_fitted_across_a_gap() -> None:
    time, values = LinearStand().samples(Sine(50.0, 20.0), 1.0)
    watch = SineWatch(1.0, {})
    watch.take(block(0, time, values))
    assert watch.period_from(0.0) is not None
    watch.take(block(1300, time[:400] + 1.3, {name: one[:400] for name, one in values.items()}, lost=300))
    assert watch.newest_us is not None
    assert watch.period_from(watch.newest_us - 1e6) is None


@given(
    asked=st.builds(Sine, st.floats(30.0, 80.0), st.floats(1.0, 29.0)),
    off=st.tuples(st.floats(-8.0, 8.0), st.floats(-0.6, 0.6)),
    gain=st.floats(0.6, 1.1),
    top=st.floats(1.0, 60.0),
    room=st.tuples(st.floats(-5.0, 20.0), st.floats(-50.0, 200.0)),
)
def test_a_correction_is_small_and_leads_beyond_no_limit(
    asked: Sine, off: tuple[float, float], gain: float, top: float, room: tuple[float, float]
) -> None:
    stroke = Sine(asked.mean_mm + off[0], asked.amplitude_mm * (1.0 + off[1]))
    seen = replace(
        LinearStand().cycle(Sine(50.0, 20.0), 1.0),
        stroke=stroke, lower_kN=20.0, upper_kN=300.0, top_kN_per_mm=top,
    )  # fmt: skip
    bounds = StrokeBounds(250.0, stroke.upper_mm + room[0], 300.0 + room[1], 800.0)
    command = Sine(asked.mean_mm + 3.0, asked.amplitude_mm + 1.0)
    new, _ = corrected(asked, command, seen, gain, 0.01, bounds)
    mean, amplitude = new.mean_mm - command.mean_mm, new.amplitude_mm - command.amplitude_mm
    assert abs(mean) <= 1.0 + 1e-9
    assert amplitude <= 0.05 * asked.amplitude_mm + 1e-9
    up = max(0.0, mean + gain * amplitude)  # the specimen follows by no more than the piston
    assert stroke.upper_mm + up <= max(bounds.stroke_max_mm, stroke.upper_mm) + 1e-9
    assert 300.0 + top * up <= max(bounds.force_max_kN, 300.0) + 1e-6
    assert new.amplitude_mm <= new.mean_mm + 1e-9, "contact is kept"
    if new != command and up > 0.0:
        assert stroke.upper_mm < asked.upper_mm + 0.01 * asked.amplitude_mm


@given(
    lower=st.floats(0.0, 300.0), more=st.floats(1.0, 500.0), most=st.floats(50.0, 600.0),
)  # fmt: skip
def test_a_sine_is_cut_at_its_top_only_and_only_where_it_must(lower: float, more: float, most: float) -> None:
    asked = Sine(60.0, 20.0)
    allowed = within_force(asked, lower, lower + more, most)
    if lower + more <= most:
        assert allowed is asked
    else:
        assert allowed.lower_mm == pytest.approx(asked.lower_mm)
        assert allowed.upper_mm <= asked.upper_mm
        chord = more / 40.0
        expected_kN = lower + more - chord * (asked.upper_mm - allowed.upper_mm)
        assert expected_kN <= max(most, lower) + 1e-6


def test_what_is_right_stays_as_it_is() -> None:
    seen = LinearStand().cycle(Sine(50.0, 20.0), 1.0)
    command = Sine(51.0, 20.5)
    assert corrected(seen.stroke, command, seen, 1.0, 0.01, WIDE) == (command, "")


def test_a_correction_awaits_what_settles_by_itself() -> None:
    """A force that falls by 20 kN lets the upper turn be 0.2 mm further: no more is missing."""
    seen = LinearStand().cycle(Sine(50.0, 20.0), 1.0)
    asked = Sine.between(seen.stroke.lower_mm, seen.stroke.upper_mm + 0.2)
    command = Sine(51.0, 20.5)
    assert corrected(asked, command, seen, 1.0, 0.01, WIDE, (0.0, -20.0)) == (command, "")
    told, _ = corrected(asked, command, seen, 1.0, 0.01, WIDE)
    assert told.upper_mm > command.upper_mm + 0.1


def test_a_force_above_its_limit_is_lowered_also_where_the_stroke_falls_short() -> None:
    seen = LinearStand().cycle(Sine(50.0, 20.0), 1.0)
    asked = Sine(seen.stroke.mean_mm, seen.stroke.amplitude_mm + 0.5)
    command = Sine(51.0, 20.5)
    bounds = replace(WIDE, force_max_kN=seen.upper_kN - 2.0)
    told, held = corrected(asked, command, seen, 1.0, 0.01, bounds)
    assert held.startswith("force_max_kN = ")
    # The specimen follows by 1 / (1 + 5 kN/mm × 0.01 mm/kN) of it, at 5 kN/mm.
    lowered_kN = (command.upper_mm - told.upper_mm) / 1.05 * 5.0
    assert 2.0 < lowered_kN < 3.5
    assert told.lower_mm < command.lower_mm, "the lower turn goes on to what was asked"


def test_of_a_stroke_further_than_any_that_was_seen_less_is_known() -> None:
    known = StrokeKnowledge(1.0 / 150.0)
    assert known.u_force(80.0) == 0.0, "the plan has judged it by the model"
    known.take(LinearStand().cycle(Sine(50.0, 20.0), 0.5), None)
    assert known.u_force(60.0) == pytest.approx(0.003)
    assert known.u_force(100.0) > 0.015


def test_a_small_force_at_a_lower_turn_does_not_spoil_its_factor() -> None:
    """A zero of force that is 2 kN off makes a factor of 0.8 of 10 kN, which is none of the spring."""
    known = StrokeKnowledge(1.0 / 150.0)
    stand = LinearStand(preload_kN=0.0)
    asked = Sine(32.0, 30.0)
    for _ in range(10):
        seen = stand.cycle(asked, 0.5)
        known.take(replace(seen, lower_kN=seen.lower_kN - 2.0), stand.expected(seen.stroke))
    lower_kN, _ = known.forces(40.0, 60.0, stand.expected(Sine(50.0, 10.0)))
    assert lower_kN == pytest.approx(200.0, rel=0.03)
