"""Damping of runs whose force is of another clock than the stroke: the truth, and how often U covers it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.evaluation.loading.load import load_run
from bufferstand.evaluation.loading.long_runs import MemoryBounds
from bufferstand.evaluation.loading.two_clocks import align, with_figures
from bufferstand.evaluation.run import evaluate_run
from bufferstand.recording.runfile import Run, open_run
from tests.two_clocks.runs import ABSORBED_J, DAMPING, DRIFT, World, record

SEEDS = range(1, 31)
BY_FORCE = World()
BY_WIRE = World(own_force=False, own_wire=True)
BY_READINGS = World(own_force=False)


def opened(path: Path) -> tuple[Run, tuple[str, ...]]:
    run = with_figures(open_run(path))
    return run, align(run)


def misplaced_s(run: Run, world: World) -> float:
    """Return by how much the device's samples are placed wrongly at worst, within the controller's [s]."""
    time_s = run.series("force").time_s
    device_s = (np.arange(time_s.size) - 200) / (1000.0 * (1.0 + world.drift)) + 3.1e-4
    inside = (device_s > 0.0) & (device_s < world.lasts_s)
    return float(np.max(np.abs((time_s - device_s)[inside])))


def values(path: Path) -> tuple[float, float, float, float, tuple[str, ...]]:
    """Return damping, its U, absorbed energy [J], its U, and what is said of the run."""
    found = evaluate_run(*load_run(path))
    assert found.summary is not None
    figures: list[float] = []
    for name in ("damping", "absorbed_energy_J"):
        stated = found.summary.values[name]
        assert stated.value is not None
        assert stated.expanded_uncertainty is not None
        figures += [stated.value, stated.expanded_uncertainty]
    return (*figures, found.warnings)  # type: ignore[return-value]


@pytest.mark.parametrize("world", [BY_FORCE, BY_WIRE], ids=["force", "wire"])
def test_a_common_quantity_places_the_samples(world: World, tmp_path: Path) -> None:
    """3.7 ms, 40 ppm and a jitter of a millisecond: what is left is some hundredths of a millisecond."""
    run, said = opened(record(tmp_path, world))
    u_s = run.other_clocks.u_s("acquisition")
    assert misplaced_s(run, world) < 2.0 * u_s < 1e-4
    assert "aligned by" in said[0]
    ppm = 1e6 * run.other_clocks.drift("acquisition")
    assert ppm == pytest.approx(1e6 * DRIFT, abs=60.0)  # by readings of a millisecond over 40 s


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.dose(4)
def test_readings_alone_bound_the_place(seed: int, tmp_path: Path) -> None:
    world = replace(BY_READINGS, seed=seed)
    run, said = opened(record(tmp_path, world))
    assert misplaced_s(run, world) < run.other_clocks.bound_s("acquisition")
    assert "by its readings alone" in said[0]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.dose(4)
def test_the_place_by_a_common_force_is_within_its_u(seed: int, tmp_path: Path) -> None:
    world = replace(BY_FORCE, seed=seed, lasts_s=31.0, u_delay_s=0.0)
    run, _ = opened(record(tmp_path, world))
    # Delays that are known exactly: what is left is the scatter of the stretches, at the worst end.
    assert misplaced_s(run, world) < 4.0 * run.other_clocks.u_s("acquisition") + 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("world", [BY_FORCE, BY_WIRE, BY_READINGS], ids=["force", "wire", "readings"])
def test_damping_is_within_its_u(world: World, tmp_path: Path) -> None:
    damping, u, absorbed_J, u_J, said = values(record(tmp_path, world))
    assert abs(damping - DAMPING) <= u
    assert abs(absorbed_J - ABSORBED_J) <= u_J
    assert any(text.startswith("clock of acquisition") for text in said)
    aligned = world is not BY_READINGS
    # Aligned it is as good as of one clock; by readings alone of some milliseconds it is some per cent.
    assert (u < 0.005 * DAMPING) is aligned
    assert (u > 0.03 * DAMPING) is not aligned


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.dose(2)
def test_coverage_over_many_worlds(seed: int, tmp_path: Path) -> None:
    """Offsets, drifts and jitters of every size; the truth lies within U of the damping."""
    random = np.random.default_rng(seed)
    world = World(
        seed,
        lasts_s=float(random.uniform(8.0, 60.0)),
        offset_s=float(random.uniform(-0.05, 0.05)),
        drift=float(random.uniform(-100e-6, 100e-6)),
        jitter_s=float(random.choice((2e-4, 1e-3, 5e-3))),
        own_wire=bool(seed % 2),
        own_force=bool(seed % 3),
    )
    damping, u, *_ = values(record(tmp_path, world))
    assert abs(damping - DAMPING) <= u


def test_a_force_that_comes_later_than_the_clocks_allow_is_told(tmp_path: Path) -> None:
    """The controller's own force passes a filter of 30 ms that nobody has stated: it aligns nothing."""
    world = World(own_late_s=0.03, jitter_s=2e-4)
    run, said = opened(record(tmp_path, world))
    assert "more than the clocks allow: see their delay_s" in said[0]
    assert misplaced_s(run, world) < run.other_clocks.bound_s("acquisition") < 2e-3


def test_a_run_without_readings_says_of_what_its_figures_are(tmp_path: Path) -> None:
    """The device's clock was never read: the controller's own force is told to be the figures'."""
    run, said = opened(record(tmp_path, World(), readings=False))
    assert run.stream_of("force").name == "controller"
    assert "the controller's own channels" in said[0]


def test_a_long_run_is_evaluated_in_pieces_alike(tmp_path: Path) -> None:
    path = record(tmp_path, World(lasts_s=20.0))
    whole, _ = load_run(path)
    pieces, facts = load_run(path, MemoryBounds(whole_rows=5_000, piece_rows=4_096))
    assert any("aligned by" in text for text in facts.problems)
    force_kN = np.interp(whole.time_s, pieces.time_s, pieces.force_kN)
    inside = slice(100, -100)
    assert np.max(np.abs(force_kN - whole.force_kN)[inside]) < 0.05


def test_delays_that_are_not_stated_are_told(tmp_path: Path) -> None:
    run, said = opened(record(tmp_path, World(u_delay_s=None)))
    assert "taken for exact" in said[0]
    _, facts = load_run(run.path)
    assert facts.force_uncertainty is not None
    assert facts.force_uncertainty.u_delay_s == pytest.approx(run.other_clocks.u_s("acquisition"))
