"""Steps several times over."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.campaign_file.step_kinds.cyclic import HarmonicStep
from bufferstand.protocols.campaign_file.step_kinds.repeated import RepeatStep
from bufferstand.protocols.planning.expansion import expand
from tests.protocols.conftest import Load, MakePlan, harmonic

REPEAT = '[[step]]\nkind = "repeat"\ntimes = {times}\n{more}\n'
INNER = harmonic(50.0, 10.0).replace("[[step]]", "[[step.step]]")
STATIC = '[[step.step]]\nkind = "static"\nname = "slow"\nforce_limit_kN = 200.0\n'


def repeat(times: int = 3, more: str = "", inner: str = INNER + STATIC) -> str:
    return REPEAT.format(times=times, more=more) + inner


def test_each_turn_has_its_steps_in_order_with_its_number(plan: MakePlan) -> None:
    found = plan(harmonic(20.0, 5.0) + repeat(2, 'name = "ageing"') + harmonic(20.0, 5.0))
    assert [step.name for step in found.steps] == [
        "20 ± 5 mm, 1 Hz",
        "ageing: 50 ± 10 mm, 1 Hz (1 of 2)",
        "ageing: slow (1 of 2)",
        "ageing: 50 ± 10 mm, 1 Hz (2 of 2)",
        "ageing: slow (2 of 2)",
        "20 ± 5 mm, 1 Hz",
    ]
    assert [step.index for step in found.steps] == [1, 2, 3, 4, 5, 6]
    assert len({step.plan_hash for step in found.steps}) == 6, "each is done for itself"


def test_more_turns_leave_the_first_ones_as_they_are(plan: MakePlan) -> None:
    three, four = (plan(repeat(times)) for times in (3, 4))
    assert [step.plan_hash for step in four.steps[:6]] == [step.plan_hash for step in three.steps]
    written_out = plan(harmonic(50.0, 10.0) + STATIC.replace("[[step.step]]", "[[step]]"))
    assert [step.plan_hash for step in written_out.steps] == [step.plan_hash for step in three.steps[:2]]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the file is written anew each time
@given(times=st.integers(1, 7), count=st.integers(1, 4))
def test_so_many_steps_as_turns_times_steps(load: Load, times: int, count: int) -> None:
    inner = "".join(
        harmonic(50.0, 5.0 + number).replace("[[step]]", "[[step.step]]") for number in range(count)
    )
    found = expand(load(repeat(times, inner=inner)), lambda _: 0.0)
    assert len(found) == times * count
    amplitudes = [one.step.amplitude_mm for one in found if isinstance(one.step, HarmonicStep)]
    assert amplitudes == [5.0 + number for number in range(count)] * times
    assert all(one.stays for one in found), "a sine moves nowhere when it is one of a sequence"


def test_a_repetition_may_be_put_in_order_if_it_says_so(load: Load) -> None:
    found = expand(load(repeat(2, "keep_order = false")), lambda _: 0.0)
    assert [one.stays for one in found] == [False, True, False, True]


def test_a_sweep_at_random_is_drawn_anew_in_every_turn(load: Load) -> None:
    sweep = (
        '[[step.step]]\nkind = "sweep"\nprestress_mm = 50\namplitude_mm = [5, 10, 15, 20]\n'
        'frequency_Hz = [0.5, 1.0]\norder = "random"\nseed = 4\n'
    )
    names = [one.name.rpartition(" (")[0] for one in expand(load(repeat(2, inner=sweep)), lambda _: 0.0)]
    first, second = names[:8], names[8:]
    assert sorted(first) == sorted(second)
    assert first != second


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (repeat(0), r"line 7: step.*times: 0 is too small.*from 1 to 1000"),
        (repeat(5000), "5000 is too large"),
        (repeat(2, inner=""), "line 5: step.*step: this key is missing"),
        (repeat(2, inner='[[step.step]]\nkind = "repeat"\ntimes = 2\n'), "repeated on one level only"),
        (repeat(2, inner='[[step.step]]\nkind = "statc"\n'), "did you mean “static”"),
        (repeat(2, inner=INNER.replace("amplitude_mm", "amplitud_mm")), "did you mean “amplitude_mm”"),
        (repeat(2).replace("times", "tmes"), "unknown key “tmes”"),
    ],
)
def test_what_cannot_be_is_said_with_its_place(load: Load, text: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        load(text)


def test_a_step_that_breaks_a_limit_is_named_with_its_line(plan: MakePlan) -> None:
    with pytest.raises(BadInput) as caught:
        plan(repeat(2, inner=STATIC + INNER.replace("10.0", "60.0")))
    assert "line 13: [[step]] 1, [[step.step]] 2" in str(caught.value)
    assert "(1 of 2)" in str(caught.value)
    assert "more" not in caught.value.problem, "its second turn is the same step of the file"


def test_a_repetition_that_is_written_inline_is_read_too(load: Load) -> None:
    found = load('[[step]]\nkind = "repeat"\ntimes = 2\nstep = [{ kind = "hold", duration_s = 1.0 }]\n')
    assert isinstance(found.content.step[0], RepeatStep)
    assert found.place(1, 1) == "[[step]] 1, [[step.step]] 1"
