"""Does the stand measure what it moves? Wrong wiring is named in the first slow motion, right stands pass."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.guards.trips import Action
from bufferstand.daq.guards.wiring.first_touch import TouchOutcome, doubt_of_touch
from bufferstand.daq.guards.wiring.sample_stretch import SampleStretch
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.foundation.numbers.wrong_factor import likeness
from bufferstand.recording.runfile.file import open_run
from tests.daq.miswiring import UNTOUCHED, Misread, run_miswired
from tests.daq.stroke_bench import Case as StandCase
from tests.daq.wiring_bench import Case, Signals, judge, signals_of
from tests.daq.wiring_kinds import (
    LATER,
    THERMAL,
    WARM,
    WIRED,
    false_alarms,
    plain_case,
    warm_alarms,
)

FIRST_FIFTH = 0.2
RIGHT = (2, 6, 11)
"""Seeds of short campaigns: with and without a touch, a second force, a second wire."""


@cache
def usual() -> Signals:
    return signals_of(Case())


@cache
def warm() -> Signals:
    return signals_of(WARM)


@pytest.mark.parametrize("name", WIRED)
def test_wrong_wiring_is_named_in_the_first_fifth_of_the_first_stroke(name: str) -> None:
    kind = WIRED[name]
    verdict = judge(kind.wrong(usual()))
    assert verdict.trip is not None
    assert verdict.share < FIRST_FIFTH
    assert verdict.trip.sensor in kind.sensors
    assert verdict.trip.doubt in kind.doubts
    assert verdict.trip.device_fault
    assert verdict.trip.action is Action.STOP
    assert "stand file" in verdict.trip.reason
    assert verdict.trip.setting in verdict.trip.reason


@pytest.mark.parametrize("name", LATER)
def test_a_wire_that_slips_is_named_at_once(name: str) -> None:
    signals, kind = usual(), LATER[name]
    verdict = judge(kind.wrong(signals))
    assert verdict.trip is not None
    assert (verdict.trip.sensor, verdict.trip.doubt) == (kind.sensors[0], kind.doubts[0])
    slipped_s = float(signals.time_s[int(np.argmax(signals.true_mm > 0.5 * signals.first_full_mm))])
    assert verdict.at_s - slipped_s < 0.5


@pytest.mark.parametrize("name", ["thermometers swapped", "falls off, 60 s", "repeats an old value"])
def test_a_thermometer_that_does_not_show_the_heat_is_named(name: str) -> None:
    kind = THERMAL[name]
    verdict = judge(kind.wrong(warm()))
    assert verdict.trip is not None
    assert verdict.trip.sensor in kind.sensors
    assert verdict.trip.doubt in kind.doubts


@pytest.mark.long
@pytest.mark.parametrize("name", THERMAL)
@pytest.mark.parametrize("capacity", [0.7, 1.4])
def test_thermometers_of_light_and_heavy_springs(name: str, capacity: float) -> None:
    kind = THERMAL[name]
    verdict = judge(kind.wrong(signals_of(replace(WARM, capacity_times=capacity))))
    assert verdict.trip is not None
    assert verdict.trip.sensor in kind.sensors


def test_right_campaigns_are_not_doubted() -> None:
    assert false_alarms(RIGHT) == []
    assert judge(warm()).trip is None


@pytest.mark.long
def test_two_hundred_right_campaigns_are_not_doubted() -> None:
    assert false_alarms(range(200)) == []
    assert warm_alarms(range(20)) == []


@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
def test_every_kind_is_found_on_stands_at_random(seed: int) -> None:
    signals = signals_of(plain_case(seed))
    missed = [name for name, kind in WIRED.items() if judge(kind.wrong(signals)).trip is None]
    assert missed == []


# --- whole campaigns ---------------------------------------------------------------------------------


def test_a_doubt_ends_a_campaign_as_a_device_fault_with_its_facts(tmp_path: Path) -> None:
    ran = run_miswired(tmp_path, {"stroke_1": Misread(0.5), "stroke_2": Misread(0.5)})
    assert (ran.outcome.status, ran.outcome.exit_status) == ("stopped", 4)
    assert ran.furthest_mm < FIRST_FIFTH * 50.0
    assert ran.outcome.safe_stop is not None
    assert ran.outcome.safe_stop.safe
    trip = next(event for event in open_run(ran.outcome.runs[0]).events if event.kind == "trip")
    assert trip.data["sensor"] == "stroke_1, stroke_2"
    assert trip.data["doubt"] == "scale"
    record = json.loads((ran.folder / "campaign.json").read_text(encoding="utf-8"))
    assert record["stopped_by"] == "wiring of stroke_1, stroke_2"
    assert record["trip"]["doubt"] == "scale"
    assert "calibration" in record["trip"]["setting"]


@pytest.mark.parametrize(
    ("wrong", "sensor"),
    [
        ({"force": Misread(-1.0)}, "force"),
        ({"force": Misread(0.1), "force_2": Misread(0.1)}, "force"),
        ({"position": Misread(-1.0)}, "position"),
    ],
)
def test_a_wrong_force_or_piston_is_named_while_first_contact_is_touched_off(
    tmp_path: Path, wrong: dict[str, Misread], sensor: str
) -> None:
    ran = run_miswired(tmp_path, wrong)
    assert ran.outcome.exit_status == 4
    assert f"name = “{sensor}”" in ran.outcome.reason
    assert ran.most_kN < 3.0


def test_a_right_stand_that_was_not_touched_off_passes_and_a_wrong_sign_is_named_there(
    tmp_path: Path,
) -> None:
    right = run_miswired(tmp_path / "right", {}, case=StandCase(more=UNTOUCHED, softening=1.0))
    assert right.outcome.exit_status == 0, right.outcome.reason
    wrong = run_miswired(
        tmp_path / "wrong", {"stroke_1": Misread(-1.0)}, case=StandCase(more=UNTOUCHED, softening=1.0)
    )
    assert wrong.outcome.exit_status == 4
    assert "stroke_1 goes" in wrong.outcome.reason
    assert "sign" in wrong.outcome.reason


def test_a_doubt_can_be_made_a_note_which_is_said_once(tmp_path: Path) -> None:
    noted = StandCase(more='[guards.action]\nwiring = "note"\n', softening=1.0)
    ran = run_miswired(tmp_path, {"force_2": Misread(0.8)}, case=noted)
    assert ran.outcome.exit_status == 0, ran.outcome.reason
    assert sum("force_2 reads" in line for line in ran.lines) == 1


@pytest.mark.long
@pytest.mark.parametrize("factor", [0.6, 1.4])
def test_a_specimen_that_is_forty_per_cent_off_its_model_passes(tmp_path: Path, factor: float) -> None:
    ran = run_miswired(tmp_path, {}, factor=factor)
    assert ran.outcome.exit_status == 0, ran.outcome.reason


# --- parts -------------------------------------------------------------------------------------------


def touch(
    sign: float = 1.0, late_s: float = 0.0, gain: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time, force and position of a touch: 120 kN/mm, 0.5 mm/s, 1.2 kN."""
    random, time = np.random.default_rng(1), np.arange(0.0, 8.0, 0.001)
    place = np.interp(time, [0.0, 1.0, 4.0, 7.0, 8.0], [-1.49, -1.49, 0.01, -1.49, -1.49])
    true = 120.0 * np.maximum(place, 0.0)
    force = sign * gain * np.interp(time - late_s, time, true) + 0.05 * random.standard_normal(time.size)
    return time, force, place + 0.003 * random.standard_normal(time.size)


@pytest.mark.parametrize(
    ("how", "kind"),
    [({}, None), ({"sign": -1.0}, "sign"), ({"gain": 0.1}, "scale"), ({"late_s": 0.8}, "delay")],
)
def test_a_touch_shows_sign_scale_and_delay_of_the_force(how: dict[str, float], kind: str | None) -> None:
    time, force, place = touch(**how)
    stretch = SampleStretch(time, {"force": force, "position": place})
    doubt = doubt_of_touch(
        TouchOutcome(stretch, 1.2, turned=True, own_kN=0.0), WiringGuard(frame_kN_per_mm=150.0)
    )
    assert (None if doubt is None else doubt.kind) == kind


@pytest.mark.parametrize(
    ("ratio", "word"), [(0.1, "tenth"), (10.1, "ten times"), (0.102, "tonnes"), (25.4, "inches"), (1.3, "")]
)
def test_a_wrong_factor_is_told_by_what_it_looks_like(ratio: float, word: str) -> None:
    assert word in likeness(ratio)
    assert bool(likeness(ratio)) == bool(word)
