"""A campaign with a LabJack beside the controller: on record by both clocks, guarded, lost, there again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.faults import ScheduledFault
from bufferstand.evaluation.document import evaluate_paths
from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.loading.two_clocks import align, with_figures
from bufferstand.recording.runfile import open_run
from bufferstand.recording.sealing import verify
from tests.two_clocks.stands import run, written

pytestmark = pytest.mark.slow


def test_both_clocks_are_on_record_and_the_damping_is_that_of_one_clock(tmp_path: Path) -> None:
    outcome, opened, _ = run(written(tmp_path))
    assert outcome.exit_status == 0, outcome.reason
    (path,) = outcome.runs
    assert [one for one in verify(path) if one.level not in ("ok", "note")] == []
    recorded = open_run(path)
    assert recorded.streams["acquisition"].clock == recorded.streams["controller"].clock == "device"
    guards = recorded.metadata["limits"]["guards"]
    limits = {one["name"]: one for one in guards["channels"]}
    own = limits["force_2 of the acquisition device"]
    assert (own["upper"], own["action"]) == (limits["force"]["upper"], limits["force"]["action"])
    silences = {one["stream"]: one for one in guards["silences"]}
    assert silences["acquisition"]["action"] == "stop"
    clocks = recorded.other_clocks
    # The controller's clock is 20 ppm fast, the device's 35 ppm slow, and 812.0037 s ahead.
    assert clocks.drift("acquisition") == pytest.approx(-55e-6, abs=20e-6)
    said = align(seen := with_figures(recorded))
    assert "aligned by acquisition_stroke_3 against stroke_1" in said[0]
    assert seen.stream_of("force").name == "acquisition"
    truth = opened.truth.arrays()
    force = seen.series("force")
    true_s = (truth["time_us"] - recorded.streams["controller"].first_stamp) * 1e-6
    middle = slice(force.time_s.size // 4, 3 * force.time_s.size // 4)
    left = force.value[middle] - np.interp(force.time_s[middle], true_s, truth["force_kN"])
    speed = np.interp(force.time_s[middle], true_s, np.gradient(truth["force_kN"], true_s))
    late_s = -float(np.dot(left - left.mean(), speed) / np.dot(speed, speed))
    assert abs(late_s) < 2.0 * seen.u_clocks_s("force", "stroke") + 2e-5
    (entry,) = evaluate_paths([path], Options(draws=200))["runs"]
    damping = entry["summary"]["damping"]
    assert damping["expanded_uncertainty"] < 0.02 * damping["value"]
    assert any("aligned by" in text for text in entry["warnings"])


def test_a_device_that_falls_silent_stops_safely_and_is_taken_again(tmp_path: Path) -> None:
    campaign = written(tmp_path)
    outcome, opened, _ = run(campaign, faults=[ScheduledFault("acquisition", "silent", 20.0)])
    assert outcome.exit_status == 4
    assert "acquisition has delivered nothing for" in outcome.reason
    assert "look at cable, power and network" in outcome.reason
    assert outcome.safe_stop is not None
    assert outcome.safe_stop.safe
    assert not opened.device.controller.valve_on
    assert opened.truth.arrays()["force_kN"][-1] == pytest.approx(0.0, abs=0.5)
    kept = open_run(outcome.runs[0])
    assert (kept.status, kept.reason) == ("stopped", outcome.reason)
    assert kept.streams["acquisition"].rows > 0
    again, _, _ = run(campaign)
    assert again.exit_status == 0, again.reason
    assert open_run(again.runs[-1]).status == "complete"
