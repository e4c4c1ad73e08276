"""A force that leaps by more than a machine allows is told without a second one, behind a limit of the
controller's own as behind a guard's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.frozen import FrozenGuard
from bufferstand.daq.guards.kinds.wiring import SignalsGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action
from bufferstand.daq.guards.wiring.forces.force_jump import leapt
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import EndReason, MotionState
from tests.daq.test_guard_table import STATUS, panel
from tests.daq.wiring_bench import Case, signals_of

RATE_HZ, SECOND_HZ, LEAPS_S, SEEN_S = 200.0, 50.0, 6.0, 0.02
GUARD = WiringGuard(frame_kN_per_mm=150.0)
FORCE_LIMIT = replace(
    STATUS, heartbeat=2, fault_code=2, state=MotionState.RELEASING, end_reason=EndReason.DEVICE_LIMIT
)


def pressed(by: float = 10.0, speed_mm_per_s: float = 5.0, second: bool = True) -> SampleStretch:
    """Return a slow stroke up to just behind a moment from which on the force is multiplied."""
    signals = signals_of(Case(static_mm_per_s=speed_mm_per_s, second=second))
    rows = signals.time_s < LEAPS_S + SEEN_S
    values = {name: value[rows] for name, value in signals.values.items()}
    time_s = signals.time_s[rows]
    values["force"] = np.where(time_s < LEAPS_S, 1.0, by) * values["force"]
    beside = signals.second_s < LEAPS_S + SEEN_S
    none = np.empty(0)
    return SampleStretch(
        time_s,
        values,
        *((signals.second_s[beside], signals.second_kN[beside]) if second else (none, none)),
    )


@pytest.mark.parametrize(
    ("by", "kind"), [(10.0, "scale"), (-10.0, "sign"), (-3.0, "sign"), (30.0, "disagrees")]
)
def test_a_force_that_leaps_by_more_than_the_machine_allows_is_doubted_alone(by: float, kind: str) -> None:
    doubt = leapt(GUARD, pressed(by, second=False))
    assert doubt is not None
    assert (doubt.sensor, doubt.kind) == ("force", kind), doubt.text
    assert "machine's own stiffness" in doubt.text


def of_force(force: Floats, way: Floats) -> SampleStretch:
    random = np.random.default_rng(2)
    time_s = np.arange(len(way)) / RATE_HZ
    noise = 0.01 * random.standard_normal(len(way))
    return SampleStretch(time_s, {"command": way, "position": way + noise, "force": force + 10.0 * noise})


@pytest.mark.parametrize("speed_mm_per_s", [1.0, 25.0, 160.0])
@pytest.mark.parametrize("late_s", [0.0, 0.04])
@pytest.mark.parametrize("frame_kN_per_mm", [100.0, 300.0])
def test_a_specimen_that_blocks_or_breaks_leaps_by_no_more(
    speed_mm_per_s: float, late_s: float, frame_kN_per_mm: float
) -> None:
    time_s = np.arange(0.0, 4.0, 1.0 / RATE_HZ)
    way = speed_mm_per_s * np.maximum(time_s - 1.0, 0.0)
    blocked = 2.0 * way + frame_kN_per_mm * np.maximum(way - 1.5 * speed_mm_per_s, 0.0)
    blocked = np.interp(time_s - late_s, time_s, blocked)
    assert leapt(GUARD, of_force(blocked, way)) is None
    broken = np.where(time_s < 3.0, 2.0 * way, 1.0)
    assert leapt(GUARD, of_force(broken, way)) is None


def tripped(stretch: SampleStretch, action: Action = Action.STOP) -> GuardPanel:
    """Return a panel that has seen a stretch, and then a limit of the device's own."""
    own = panel()
    others = (one for one in own.guards if not isinstance(one, ChannelGuard | FrozenGuard))
    own.change(GuardSet(others, SignalsGuard(**vars(replace(GUARD, action=action)))))
    own.judge(STATUS, 0.0, 0.0)
    streams = {"controller": (stretch.time_s, stretch.values)}
    if len(stretch.second_s):
        streams["amplifier"] = (stretch.second_s, {"force_2": stretch.second_kN})
    for begin_s in np.arange(0.0, LEAPS_S + SEEN_S, 0.1):
        for stream, (time_s, values) in streams.items():
            rows = (time_s >= begin_s) & (time_s < begin_s + 0.1)
            if rows.any():
                stamps = np.rint(time_s[rows] * 1e6).astype(np.int64)
                part = {name: value[rows] for name, value in values.items()}
                own.observe(ScaledBlock(stream, 0, stamps, part, 0, begin_s + 0.1), begin_s)
    assert own.has_limited(FORCE_LIMIT) == "force"
    own.judge(FORCE_LIMIT, LEAPS_S, LEAPS_S)
    own.judge(replace(FORCE_LIMIT, heartbeat=3), LEAPS_S + 0.1, LEAPS_S + 0.1)
    return own


@pytest.mark.parametrize("second", [True, False])
def test_a_limit_of_the_controller_is_explained_by_the_force_that_passed_it(second: bool) -> None:
    own = tripped(pressed(second=second))
    assert own.trip is not None
    assert (own.trip.sensor, own.trip.doubt) == ("force", "scale"), own.trip.reason
    assert own.trip.action is Action.EMERGENCY
    assert own.trip.reason.startswith("force ")
    assert "it reports fault 2 (force limit of the device)" in own.trip.reason
    assert ("force_2 reads" in own.trip.reason) is second
    assert sum("fault 2" in trip.reason for trip in own.said()) == 1


@pytest.mark.parametrize("second", [True, False])
def test_a_force_that_passed_it_in_truth_stays_the_controllers_limit(second: bool) -> None:
    own = tripped(pressed(by=1.0, second=second))
    assert own.trip is not None
    assert (own.trip.guard, own.trip.doubt) == ("controller", "")


def test_where_doubts_are_only_noted_it_stays_so_too() -> None:
    own = tripped(pressed(), Action.NOTE)
    assert own.trip is not None
    assert own.trip.guard == "controller"
