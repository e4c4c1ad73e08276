"""A force that is late by its turns: by how much, and where no turn is left to tell."""

from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static

DWELL_S = 0.3


def _late(late_s: float, relaxes_kN: float = 0.0) -> object:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        held = np.cumsum(stroke > 102.0 - 0.05) / 100.0  # seconds at the top, all strokes
        relaxed = force - relaxes_kN * np.where(stroke > 102.0 - 0.05, held % DWELL_S, 0.0) / DWELL_S
        return time_s, stroke, np.interp(time_s - late_s, time_s, relaxed)

    return change


@pytest.mark.parametrize("relaxes_kN", [0.0, 5.0])
def test_a_late_force_is_told_from_the_dwell_in_which_it_relaxes(relaxes_kN: float) -> None:
    run = static(_late(0.6, relaxes_kN), dwell_s=DWELL_S)
    (finding,) = of_kind(run, "delay")
    assert finding.size == pytest.approx(0.6, abs=0.05)


def test_no_lateness_is_told_by_turns_that_a_clipped_stroke_has_lost() -> None:
    run = static(lambda time_s, stroke, force: (time_s, np.minimum(stroke, 70.0), -force))
    assert of_kind(run, "clipped")
    assert not of_kind(run, "delay")


def test_no_lateness_is_told_by_a_peak_that_is_clipped() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, np.minimum(np.interp(time_s - 0.6, time_s, force), 500.0)

    run = static(change)
    assert of_kind(run, "clipped")
    assert not of_kind(run, "delay")


def test_a_force_that_dips_as_the_stroke_turns_is_not_late() -> None:
    """A grip's mass pulls at the cell while the stroke turns: an elastomer's public record dips by 15 %."""

    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        since_s = (time_s - (np.pi / 2.0 - 1.0) / (2.0 * np.pi) + 0.5) % 1.0 - 0.5
        return time_s, stroke, force - 24.0 * np.exp(-((since_s / 0.03) ** 2))

    run = harmonic(change, loss=0.1)
    assert len(run.cycles) > 4
    assert not of_kind(run, "delay")


def test_a_damper_with_the_other_sign_is_told_to_be_that() -> None:
    """It need not be late for it: with its sign turned it is a sound one."""

    def turned(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, -20.0 * np.tanh(np.gradient(stroke, time_s) / 125.0)

    (finding,) = harmonic(turned, cycles=4.2).findings
    assert finding.kind == "sign"
    assert "--invert force" in finding.text
    assert "delay_s" in finding.text


@pytest.mark.slow
def test_an_early_force_with_the_other_sign_is_not_late() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, -np.interp(time_s + 0.6, time_s, force)

    run = static(change)
    assert of_kind(run, "sign")
    assert not of_kind(run, "delay")
