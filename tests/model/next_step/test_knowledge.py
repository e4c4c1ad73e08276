"""What a step adds: never less knowledge, as much as a fit of all steps in a row would have, and floors."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.model.identification import NAMES
from bufferstand.model.next_step import Loops, Question, Rest, RunNoise, SharedErrors, SlowStroke, drive_of
from tests.model.next_step.known import FIRST, effects, knowledge
from tests.model.next_step.sittings import AMBIENT_C, ERRORS

pytestmark = pytest.mark.slow
LOOP = Question.parsed("damping at 40 +- 40 mm, 1 Hz, 20 C to 0.002")


def gradient() -> np.ndarray:
    return LOOP.value_and_gradient(knowledge().spring)[1]


@settings(max_examples=25)
@given(data=st.data())
def test_no_step_raises_the_variance_of_anything(data: st.DataObject) -> None:
    before, each = knowledge(), effects()
    pieces = data.draw(st.lists(st.sampled_from(list(each)), min_size=1, max_size=5))
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    directions = [*np.eye(before.spring.frame.size), *random.normal(size=(5, before.spring.frame.size))]
    for piece in pieces:
        after = before.after(each[piece])
        for direction in directions:
            assert after.by_noise(direction) <= before.by_noise(direction) * (1.0 + 1e-7)
        assert np.all(np.linalg.eigvalsh(after.covariance) > -1e-9)
        before = after


def test_steps_in_a_row_tell_what_a_fit_of_all_of_them_does() -> None:
    # Each by itself, joined by the states; and all as one experiment through the fit's Jacobian.
    pieces = (
        FIRST,
        Loops(66.8, 14.4, 1.0, 40),
        SlowStroke(96.0, 20.0, 1),
        Rest(300.0),
        Loops(45.1, 22.6, 0.32, 3),
    )
    chained, each = knowledge(), effects()
    known = {**each}
    for piece in pieces[1:]:
        if piece not in known:
            from bufferstand.model.next_step import effects_of

            known |= effects_of(chained.spring, [piece], (AMBIENT_C, 35.0))
        chained = chained.after(known[piece])
    joined = knowledge(ERRORS, pieces)
    for name in NAMES:
        assert chained.deviation(name) == pytest.approx(joined.deviation(name), rel=0.5), name


def test_a_question_falls_with_repetition_to_what_errors_of_the_channels_leave() -> None:
    piece = next(p for p in effects() if isinstance(p, Loops) and p.frequency_Hz == 0.32)
    at, found = knowledge(), []
    for _ in range(40):
        at = at.at(AMBIENT_C).after(effects()[piece])
        found.append((at.by_noise(gradient()), at.by_channels(gradient())))
    noise, channels = zip(*found, strict=True)
    assert all(b <= a * (1.0 + 1e-9) for a, b in itertools.pairwise(noise))
    # Four times the cycles: half the noise at best, and more where one rate alone leaves something untold.
    assert 0.49 * noise[9] < noise[39] < 0.75 * noise[9]
    assert channels[39] > 0.85 * channels[19], "repetition hardly lowers it"
    assert channels[39] > 0.0
    floor = knowledge().limit(effects().values())
    assert floor.by_noise(gradient()) < 0.01 * floor.by_channels(gradient())
    none = SharedErrors()
    clean = knowledge(none).limit(effects(none).values()).deviation_of(gradient())
    assert clean < 0.01 * floor.deviation_of(gradient())


def test_a_larger_error_of_a_channel_leaves_more() -> None:
    floors = []
    damping, _ = LOOP.value_and_gradient(knowledge().spring)
    for share in (0.0005, 0.002, 0.008):
        errors = SharedErrors(reversibility_share=share)
        known = knowledge(errors).limit(effects(errors).values())
        floors.append(known.deviation_of(gradient()))
    assert floors == sorted(floors)
    assert floors[2] == pytest.approx(16.0 * floors[0], rel=1e-3)
    # F (1 ± r / 2) rising and falling: W+ (1 + r / 2) and W- (1 - r / 2) make 1 - W-/W+ change by r W-/W+.
    # The fit takes a part of it for the transition after a turn.
    whole = 0.008 * (1.0 - damping)
    assert 0.3 * whole < floors[2] < 1.2 * whole


@given(
    prestress=st.floats(10.0, 60.0),
    share=st.floats(0.02, 1.0),
    frequency=st.floats(0.01, 2.5),
    cycles=st.integers(1, 40),
)
def test_nodes_are_in_order_and_every_half_stroke_goes_one_way(prestress, share, frequency, cycles) -> None:
    noise = RunNoise(0.4, 0.1, 0.1, 1.0, 1.0)
    drive = drive_of((Loops(prestress, share * prestress, frequency, cycles),), noise, 20.0)
    assert np.all(np.diff(drive.time_s) > 0.0)
    assert np.all(np.diff(drive.half) >= 0)
    assert drive.stroke_mm.max() == pytest.approx(prestress * (1.0 + share))
    assert drive.stroke_mm[-1] == pytest.approx(0.0, abs=1e-9)
    way = np.sign(np.diff(drive.stroke_mm))
    for half in range(int(drive.half.max()) + 1):
        assert len({w for w in way[drive.half[:-1] == half] if w}) == 1
    assert int(drive.half.max()) == 2 * cycles - 1
