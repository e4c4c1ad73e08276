"""Detectors that hold the force against the stroke, where one is clipped or has another sign or unit."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.plausibility.run_view.view import RunView
from bufferstand.evaluation.plausibility.units_and_signs.signs import turned_signs
from bufferstand.evaluation.plausibility.units_and_signs.units import implausible_units
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static


def test_softening_under_a_clip_is_no_drift() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        softer = force * (1.0 - 0.15 * time_s / time_s[-1])
        return time_s, stroke, np.minimum(softer, 0.6 * float(np.max(force)))

    run = harmonic(change, cycles=9.2)
    assert of_kind(run, "clipped")
    assert not of_kind(run, "drift")


def test_loops_that_are_clipped_have_no_sign_and_no_stiffness() -> None:
    time_s = np.arange(400) * 0.01
    record = make_record(time_s, 40.0 + 30.0 * np.sin(time_s), 200.0 + 100.0 * np.sin(time_s))
    facts = RunFacts("c", "harmonic", specimen={"kind": "buffer", "max_stroke_mm": 105.0})
    told = []
    for cycles in (frozenset[int](), frozenset({1})):
        look = RunView(record, record, (), facts, clipped={"stroke": cycles})
        # number, start, end, least and greatest force, area, rest, lower end, range, speed, temperature
        look.__dict__["figures"] = np.array([[1, 0.0, 4.0, 0.0, 300.0, -20.0, 0.0, 40.0, 1.0, 10.0, 20.0]])
        told.append({finding.kind for finding in (*implausible_units(look), *turned_signs(look))})
    assert told == [{"unit", "sign"}, set()]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "stroke_factor", "force_factor"),
    [("sign", 1.0, -1.0), ("sign", -1.0, 1.0), ("unit", 1e-3, 1.0), ("unit", 1.0, 1e3)],
)
def test_a_jump_is_told_whatever_sign_or_unit_is(
    kind: str, stroke_factor: float, force_factor: float
) -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        jumped = force * np.where(time_s > 75.0, 0.8, 1.0)
        return time_s, stroke_factor * stroke, force_factor * jumped

    run = static(change)
    assert of_kind(run, kind)
    (jump,) = of_kind(run, "gain-jump")
    assert jump.start_s == pytest.approx(75.0, abs=0.05)
    assert jump.size is not None
    assert jump.size * force_factor < 0.0  # by what the record shows
    sound = static(lambda time_s, stroke, force: (time_s, stroke_factor * stroke, force_factor * force))
    assert {finding.kind for finding in sound.findings} == {kind}


def test_first_contact_on_the_way_to_a_sine_is_no_jump_with_the_stroke_turned() -> None:
    """The released force is the greatest one then: from it a preload leaps, as it does from the least."""

    def approached(
        time_s: Floats, stroke: Floats, force: Floats, sign: float
    ) -> tuple[Floats, Floats, Floats]:
        before = np.arange(0.0, 1.5, float(np.median(np.diff(time_s))))
        ramp = np.interp(before, [0.2, 1.4], [0.0, stroke[0]])
        pushes = np.where(ramp > 4.0, 25.0 + (force[0] - 25.0) * (ramp - 4.0) / (stroke[0] - 4.0), 0.0)
        noise = 0.02 * np.random.default_rng(3).standard_normal(before.size)
        return (
            np.concatenate((before, time_s + 1.5)),
            sign * np.concatenate((ramp, stroke)),
            np.concatenate((pushes + noise, force)),
        )

    for sign in (1.0, -1.0):
        run = harmonic(lambda t, x, f, sign=sign: approached(t, x, f, sign), cycles=9.2)
        assert not of_kind(run, "gain-jump")
        assert bool(of_kind(run, "sign")) == (sign < 0.0)
