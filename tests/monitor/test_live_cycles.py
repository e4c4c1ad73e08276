"""Figures of cycles as they come: evaluation's own, each cycle once, in room that does not grow."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.daq.monitor.follower import Follower
from bufferstand.daq.monitor.live_cycles import (
    LOOPS_KEPT,
    MOST_SAMPLES,
    ROWS_SHOWN,
    TREND_KEPT,
    LiveCycles,
    columns,
)
from bufferstand.daq.monitor.view import View
from bufferstand.evaluation.document import evaluate_entry
from bufferstand.evaluation.loading import load_run

RUNS = Path(__file__).parents[2] / "sample_runs" / "runs"
CHANNELS = [
    {"name": "stroke", "quantity": "stroke", "unit": "mm", "delay_s": 0.0},
    {"name": "force", "quantity": "force", "unit": "kN", "delay_s": 0.0},
]


def rows(time_s: Any, stroke_mm: Any, force_kN: Any) -> dict[str, Any]:
    """Return a packet's rows, rounded as they are told."""
    t0_us = round(float(time_s[0]) * 1e6)
    return {
        "t0_us": t0_us,
        "t": np.rint((time_s - t0_us / 1e6) * 1e4).astype(int).tolist(),
        "s": np.rint(stroke_mm * 1e3).astype(int).tolist(),
        "f": np.rint(force_kN * 1e3).astype(int).tolist(),
    }


def watched(time_s: Any, stroke_mm: Any, force_kN: Any, *, packet: int = 50, every: int = 10) -> LiveCycles:
    """Return what is kept of samples that came in packets, looked at every so many."""
    live = LiveCycles()
    live.name(CHANNELS)
    live.begin(1)
    for number, first in enumerate(range(0, len(time_s), packet)):
        part = slice(first, first + packet)
        live.add(rows(time_s[part], stroke_mm[part], force_kN[part]))
        if number % every == 0 and (stretch := live.due()) is not None:
            live.take(live.evaluate(stretch), 21.5)
    live.end()
    if (stretch := live.due()) is not None:
        live.take(live.evaluate(stretch), 21.5)
    return live


@pytest.mark.parametrize(
    "name", [pytest.param("001-static-5mm_s", marks=pytest.mark.slow), "005-harmonic-20mm-20mm-1.27Hz"]
)
def test_figures_are_those_that_the_evaluation_finds_in_the_record(name: str) -> None:
    """Of samples rounded to 1 µm and 1 N, and of slow cycles fewer: within a part of the uncertainty."""
    path = RUNS / f"{name}.h5"
    record, _ = load_run(path)
    live = watched(record.time_s, record.stroke_mm, record.force_kN)
    shown = live.sections()["cycles"]["rows"]
    entry, _ = evaluate_entry(path)
    whole = {one["damping"]: one for one in entry["cycles"] if one["steady"]}
    assert len(shown) >= len(whole) >= 3
    limit = entry["summary"]["damping"]["expanded_uncertainty"]
    for damping, cycle in whole.items():
        row = min(shown, key=lambda one: abs(one["damping"] - damping))
        assert row["damping"] == pytest.approx(damping, abs=0.5 * limit)
        assert row["absorbed_energy_J"] == pytest.approx(cycle["absorbed_energy_J"], rel=2e-3)
        assert row["amplitude_mm"] == pytest.approx(cycle["amplitude_mm"], rel=1e-3)
        assert row["temperature_C"] == 21.5
    numbers = [row["n"] for row in shown]
    assert numbers == list(range(numbers[0], numbers[0] + len(shown))), "each once, in order"
    json.dumps(live.sections(), allow_nan=False)


def ellipse(cycles: int, *, rate_Hz: float = 200.0, delay_s: float = 0.0) -> tuple[Any, Any, Any]:
    """Return a viscous loop at 1 Hz: W_a = π F_d x_a, to be had in closed form."""
    time_s = np.arange(0.0, cycles + 0.3, 1.0 / rate_Hz)
    late = time_s - delay_s
    stroke = 10.0 - 5.0 * np.cos(2 * math.pi * time_s)
    force = 100.0 - 40.0 * np.cos(2 * math.pi * late) + 8.0 * np.sin(2 * math.pi * late)
    return time_s, stroke, force


@pytest.mark.parametrize("delay_s", [0.0, 0.004, -0.002])
def test_a_viscous_loop_has_the_area_of_its_ellipse_also_where_the_force_is_late(delay_s: float) -> None:
    time_s, stroke, force = ellipse(8, delay_s=delay_s)
    live = LiveCycles()
    live.name([CHANNELS[0], {**CHANNELS[1], "delay_s": delay_s}])
    live.begin(1)
    live.add(rows(time_s, stroke, force))
    stretch = live.due()
    assert stretch is not None
    found = live.evaluate(stretch)
    assert len(found) >= 6
    for one in found[1:-1]:
        assert one.figures["absorbed_energy_J"] == pytest.approx(math.pi * 8.0 * 5.0, rel=3e-3)
        assert one.figures["amplitude_mm"] == pytest.approx(5.0, rel=1e-3)


def test_a_campaign_that_is_resumed_shows_no_cycles_of_the_start_before(tmp_path: Path) -> None:
    """Stand time begins anew then, and the step is begun again under the same number."""
    time_s, stroke, force = ellipse(8)
    follower = Follower(tmp_path, View(), results=False)
    packet = {
        "at_s": 30.0,
        "extremes": {},
        "recording": True,
        "rows": rows(time_s, stroke, force),
        "wall_s": 3.0,
    }
    follower._heard({**packet, "progress": {"step": 1}, "channels": CHANNELS})
    live = follower._cycles
    live.take(live.evaluate(live.due()), 20.0)
    assert live.sections()["cycles"]["rows"]
    follower._heard({**packet, "at_s": 30.5})
    assert live.sections()["cycles"]["rows"], "it only goes on"
    live.changed = False
    follower._heard({**packet, "at_s": 0.5, "wall_s": 60.0})
    assert live.sections()["cycles"] == {**LiveCycles().sections()["cycles"], "step": 1}
    assert live.sections()["loops"] == []
    assert live.changed, "the page is told"
    assert follower._speed() == 1.0


@pytest.mark.slow
def test_thousands_of_cycles_take_no_more_room_than_the_first_hundreds() -> None:
    time_s, stroke, force = ellipse(50)
    live = LiveCycles()
    live.name(CHANNELS)
    live.begin(1)
    kept: list[int] = []
    for block in range(60):
        shifted = time_s[:-60] + 50.0 * block
        live.add(rows(shifted, stroke[:-60], force[:-60]))
        while (stretch := live.due()) is not None and (found := live.evaluate(stretch)):
            live.take(found, 20.0 + 0.01 * block)
        kept.append(live.kept)
    shown = live.sections()
    assert shown["cycles"]["rows"][-1]["n"] > 2900
    assert max(kept[20:]) <= max(kept[:20]) * 1.2
    assert max(kept) < MOST_SAMPLES + TREND_KEPT + ROWS_SHOWN + 2000
    assert len(shown["loops"]) == LOOPS_KEPT
    trend = shown["cycles"]["trend"]["damping"]
    assert trend[0][0] <= 2, "it begins with the step"
    assert trend[-1][0] == shown["cycles"]["rows"][-1]["n"]
    assert len(trend) <= TREND_KEPT


@pytest.mark.parametrize("told", [True, False], ids=["told", "seen at the end"])
def test_the_cycle_in_which_a_sine_fades_is_not_counted(told: bool) -> None:
    """Six cycles at 1 Hz between one that grows and one that fades, as a controller makes them."""
    time_s = np.arange(0.0, 8.8, 0.002)
    grown = np.clip(np.minimum(time_s, 8.0 - time_s), 0.0, 1.0)
    stroke = 10.0 + 5.0 * grown * np.sin(2 * math.pi * time_s)
    force = 100.0 + 40.0 * grown * np.sin(2 * math.pi * time_s + 0.1)
    live = LiveCycles()
    live.name(CHANNELS)
    live.begin(1)
    for first in range(0, len(time_s), 50):
        at = slice(first, first + 50)
        part = (
            "" if not told or 1.0 <= time_s[first] < 7.0 else "lead-in" if time_s[first] < 1.0 else "run-out"
        )
        live.add(rows(time_s[at], stroke[at], force[at]), part)
        if told and first % 500 == 0 and (stretch := live.due()) is not None:
            live.take(live.evaluate(stretch), 21.5)
    live.end()
    stretch = live.due()
    assert stretch is not None
    live.take(live.evaluate(stretch), 21.5)
    shown = live.sections()
    assert [row["n"] for row in shown["cycles"]["rows"]] == [1, 2, 3, 4, 5, 6]
    assert shown["cycles"]["rows"][-1]["amplitude_mm"] == pytest.approx(5.0, rel=1e-3)
    assert shown["loops"][-1]["n"] == 6


def test_a_stand_that_rests_for_hours_fills_nothing() -> None:
    live = LiveCycles()
    live.begin(1)
    for second in range(3600 * 2):
        time_s = second + np.arange(0.0, 1.0, 0.02)
        live.add(rows(time_s, np.full(50, 3.0), np.full(50, 1.0)))
    assert live.kept <= MOST_SAMPLES
    stretch = live.due()
    assert stretch is not None
    assert live.evaluate(stretch) == []


def test_another_step_begins_anew_and_what_was_evaluated_meanwhile_is_told_apart() -> None:
    time_s, stroke, force = ellipse(5)
    live = watched(time_s, stroke, force)
    assert live.sections()["cycles"]["rows"]
    epoch = live.epoch
    live.begin(2)
    assert live.epoch != epoch
    shown = live.sections()["cycles"]
    assert (shown["step"], shown["rows"]) == (2, [])
    assert not any(shown["trend"].values())
    assert {one["name"] for one in columns()} < set(shown["trend"])
    live.add(rows(np.linspace(1.0, 2.0, 60), stroke[:60], force[:60]))
    assert live.due() is not None, "a clock that was set back is taken for another one"
