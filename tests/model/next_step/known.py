"""What a perfect fit of a sitting would know of the synthetic spring, without fitting."""

from __future__ import annotations

from functools import cache

import numpy as np

from bufferstand.model.identification import NAMES, FixedParts, Problem, Solution, experiment_of
from bufferstand.model.identification.fitting import freeze
from bufferstand.model.identification.parameters import pack
from bufferstand.model.next_step import (
    Effect,
    Knowledge,
    Piece,
    SharedErrors,
    SlowStroke,
    effects_of,
    known_by,
)
from tests.model.identification.synthetic import KNOTS_mm, true_values, truth
from tests.model.next_step.sittings import AMBIENT_C, ERRORS, sitting
from tests.model.next_step.study import every_candidate

FIRST = SlowStroke(96.0, 5.0, 1)


def solution(pieces: tuple[Piece, ...]) -> Solution:
    """A sitting at the true vector: its Jacobian is what counts."""
    model = truth()
    frame = FixedParts(knots_mm=KNOTS_mm, reference_C=25.0, contact_ramp_mm=0.2)
    true = true_values(model)
    curves = (np.array(model.curves.loading_kN), np.array(model.curves.unloading_kN))
    spring = pack(frame, *curves, {name: true[name] for name in NAMES})
    problem = Problem(frame, [experiment_of(sitting(model, list(pieces), 1))])
    vector = problem.start(spring)
    _, free = freeze(problem, vector, ["spectrum_per_decade"])
    nothing = np.empty((0, 0))
    return Solution(problem, vector, free, problem.residuals(vector), nothing, nothing, 1.0)


@cache
def knowledge(errors: SharedErrors = ERRORS, pieces: tuple[Piece, ...] = (FIRST,)) -> Knowledge:
    """What is known after pieces; one slow stroke if none are given."""
    return known_by(solution(pieces), [], errors, ambient_C=AMBIENT_C)


@cache
def effects(errors: SharedErrors = ERRORS) -> dict[Piece, Effect]:
    """Effects of every piece of every candidate."""
    pieces = [piece for candidate in every_candidate() for piece in candidate]
    return effects_of(knowledge(errors).spring, pieces, (AMBIENT_C, 35.0))
