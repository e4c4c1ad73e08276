"""Wrong wiring that a touch meets is named before the first full stroke; right stands pass."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bufferstand.daq.guards.wiring.doubt import channel_setting
from bufferstand.daq.guards.wiring.exchanged_inputs import exchanged
from bufferstand.daq.guards.wiring.first_touch import scatter_doubt
from bufferstand.daq.guards.wiring.piston_scale import misled
from bufferstand.daq.guards.wiring.sample_stretch import SampleStretch
from bufferstand.recording.runfile.file import open_run
from tests.daq.touch_stands import HELD, KINDS, Kind, Ran, alarms, run_stand, wrong

ALWAYS = (
    "force: five times", "force: 0.4 s late", "force: the piston's way", "piston: half", "force and wire",
    "force and piston", "both wires 15 mm off",
)  # fmt: skip
SHOWN_BY_SECOND = ("force: a hundredth", "force and wire in the file")
"""Without a second force the specimen is pressed farther before it shows, or less can be said of it."""


def demand_named(ran: Ran, kind: Kind) -> None:
    assert ran.outcome.exit_status == 4, ran.outcome.reason
    assert (ran.trip["sensor"], ran.trip["doubt"] in kind.doubts) == (kind.sensor, True), ran.outcome.reason
    assert ran.trip["guard"] == f"wiring of {kind.sensor}"
    assert all(f"“{name}”" in ran.trip["setting"] for name in kind.sensor.split(", ") if name != "force_2")
    assert ran.trip["setting"] in ran.outcome.reason
    assert ran.most_kN < kind.most_kN
    assert ran.outcome.safe_stop is not None
    assert ran.outcome.safe_stop.safe is kind.seen_safe, ran.outcome.safe_stop.line


@pytest.mark.dose(4)
@pytest.mark.parametrize("name", ALWAYS)
def test_wrong_wiring_that_the_touch_meets_is_named(tmp_path: Path, name: str) -> None:
    demand_named(run_stand(tmp_path, miswired=KINDS[name].tables), KINDS[name])


@pytest.mark.long
@pytest.mark.parametrize("name", KINDS)
def test_every_kind_is_named_with_and_without_a_second_force(tmp_path: Path, name: str) -> None:
    demand_named(run_stand(tmp_path / "two", miswired=KINDS[name].tables), KINDS[name])
    one = run_stand(tmp_path / "one", miswired=KINDS[name].tables, amplifier=False)
    if name not in SHOWN_BY_SECOND:
        demand_named(one, KINDS[name])
    assert one.outcome.exit_status == 4
    assert "“force”" in one.trip["setting"] or "force" not in KINDS[name].sensor


def test_right_stands_are_not_doubted_in_the_touch(tmp_path: Path) -> None:
    # 191: the piston backs off a contact at its own zero, and the draw wires read 8 mm.
    assert alarms(tmp_path, (79, 191)) == []


@pytest.mark.long
def test_two_hundred_right_stands_are_not_doubted_in_the_touch(tmp_path: Path) -> None:
    assert alarms(tmp_path, range(200)) == []


def test_a_doubt_of_a_touch_that_is_only_noted_is_an_event_of_the_next_run(tmp_path: Path) -> None:
    late = wrong("force", delay_s=0.5, controller_too=False)
    noted = '[guards.action]\nwiring = "note"\n'
    ran = run_stand(tmp_path, miswired=late, head=noted, steps=HELD)
    assert any(line.startswith("WARNING: force ") for line in ran.lines)
    events = [event for event in open_run(ran.outcome.runs[0]).events if event.data.get("before_s")]
    assert [(event.kind, event.data["doubt"], event.data["sensor"]) for event in events] == [
        ("note", "delay", "force")
    ]
    assert "delay_s" in events[0].data["setting"]
    assert "late" in events[0].text


def test_a_doubt_that_ends_a_campaign_without_a_run_is_in_its_record(tmp_path: Path) -> None:
    ran = run_stand(tmp_path, miswired=KINDS["piston: half"].tables)
    assert ran.outcome.runs == ()
    record = json.loads((ran.folder / "campaign.json").read_text(encoding="utf-8"))
    kept = record["starts"][-1]["trip"]
    assert kept["doubt"] == "scale"
    assert kept["sensor"] == "position"
    assert kept["reason"] == ran.outcome.reason
    assert kept == {**record["trip"], "reason": record["reason"]}


# --- parts -------------------------------------------------------------------------------------------

TIME = np.arange(0.0, 4.0, 0.001)
WAY = np.interp(TIME, [0.0, 1.0, 4.0], [0.0, 0.0, 1.5])
PUSHED = 120.0 * np.maximum(WAY - 1.45, 0.0)


def stretch(**values: np.ndarray) -> SampleStretch:
    """Return a creep to 6 kN at 0.5 mm/s, of a stiff specimen, with some channels replaced."""
    random = np.random.default_rng(3)
    still = 0.01 * random.standard_normal(TIME.size)
    right = {
        "command": WAY, "position": WAY + 0.005 * random.standard_normal(TIME.size),
        "stroke_1": still, "stroke_2": still[::-1], "force": PUSHED + still,
    }  # fmt: skip
    return SampleStretch(TIME, {**right, **values})


def test_a_wire_that_slips_is_not_taken_for_a_force_nor_a_right_force_for_a_wire() -> None:
    assert exchanged(stretch()) is None
    slipped = stretch(stroke_1=np.where(TIME > 3.95, 6.0, 0.0), force=0.0 * TIME)
    assert exchanged(slipped) is None
    both = exchanged(stretch(stroke_1=PUSHED, force=0.0 * TIME))
    assert both is not None
    assert both.sensor == "force, stroke_1"


@pytest.mark.parametrize(
    ("times", "kind"),
    [(1.0, None), (1.05, None), (0.5, "scale"), (-1.0, "sign"), (25.4, "scale"), (0.0, "still")],
)
def test_a_slow_way_of_a_millimetre_shows_the_scale_of_the_position(times: float, kind: str | None) -> None:
    doubt = misled(stretch(position=times * WAY), follows=True)
    assert (None if doubt is None else doubt.kind) == kind


def test_a_piston_that_may_not_follow_has_no_wrong_scale() -> None:
    assert misled(stretch(position=0.5 * WAY, force=0.0 * TIME), follows=False) is None
    assert misled(stretch(position=0.0 * WAY, force=0.0 * TIME), follows=True) is None, (
        "its valve may be shut"
    )


def test_each_channel_of_a_doubt_is_an_entry_of_its_own_in_the_stand_file() -> None:
    assert channel_setting("stroke_1, force_2", "calibration") == (
        "[[controller.channel]] name = “stroke_1”, calibration and [amplifier.channel] calibration"
    )


def test_a_force_that_scatters_is_held_against_the_second_one() -> None:
    random = np.random.default_rng(1)
    doubt = scatter_doubt(1.5 * random.standard_normal(1000), 0.15 * random.standard_normal(50), 2.0)
    assert (doubt.sensor, doubt.kind) == ("force", "scale")
    assert "times as much as force_2" in doubt.text
    assert "force_2" not in scatter_doubt(1.5 * random.standard_normal(1000), np.empty(0), 2.0).text
