"""What slow strokes show of machine, actuator and spring, on a stand in closed form."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.daq.strokes.static_watch import MOST_POINTS, SlowStroke, StaticWatch
from bufferstand.foundation.motions import StaticCycles
from bufferstand.protocols.steps.turning import ExpectedTurns

GIVE = 1.0 / 105.0
RATE_HZ = 1000.0


@dataclass(frozen=True)
class Slow:
    """Strokes up and back, the piston late by a time; the force is 5 + 4 x, and 15 % less on the way back."""

    speed_mm_per_s: float = 20.0
    top_mm: float = 60.0
    lag_s: float = 0.03
    cycles: int = 1
    delays_s: tuple[float, float] = (0.0, 0.0)
    """Of stroke and force."""

    def watch(self, block: int = 50) -> StaticWatch:
        up_s = self.top_mm / self.speed_mm_per_s
        motion = StaticCycles(self.speed_mm_per_s, 1e4, self.top_mm, self.cycles, 0.0)
        delays = {"stroke": self.delays_s[0], "force": self.delays_s[1]}
        watch = StaticWatch(motion, self.top_mm, delays)
        time = np.arange(round(self.cycles * 2.0 * up_s * RATE_HZ)) / RATE_HZ

        def command(at: np.ndarray) -> np.ndarray:
            phase = np.clip(at, 0.0, None) % (2.0 * up_s)
            return np.asarray(self.speed_mm_per_s * np.minimum(phase, 2.0 * up_s - phase))

        def position(at: np.ndarray) -> np.ndarray:
            return command(at - self.lag_s)

        def force(at: np.ndarray) -> np.ndarray:
            place = position(at)
            back = np.gradient(place, 1.0 / RATE_HZ) < 0.0
            return np.where(place > 0.01, (5.0 + 4.0 * place) * np.where(back, 0.85, 1.0), 0.0)

        def stroke(at: np.ndarray) -> np.ndarray:
            return np.maximum(0.0, position(at) - GIVE * force(at))

        random = np.random.default_rng(5)
        values = {
            "command": command(time),
            "position": position(time),
            "stroke": stroke(time - self.delays_s[0]),
            "force": force(time - self.delays_s[1]) + 0.15 * random.standard_normal(len(time)),
        }
        for first in range(0, len(time), block):
            part = slice(first, first + block)
            stamps = np.round(time[part] * 1e6).astype(np.int64)
            own = {name: one[part] for name, one in values.items()}
            watch.take(ScaledBlock("controller", first, stamps, own, 0, 0.0))
        return watch

    def seen(self, block: int = 50) -> SlowStroke:
        found = self.watch(block).seen()
        assert found is not None
        return found


@pytest.mark.parametrize("block", [7, 50, 1000])
@pytest.mark.parametrize("delays_s", [(0.0, 0.0), (0.0, 0.004), (0.006, 0.001)])
def test_the_machine_and_the_lag_are_read_from_one_slow_stroke(
    block: int, delays_s: tuple[float, float]
) -> None:
    seen = Slow(delays_s=delays_s).seen(block)
    give, offset_mm = np.polyfit(seen.force_kN, seen.taken_mm, 1)
    assert give == pytest.approx(GIVE, rel=0.01)
    assert offset_mm == pytest.approx(0.0, abs=0.01)
    assert seen.lag_s == pytest.approx(0.03, abs=0.002)


def test_what_one_slow_stroke_taught_is_known_of_give_loop_and_spring() -> None:
    known = StrokeKnowledge(1.0 / 150.0)
    seen = Slow().seen()
    top_mm = float(seen.loading_mm[-1])
    expected = ExpectedTurns(0.0, 50.0, 0.0, seen.loading_force_kN(50.0) / 0.9, 0.0, 52.0)
    assert known.take_slow(seen, expected) == []
    assert known.give_mm_per_kN == pytest.approx(GIVE, rel=0.01)
    assert known.forces(0.0, 50.0, expected)[1] == pytest.approx(0.9 * expected.upper_kN, rel=0.01)
    assert known.forces(30.0, 50.0, ExpectedTurns(30.0, 50.0, 100.0, 200.0, 31.0, 52.0))[0] == pytest.approx(
        90.0, rel=0.01
    )
    # 1/H(f) = 1 − (f/f₀)² + i 2π f τ with a damping of 0.8
    assert 0.98 < known.gain(2.0) < 1.0
    assert known.forces(0.0, 0.5 * top_mm, None)[1] == pytest.approx(
        seen.loading_force_kN(0.5 * top_mm), rel=0.05
    )
    again = StrokeKnowledge(1.0 / 150.0)
    again.restore(json.loads(json.dumps(known.as_dict())))
    assert again == known


def test_a_force_beyond_the_stroke_that_was_reached_goes_on_as_its_end() -> None:
    seen = Slow().seen()
    end_mm = float(seen.loading_mm[-1])
    slope = seen.loading_force_kN(end_mm) - seen.loading_force_kN(end_mm - 1.0)
    assert seen.loading_force_kN(end_mm + 2.0) == pytest.approx(
        seen.loading_force_kN(end_mm) + 2.0 * slope, abs=1.5
    )


def test_strokes_of_hours_are_kept_in_bounded_memory() -> None:
    watch = Slow(speed_mm_per_s=0.25, top_mm=60.0, cycles=1).watch(block=1000)
    assert sum(one.shape[1] for one in watch._points) <= MOST_POINTS
    seen = watch.seen()
    assert seen is not None
    assert np.polyfit(seen.force_kN, seen.taken_mm, 1)[0] == pytest.approx(GIVE, rel=0.01)


def test_without_samples_or_contact_nothing_is_shown() -> None:
    motion = StaticCycles(20.0, 500.0, 60.0, 1, 0.0)
    watch = StaticWatch(motion, 60.0, {})
    assert watch.seen() is None
    time = np.arange(3000) / RATE_HZ
    rest = {name: np.zeros(3000) for name in ("command", "position", "stroke", "force")}
    watch.take(ScaledBlock("controller", 0, np.round(time * 1e6).astype(np.int64), rest, 0, 0.0))
    assert watch.seen() is None
