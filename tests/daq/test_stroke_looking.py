"""A sine that is looked at while it runs: corrected, judged when its turns are whole, its limits said."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import pytest

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.command_settings import StrokeCommandSettings, WarnOnce
from bufferstand.daq.strokes.correction_steps import StrokeBounds, corrected
from bufferstand.daq.strokes.cycle_checks import is_off
from bufferstand.daq.strokes.knowledge import StrokeKnowledge
from bufferstand.daq.strokes.sine_correction import MotionOrder, SineCorrector
from bufferstand.daq.strokes.stroke_rows import spans
from bufferstand.drivers.interfaces import Controller
from bufferstand.foundation.motions import Harmonic
from bufferstand.protocols.campaign_file.stroke_table import StrokeTable
from bufferstand.protocols.prediction.machine_stroke import Sine
from tests.daq.test_stroke_learning import WIDE, LinearStand

BLOCK = 10


@dataclass
class Heard:
    """A voice that keeps what it is told."""

    events: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def event(self, kind: str, text: str, **data: object) -> None:
        self.events.append(f"{kind}: {text} {data}")

    def message(self, text: str) -> None:
        self.events.append(text)

    def warn(self, text: str) -> None:
        self.warnings.append(text)


@dataclass
class Bench:
    """A linear stand whose command follows what it is told at once, in blocks of 10 ms, 0.01 mm of noise."""

    stand: LinearStand
    can_adjust: bool = True
    command: Sine = field(default_factory=lambda: Sine(40.0, 10.0))
    told: list[Sine] = field(default_factory=list)

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        self.command = Sine(mean_mm, amplitude_mm)
        self.told.append(self.command)

    def run(self, look: SineCorrector, frequency_Hz: float, cycles: int) -> None:
        random = np.random.default_rng(7)
        for first in range(0, round(cycles * 1000.0 / frequency_Hz), BLOCK):
            time = (first + np.arange(BLOCK)) / 1000.0
            angle = 2.0 * math.pi * frequency_Hz * time
            answer = self.stand.response(frequency_Hz)
            told = self.command.mean_mm + self.command.amplitude_mm * np.sin(angle)
            lagged = self.command.amplitude_mm * abs(answer) * np.sin(angle + np.angle(answer))
            position = self.command.mean_mm + lagged
            give, spring = self.stand.give_mm_per_kN, self.stand.spring_kN_per_mm
            stroke = (position - give * self.stand.preload_kN) / (1.0 + give * spring)
            values = {
                "command": told,
                "position": position + 0.01 * random.standard_normal(BLOCK),
                "stroke": stroke + 0.01 * random.standard_normal(BLOCK),
                "force": self.stand.preload_kN + spring * stroke,
            }
            look.take(ScaledBlock("controller", first, np.round(time * 1e6).astype(np.int64), values, 0, 0.0))
            look.look(int((time[-1] + 1e-3) * frequency_Hz))


def looked(
    bench: Bench, frequency_Hz: float, bounds: StrokeBounds = WIDE, cycles: int = 12
) -> tuple[SineCorrector, Heard]:
    heard = Heard()
    terms = StrokeCommandSettings(StrokeTable(), StrokeKnowledge(1.0 / 105.0), bounds, {})
    order = MotionOrder(terms, heard, WarnOnce(heard), lambda _: None, compensates=True)
    motion = Harmonic(40.0, 10.0, frequency_Hz, cycles)
    look = SineCorrector(motion, bench.command, order, cast(Controller, bench), 0.0)
    bench.run(look, frequency_Hz, cycles)
    return look, heard


def test_a_sine_is_led_to_what_was_asked_and_its_first_cycles_are_named() -> None:
    look, heard = looked(Bench(LinearStand()), 1.0)
    row = look.end()
    assert row is not None
    assert row.reached_amplitude_mm == pytest.approx(10.0, abs=0.02)
    assert row.reached_mean_mm == pytest.approx(40.0, abs=0.02)
    assert row.cycles >= 11
    assert row.cycles_off.startswith("1-")
    assert len(row.cycles_off) <= 3, "and then no more"
    assert f"off in cycles {row.cycles_off} of {row.cycles}" in row.sentence()
    assert [text for text in heard.warnings if "after cycle 1 (it can still be corrected)" in text]
    assert not any("cannot be reached" in text for text in heard.warnings)


def test_a_piston_that_is_late_is_judged_when_its_turn_is_whole() -> None:
    """With a loop of 2.2 Hz the lower turn of a cycle of 2.5 Hz comes after its end: 0.275 of it late."""
    bench = Bench(LinearStand(natural_Hz=2.2, damping=0.8))
    look, heard = looked(bench, 2.5, cycles=20)
    row = look.end()
    assert row is not None
    assert row.cycles >= 18
    assert len(bench.told) >= 5, "every second cycle, as at any stand"
    assert (row.reached_amplitude_mm or 0.0) > (row.first_amplitude_mm or 0.0) + 1.0
    assert any("off in cycles" in text for text in heard.warnings)


@pytest.mark.parametrize(
    ("bounds", "why"),
    [
        (StrokeBounds(250.0, 250.0, 250.0, 1e6), "cannot be reached: force_max_kN = 250"),
        (StrokeBounds(250.0, 49.0, 1e6, 1e6), "cannot be reached: stroke_max_mm = 49"),
        (StrokeBounds(250.0, 250.0, 1e6, 62.0), "cannot be reached: speed of the piston, at most 62 mm/s"),
        (StrokeBounds(50.2, 250.0, 1e6, 1e6), "cannot be reached: travel of the piston, to 50.20 mm from"),
    ],
)
def test_what_a_limit_leaves_out_of_reach_is_said(bounds: StrokeBounds, why: str) -> None:
    bench = Bench(LinearStand())
    look, heard = looked(bench, 1.0, bounds)
    assert [text for text in heard.warnings if why in text] != []
    row = look.end()
    assert row is not None
    assert row.reached_mean_mm + (row.reached_amplitude_mm or 0.0) <= bounds.stroke_max_mm + 0.02
    assert all(2.0 * math.pi * one.amplitude_mm <= bounds.speed_max_mm_per_s + 1e-9 for one in bench.told)


@pytest.mark.parametrize(
    ("bounds", "piston", "most_mm", "what"),
    [
        (
            StrokeBounds(120.0, 100.0, 600.0, 1000.0),
            Sine(20.47, 20.6),
            20.47,
            "contact: the piston's amplitude is",
        ),
        (
            StrokeBounds(120.0, 100.0, 600.0, 1000.0),
            Sine(100.0, 21.0),
            20.0,
            "travel of the piston, to 120.00 mm",
        ),
        (
            StrokeBounds(120.0, 100.0, 600.0, 100.0),
            Sine(60.0, 21.0),
            15.915,
            "speed of the piston, at most 100 mm/s",
        ),
    ],
)
def test_the_one_limit_that_holds_is_named(
    bounds: StrokeBounds, piston: Sine, most_mm: float, what: str
) -> None:
    assert bounds.kept(piston, 1.0).amplitude_mm == pytest.approx(most_mm, abs=0.001)
    assert bounds.holding(piston, 1.0).startswith(what)


def test_where_a_sine_cannot_be_changed_its_cycles_are_named() -> None:
    bench = Bench(LinearStand(), can_adjust=False)
    look, heard = looked(bench, 1.0)
    row = look.end()
    assert row is not None
    assert bench.told == []
    assert row.cycles_off == f"1-{row.cycles}"
    assert row.is_off(StrokeTable())
    assert len([text for text in heard.warnings if text.startswith("WARNING: after cycle 1: ")]) == 1


def test_numbers_are_written_as_spans() -> None:
    assert spans([]) == ""
    assert spans([1, 2, 3, 6]) == "1-3, 6"
    assert spans([4]) == "4"
    assert spans(list(range(1, 99, 2))).endswith("23, …")


def test_off_is_either_of_amplitude_and_mean() -> None:
    asked = Sine(40.0, 10.0)
    assert not is_off(asked, Sine(40.09, 10.04), 0.5, 0.1)
    assert is_off(asked, Sine(40.0, 9.94), 0.5, 0.1)
    assert is_off(asked, Sine(40.11, 10.0), 0.5, 0.1)


def test_less_than_the_turns_are_known_by_is_left() -> None:
    seen = LinearStand().cycle(Sine(50.0, 20.0), 1.0)
    asked = Sine(seen.stroke.mean_mm + 0.03, seen.stroke.amplitude_mm)
    command = Sine(50.0, 20.0)
    bounds: dict[str, Any] = {"gain": 1.0, "give_mm_per_kN": 0.01, "bounds": WIDE}
    assert corrected(asked, command, seen, **bounds)[0] != command
    assert corrected(asked, command, replace(seen, u_mm=0.05), **bounds)[0] == command
