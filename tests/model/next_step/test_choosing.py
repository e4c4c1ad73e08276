"""The steps that are chosen: admissible, within time, nearer to the goal each, faster than the template."""

from __future__ import annotations

import pytest

from bufferstand.model.next_step import (
    Choice,
    EveryParameter,
    Figure,
    Goal,
    Loops,
    Question,
    choose,
)
from tests.model.next_step.known import effects, knowledge
from tests.model.next_step.sittings import stopped, template
from tests.model.next_step.study import admitted, compared, every_candidate, minutes_of, spring_of, summary

QUESTION = Question.parsed("damping at 40 +- 40 mm, 1 Hz, 20 C to 0.002")


def chosen(goal: Goal, *, warmest_C: float = 39.0, minutes: float = 30.0, steps: int = 8) -> Choice:
    return choose(
        knowledge(), every_candidate(), effects(), goal,
        warmest_C=warmest_C, most_minutes=minutes, most_steps=steps,
    )  # fmt: skip


@pytest.mark.slow
def test_every_step_is_admissible_and_brings_the_goal_nearer() -> None:
    goal = EveryParameter()
    choice = chosen(goal)
    assert choice.end == "steps"
    for step in choice.steps:
        assert step.candidate in every_candidate()
        assert all(admitted(piece) for piece in step.candidate)
        assert goal.lack(step.after) < goal.lack(step.before)
        assert step.after.temperature_C < 39.0
    assert choice.minutes <= 30.0
    assert choice.minutes == pytest.approx(minutes_of([p for s in choice.steps for p in s.candidate]))


@pytest.mark.slow
def test_no_step_warms_beyond_what_is_allowed() -> None:
    cool = chosen(EveryParameter(), warmest_C=22.0)
    assert cool.steps
    assert all(step.after.temperature_C <= 22.0 for step in cool.steps)
    assert not any(isinstance(p, Loops) and p.cycles >= 40 for s in cool.steps for p in s.candidate)


@pytest.mark.slow
def test_time_and_steps_are_bounds() -> None:
    assert chosen(EveryParameter(), minutes=0.5).minutes <= 0.5
    assert len(chosen(EveryParameter(), steps=2).steps) == 2
    assert chosen(EveryParameter(), minutes=0.01).end == "time"


@pytest.mark.slow
def test_a_question_ends_when_it_is_reached_or_cannot_be() -> None:
    _, gradient = QUESTION.value_and_gradient(knowledge().spring)
    floor = knowledge().limit(effects().values()).deviation_of(gradient)
    easy = chosen(Figure(gradient, 2.0 * floor))
    assert easy.end == "reached"
    assert easy.last.deviation_of(gradient) <= 2.0 * floor
    hard = chosen(Figure(gradient, 0.5 * floor), steps=40)
    assert hard.end in ("nothing-more", "steps", "time")
    assert hard.last.deviation_of(gradient) > 0.5 * floor


def test_the_template_is_run_as_the_stand_would() -> None:
    _, model = spring_of(0)
    pieces = stopped(model, template())
    assert len(pieces) >= len(template())
    assert minutes_of(pieces) > 20.0


@pytest.mark.slow
def test_chosen_steps_have_the_templates_intervals_in_six_tenths_of_its_time() -> None:
    row = compared(0)
    print(row)
    assert row.reached
    assert row.share <= 0.6


@pytest.mark.long
def test_campaigns_of_springs_that_the_fit_can_follow() -> None:
    # Those of another family are in the summary: there the residuals run along together, and both arms'
    # intervals with them.
    rows = [compared(seed) for seed in range(200)]
    print(summary(rows))
    own = [row for row in rows if row.kind != "another family"]
    assert sum(row.reached for row in own) >= 0.9 * len(own)
    assert sorted(row.share for row in own)[len(own) // 2] <= 0.6
