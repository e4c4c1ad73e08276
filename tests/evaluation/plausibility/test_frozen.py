"""Frozen stretches: found where the other channel moves; dwells, plateaus and rests are none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.plausibility.records import Change, Floats, harmonic, of_kind, static


def stuck(column: int, first: int, rows: int) -> Change:
    def change(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = (c.copy() for c in columns)
        values = (time_s, stroke, force)[column]
        values[first : first + rows] = values[first]
        return time_s, stroke, force

    return change


@pytest.mark.parametrize("noise", [0.0, 5e-4])
@pytest.mark.parametrize(("column", "channel"), [(1, "stroke"), (2, "force")])
@pytest.mark.parametrize("rows", [30, 150])
def test_a_stretch_that_stays(rows: int, column: int, channel: str, noise: float) -> None:
    run = harmonic(stuck(column, 1240, rows), noise=noise)
    (finding,) = of_kind(run, "frozen")
    assert (finding.channel, finding.effect) == (channel, "spoils")
    assert finding.start_s == pytest.approx(2.48)
    assert finding.end_s == pytest.approx(2.48 + (rows - 1) / 500.0)
    assert finding.unit == ("kN" if channel == "stroke" else "mm")
    assert finding.cycles == ((3,) if rows == 30 else (3, 4))


def test_the_other_channel_tells_how_far() -> None:
    (finding,) = of_kind(static(stuck(2, 800, 300)), "frozen")
    assert finding.size == pytest.approx(0.05 * 299, abs=0.1)  # 5 mm/s at 100 Hz


@pytest.mark.parametrize("noisy", [True, False])
def test_rests_and_dwells_are_none(noisy: bool) -> None:
    assert not of_kind(static(noisy=noisy, dwell_s=5.0, pause_s=30.0), "frozen")


def test_a_relaxing_dwell_is_none() -> None:
    def relaxing(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        top = np.isclose(stroke, 102.0)
        begun = np.maximum.accumulate(np.where(np.diff(top, prepend=False) & top, time_s, 0.0))
        return time_s, stroke, np.where(top, force * (0.8 + 0.2 * np.exp(begun - time_s)), force)

    assert not of_kind(static(relaxing, noisy=False, dwell_s=5.0), "frozen")


def test_friction_is_none() -> None:
    def friction(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, 40.0 * np.sign(np.gradient(stroke, time_s))

    assert not of_kind(harmonic(friction, noise=0.0), "frozen")


def test_before_contact_there_is_no_force() -> None:
    def seated(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, np.where(stroke < 12.0, 0.0, force)

    assert not of_kind(static(seated, noisy=False), "frozen")


@pytest.mark.parametrize("steps", [30, 100, 1000])
def test_converter_steps_are_none(steps: int) -> None:
    def coarse(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        mm, kN = np.ptp(stroke) / steps, np.ptp(force) / steps
        return time_s, np.round(stroke / mm) * mm, np.round(force / kN) * kN

    for noisy in (True, False):
        assert not of_kind(static(coarse, noisy=noisy), "frozen")


def test_a_stroke_that_stands_still_all_along() -> None:
    def stood(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, np.full_like(stroke, 66.2653), force

    (found,) = of_kind(harmonic(stood), "frozen")
    assert (found.channel, found.whole_record) == ("stroke", True)
    assert "clipped at the end of its range" in found.text
    assert not of_kind(harmonic(lambda t, x, f: stood(t, x, np.full_like(f, 3.0))), "frozen")
