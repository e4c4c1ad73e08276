"""What a fault, a corner or a stamp makes beside itself is no second fault."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.loading.resample import as_taken
from bufferstand.evaluation.plausibility.invalid_samples.error_codes import without_codes
from bufferstand.evaluation.plausibility.jumps.sample_steps import largest_leaps
from bufferstand.evaluation.plausibility.run_view.channels import Channels
from bufferstand.evaluation.plausibility.run_view.lone_samples import lone_rows
from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.plausibility.run_view.view import RunView
from bufferstand.evaluation.plausibility.signal_comparison.draw_wires import check_wires
from bufferstand.evaluation.plausibility.signal_comparison.stroke_sensors import strokes_and_piston
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.record.signals import Signals
from tests.evaluation.plausibility.records import Floats, of_kind, static


def test_a_rest_that_begins_frozen_tells_no_drift() -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        rows = np.arange(time_s.size)
        last = int(np.flatnonzero(stroke > 60.0)[-1])
        return time_s, stroke, np.where((rows >= last) & (rows < rows[-1] - 200), force[last], force)

    run = static(change)
    assert of_kind(run, "frozen")
    assert not of_kind(run, "drift")
    assert not of_kind(run, "offset-jump")


def test_the_corner_before_a_specimen_is_let_go_is_no_spike() -> None:
    force = np.array([1.061, 1.178, 1.28, 1.376, 1.463, 0.813, 0.1, -0.075, -0.111, -0.122, -0.12])
    time_s = 0.02 * np.arange(force.size)
    assert not lone_rows(time_s, force, 0.1, [slice(0, force.size)]).size
    spike = force.copy()
    spike[2] += 0.6
    assert lone_rows(time_s, spike, 0.1, [slice(0, force.size)]).tolist() == [2]


def test_a_wire_that_slips_near_a_turn_does_not_leave_the_other_one_still() -> None:
    time_s = np.arange(1600) / 160.0
    one = 10.0 * np.sin(np.pi * time_s)
    two = one.copy()
    two[time_s > 2.503] += 3.0  # the stroke turns at 2.5 s
    record = make_record(time_s, 0.5 * (one + two), 5.0 * one, wire_difference_mm=one - two)
    wires = check_wires(record, RunFacts("w", "harmonic"))[2]
    assert wires is not None
    assert not wires.out


def test_a_channel_goes_on_behind_a_clock_that_was_set_back() -> None:
    true_s = np.arange(400) * 0.01
    stamps_s = np.where(true_s > 2.0, true_s - 0.3, true_s)
    time_s, value = as_taken(stamps_s, true_s)
    assert time_s == pytest.approx(true_s)
    assert value == pytest.approx(true_s)


def test_codes_are_no_signals() -> None:
    time_s = np.arange(400) * 0.01
    force = 100.0 + 50.0 * np.sin(time_s)
    force[200] = 999999.0
    record = make_record(time_s, np.sin(time_s), force)
    between_s = time_s[:-1] + 0.003  # a signal is interpolated to other instants: half-way to the code
    object.__setattr__(record, "signals", Signals(between_s, {"force": np.interp(between_s, time_s, force)}))
    seen, coded = without_codes(Channels(record))
    assert coded
    assert seen.record.signals is not None
    assert float(np.max(seen.record.signals.by_name["force"])) < 151.0


def test_a_rounded_stamp_makes_no_leap() -> None:
    time_s = 0.02 * np.arange(60)
    force = Samples("force", time_s, 340.0 * time_s)
    early = Samples(
        "force", time_s - 0.01 * (np.arange(60) >= 30) + 0.01 * (np.arange(60) >= 31), force.value
    )
    assert all(abs(leap.size) < 1e-6 for leap in largest_leaps(early, (), 5))


def test_a_spike_of_the_force_makes_no_zero_of_the_stroke() -> None:
    time_s = np.arange(2000) * 0.01
    stroke = np.maximum(0.0, 50.0 * np.sin(0.3 * time_s))
    force = 8.0 * stroke + 0.05 * np.random.default_rng(1).standard_normal(time_s.size)
    force[900] = 32767.0
    record = make_record(time_s, stroke, force)
    signals = Signals(time_s, {"force": force, "stroke_1": stroke, "stroke_2": stroke})
    look = RunView(record, record, (), RunFacts("z", "static"))
    assert not strokes_and_piston(look, signals, None)
