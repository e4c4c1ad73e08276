"""Clipping is found where flanks lead beyond a flat extreme, and nothing that only looks like it."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.plausibility.run_view.view import RunView
from bufferstand.evaluation.plausibility.stuck_channels.clipping import clipped_again
from bufferstand.evaluation.record.record import make_record
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static


def at_most(share: float, column: int) -> object:
    """Return what clips a column this share of its span below its top."""

    def change(*columns: Floats) -> tuple[Floats, ...]:
        values = columns[column]
        level = float(np.max(values) - share * np.ptp(values))
        return tuple(np.minimum(c, level) if n == column else c for n, c in enumerate(columns))

    return change


@pytest.mark.parametrize("noisy", [True, False])
@pytest.mark.parametrize(("column", "channel"), [(1, "stroke"), (2, "force")])
@pytest.mark.parametrize("share", [0.02, 0.1, 0.35])
def test_clipped_static(share: float, column: int, channel: str, noisy: bool) -> None:
    if channel == "force" and share < 0.2 and not noisy:
        pytest.skip("a force that falls as the stroke turns: friction looks the same")
    run = static(at_most(share, column), noisy=noisy)  # type: ignore[arg-type]
    (finding,) = of_kind(run, "clipped")
    assert (finding.channel, finding.cycles) == (channel, (1, 2, 3))
    values = run.record.stroke_mm if column == 1 else run.record.force_kN
    assert finding.size == pytest.approx(float(np.max(values)))
    assert run.extremes[f"{channel}_max_{finding.unit}"].doubt


@pytest.mark.parametrize("noise", [0.0, 5e-4])
@pytest.mark.parametrize("column", [1, 2])
def test_clipped_harmonic(column: int, noise: float) -> None:
    run = harmonic(at_most(0.05, column), noise=noise)  # type: ignore[arg-type]
    assert len(of_kind(run, "clipped")) == 1


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_clipped_where_a_cycle_has_24_samples_and_the_force_falls_as_it_turns(noise: float) -> None:
    def falls(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        down = np.gradient(stroke) < 0.0
        lost = np.where(down, 0.75 * (1.0 - np.exp(-(np.max(stroke) - stroke) / 4.0)), 0.0)
        return time_s, stroke, np.minimum(4.0 * stroke * (1.0 - lost), 180.0)

    run = harmonic(falls, cycles=8.2, rate_Hz=24.3, noise=noise)
    assert len(of_kind(run, "clipped")) == 1


@pytest.mark.parametrize(("strokes", "is_clipped"), [(3, True), (2, False)])
def test_what_is_frozen_at_its_extreme_in_three_strokes_is_clipped(strokes: int, is_clipped: bool) -> None:
    time_s = np.arange(100 * strokes) / 100.0
    stroke = 50.0 - 100.0 * np.abs(time_s % 1.0 - 0.5)
    record = make_record(time_s, stroke, np.minimum(5.0 * stroke, 200.0))
    look = RunView(record, record, [], RunFacts("clipped", "static"))
    found = clipped_again(look, look.force, 200.0)
    assert (found is not None and found.kind == "clipped") == is_clipped
    assert clipped_again(look, look.force, 100.0) is None  # no extreme


def test_few_samples_at_the_end_of_the_range_are_enough_where_noise_tells() -> None:
    """Six samples in three strokes: noise makes two neighbours alike once in 350 times."""

    def cut(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        level = np.sort(force)[-7]
        return time_s, stroke, np.round(np.minimum(force, level), 3)

    (finding,) = of_kind(static(cut, rate_Hz=50.0, speed_mm_per_s=25.0), "clipped")
    assert finding.channel == "force"


@pytest.mark.parametrize("steps", [30, 100, 1000])
def test_converter_steps_at_slow_turns_are_none(steps: int) -> None:
    def coarse(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        mm, kN = np.ptp(stroke) / steps, np.ptp(force) / steps
        return time_s, np.round(stroke / mm) * mm, np.round(force / kN) * kN

    for noise in (0.0, 2e-4):
        assert not of_kind(harmonic(coarse, noise=noise), "clipped")
    for noisy in (True, False):
        assert not of_kind(static(coarse, noisy=noisy), "clipped")


@pytest.mark.parametrize("noisy", [True, False])
def test_a_dwell_is_none(noisy: bool) -> None:
    def relaxing(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        """A specimen that relaxes by 8 % while the stroke stands still to the last digit."""
        still = np.round(stroke, 1)
        held = np.isclose(still, 102.0, atol=0.11)
        begun = np.maximum.accumulate(np.where(np.diff(held, prepend=False) & held, time_s, 0.0))
        since = time_s - begun
        return time_s, still, np.where(held, force * (0.92 + 0.08 * np.exp(-since)), force)

    assert not of_kind(static(relaxing, noisy=noisy, dwell_s=3.0), "clipped")
    assert not of_kind(static(noisy=noisy, dwell_s=3.0), "clipped")


def test_friction_limits_a_force_without_clipping_it() -> None:
    def friction(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, 40.0 * np.sign(np.gradient(stroke, time_s))

    for rate_Hz in (24.0, 37.0, 500.0):
        assert not of_kind(harmonic(friction, noise=0.0, rate_Hz=rate_Hz), "clipped")


def test_a_specimen_that_leaves_its_plate_has_no_force() -> None:
    def parted(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke, np.where(stroke < 8.0, 0.0, force)

    assert not of_kind(static(parted, noisy=False), "clipped")
