"""A release on a force that is none of the specimen's ends where the specimen has been let go."""

from __future__ import annotations

import numpy as np
import pytest

from daq.let_go import BACK_MM, LetGo
from daq.safe_stop import SafeStop, SafeStopSettings
from daq.scaling import ScaledBlock
from daq.stop_eyes import Blind
from drivers.interfaces import MotionState
from tests.daq.fake_stand import FakeClock, FakeController

SPRING_KN_PER_MM, FRAME_KN_PER_MM = 5.0, 100.0
WAY_MM = np.arange(60.0, -60.0, -0.02)
"""Of a piston that draws back at 20 mm/s, sampled at 1 kHz."""
Floats = np.ndarray


def force_at(way_mm: Floats) -> Floats:
    """Return the force [kN] of a spring behind a frame."""
    return np.maximum(way_mm, 0.0) / (1.0 / SPRING_KN_PER_MM + 1.0 / FRAME_KN_PER_MM)


def let_go_at(force_kN: Floats, stroke_mm: Floats | None) -> float | None:
    """Return where it is seen that the specimen was let go [mm], None if it never is."""
    random, follows = np.random.default_rng(3), LetGo()
    for first in range(0, len(WAY_MM), 10):
        rows = slice(first, first + 10)
        values = {
            "position": WAY_MM[rows] + 0.01 * random.standard_normal(10),
            "force": force_kN[rows] + 0.3 * random.standard_normal(10),
        }
        if stroke_mm is not None:
            values["stroke"] = stroke_mm[rows] + 0.05 * random.standard_normal(10)
        follows.take(ScaledBlock("controller", first, np.arange(first, first + 10), values, 0, 0.0))
        if follows.seen():
            return float(WAY_MM[rows][-1])
    return None


@pytest.mark.parametrize("wires", [True, False])
@pytest.mark.parametrize("off_kN", [4.0, -9.0, 60.0])
def test_a_force_whose_zero_is_off_ends_the_release_soon_behind_first_contact(
    off_kN: float, wires: bool
) -> None:
    force = force_at(WAY_MM)
    stroke = force / SPRING_KN_PER_MM if wires else None
    at_mm = let_go_at(force + off_kN, stroke)
    assert at_mm is not None
    assert -2.0 * BACK_MM < at_mm <= -BACK_MM


def test_a_specimen_that_still_presses_is_not_let_go() -> None:
    """First contact may lie far behind the zero: 60 mm here, and the force falls all the way."""
    force = force_at(WAY_MM + 60.0)
    assert let_go_at(force, force / SPRING_KN_PER_MM) is None


def test_wires_that_move_keep_the_release_going_beside_a_frozen_force() -> None:
    force = force_at(WAY_MM + 60.0)
    assert let_go_at(np.full_like(force, 300.0), force / SPRING_KN_PER_MM) is None


def test_what_is_no_number_tells_nothing() -> None:
    force = force_at(WAY_MM)
    nothing = np.full_like(force, np.nan)
    assert let_go_at(nothing, force / SPRING_KN_PER_MM) is None
    assert let_go_at(force + 9.0, nothing) is None


class Seen(Blind):
    """Eyes that see the specimen let go after so many looks of a release."""

    def __init__(self, looks: int) -> None:
        self.left, self.released = looks, 0

    def releasing(self) -> None:
        self.released += 1

    def let_go(self) -> str:
        self.left -= 1
        return "the piston drew back, and nothing changed" if self.left < 0 else ""


def test_the_safe_stop_ends_there_with_the_valve_off_and_says_why() -> None:
    clock = FakeClock()
    controller = FakeController(clock, None)
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=250.0, watchdog_ms=2000)
    controller.start_ramp(target_mm=40.0, speed_mm_per_s=80.0)
    clock.sleep(0.9)
    eyes = Seen(5)
    slow = SafeStopSettings(release_speed_mm_per_s=0.1, watchdog_s=2.0)
    report = SafeStop(controller, clock, slow, controller.feed_watchdog, eyes=eyes).run()
    assert eyes.released == 1
    assert report.duration_s < 5.0
    assert report.state is MotionState.OFF
    assert not report.safe, "the force that is read is still there: a person must look"
    assert "the piston drew back, and nothing changed" in report.line
    assert "did not end in time" not in report.line
