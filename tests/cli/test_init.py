"""The guided beginning: what it writes is valid together, commented, and takes no other file's place."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.cli.beginning import (
    CAMPAIGNS,
    CONTROLLERS,
    NONE,
    Answers,
    parse_certificate,
    parse_coefficients,
    write_first_files,
)
from bufferstand.cli.campaign import prepare
from bufferstand.drivers.check import check_stand
from bufferstand.drivers.controllers import controller_kinds
from bufferstand.drivers.simulated.serving import start_process
from bufferstand.drivers.stand_file import load_recording_stand, load_stand, with_endpoints
from bufferstand.foundation import BadInput, WallClock
from bufferstand.foundation.specimen import load_specimen
from tests.cli.processes import bufferstand
from tests.terminals import in_terminal

MOVING = [name for name in CONTROLLERS if name != NONE]
CHECKED = [
    {"controller": "ring", "draw_wires": 1, "thermometers": 1},
    {"controller": "rmc", "draw_wires": 3, "further": ("pressure",)},
    {"controller": "polling", "draw_wires": 1, "second_force": False},
    {"draw_wires": 4, "thermometers": 5, "further": ("pressure", "acceleration")},
    {"coefficients": {"force": (0.5, 1.1e-4), "stroke_1": (-40.0, 0.008)}},
]


@pytest.mark.parametrize("controller", MOVING)
@pytest.mark.parametrize("campaign", CAMPAIGNS)
def test_every_choice_makes_files_that_can_be_planned(tmp_path: Path, campaign: str, controller: str) -> None:
    answers = Answers(campaign=campaign, controller=controller, second_force=controller == "ring")
    written = write_first_files(tmp_path, answers)
    assert [path.name for path in written[:2]] == ["stand.toml", f"{campaign}.toml"]
    prepared = prepare(tmp_path / f"{campaign}.toml")
    stated = prepared.stand_file.controller
    assert (stated.kind, stated.profile) == ("rmc" if controller == "rmc" else "registers", controller)
    assert prepared.plan.knows_heat
    assert prepared.specimen_file.specimen.id == "A-0001"
    for path in written[:-1]:  # the last is the shipped model
        assert path.read_text().startswith("#"), f"{path.name} says what it is"


def test_every_kind_of_controller_of_the_catalogue_can_be_begun_with() -> None:
    offered = {"registers" if name in ("ring", "polling") else name for name in MOVING}
    ours = {kind.name for kind in controller_kinds() if type(kind).__module__.startswith("bufferstand.")}
    assert offered == ours


@pytest.mark.parametrize("more", CHECKED, ids=str)
def test_other_channels_and_coefficients_make_a_stand_that_is_valid(
    tmp_path: Path, more: dict[str, Any]
) -> None:
    answers = Answers(**more)
    write_first_files(tmp_path, answers)
    stand = load_stand(tmp_path / "stand.toml")
    channels = {one.name: one for one in stand.controller.channel}
    wires = [name for name in channels if name.startswith("stroke_")]
    assert sorted(wires) == [f"stroke_{number}" for number in range(1, answers.draw_wires + 1)]
    for name in answers.further:
        assert channels[f"{name}_1"].quantity == name
    for name, pair in answers.coefficients.items():
        assert channels[name].calibration.coefficients == pair
    sensors = stand.temperature[0].sensor
    assert sum(one.role == "specimen" for one in sensors) == answers.thermometers
    assert len({one.rom for one in sensors}) == len({one.name for one in sensors}) == len(sensors)
    text = (tmp_path / "stand.toml").read_text()
    assert ("= zero + slope × reading" in text) == bool(answers.coefficients)


@pytest.mark.slow
@pytest.mark.dose(2)
@pytest.mark.parametrize("more", CHECKED, ids=str)
def test_check_reads_the_twin_of_every_such_stand_at_once(tmp_path: Path, more: dict[str, Any]) -> None:
    """What it says of rates and clocks is this computer's business."""
    answers = Answers(**more)
    write_first_files(tmp_path, answers)
    stand = tmp_path / "stand.toml"
    with start_process(stand, directory=tmp_path, speed=1.0) as twin:
        served = with_endpoints(load_stand(stand), twin.served.endpoints())
        found = check_stand(served, WallClock(), watch_s=1.0)
    devices = {row.device for row in found}
    assert {"controller", "temperature_1"} <= devices
    assert not [row for row in found if row.item in ("connection", "identity") and row.verdict == "fault"]
    values = {row.item for row in found if row.device == "controller"}
    for channel in load_stand(stand).controller.channel:
        assert any(channel.name in item for item in values), f"{channel.name} of {sorted(values)}"


@pytest.mark.parametrize("wires", [1, 2, 4])
def test_a_stand_that_another_controller_moves_is_recorded_only(tmp_path: Path, wires: int) -> None:
    answers = Answers(
        controller=NONE,
        draw_wires=wires,
        host="192.0.2.9",
        port=502,
        coefficients={"force": (1.5, 62.0)},
        certificates=dict([parse_certificate("force=K-17@2031-05-01")]),
    )
    written = write_first_files(tmp_path, answers)
    assert not (tmp_path / "en15551.toml").exists()
    stand = load_recording_stand(written[0])
    channels = {channel.name: channel for _, channel in stand.channels()}
    strokes = [f"stroke_{number}" for number in range(1, wires + 1)]
    temperatures = [f"temperature_{number}" for number in (1, 2, 3)]
    assert list(channels) == ["force", *strokes, "force_2", *temperatures]
    assert channels["force"].calibration.coefficients == (1.5, 62.0)
    assert channels["force"].calibration.certificate == "K-17"
    assert written[0].read_text().startswith("#")
    done = bufferstand("init", tmp_path / "lab", "--yes", "--controller", "none")
    assert done.returncode == 0
    assert f"record {tmp_path}/lab/stand.toml" in done.stdout


def test_a_polled_controller_has_no_channels_of_which_no_register_is_known(tmp_path: Path) -> None:
    for more in ({"draw_wires": 3}, {"further": ("pressure",)}):
        with pytest.raises(BadInput, match="those of further ones are not known; nothing was written"):
            write_first_files(tmp_path / "lab", Answers(controller="polling", **more))
    assert not (tmp_path / "lab").exists()


@pytest.mark.parametrize("system", ["elastomer", "rubber-steel", "ring-spring"])
@pytest.mark.parametrize("kind", ["buffer", "draw-gear"])
def test_every_kind_of_specimen_has_a_static_test(tmp_path: Path, kind: str, system: str) -> None:
    answers = Answers(
        kind=kind,
        elastic_system=system,
        category="" if kind == "draw-gear" else "C",
        max_stroke_mm=75.0,
        model=False,
    )
    write_first_files(tmp_path, answers)
    plan = prepare(tmp_path / "en15551.toml").plan
    assert plan.steps
    assert not plan.knows_heat


@settings(max_examples=25, deadline=None)
@given(
    stand=st.text(st.characters(exclude_categories=["Cs", "Cc", "Cf"]), min_size=1, max_size=30),
    specimen=st.text(st.characters(exclude_categories=["Cs", "Cc", "Cf"]), max_size=20).map(
        lambda text: f"X{text}"
    ),
)
def test_any_name_is_taken_as_it_is(
    tmp_path_factory: pytest.TempPathFactory, stand: str, specimen: str
) -> None:
    folder = tmp_path_factory.mktemp("first")
    written = write_first_files(
        folder, Answers(stand=stand, specimen=specimen, laboratory=stand, operator=specimen)
    )
    assert load_stand(written[0]).stand.id == stand
    assert load_specimen(written[2]).specimen.id == specimen
    assert all(path.is_relative_to(folder) for path in written)


def test_certificates_go_into_their_channels_and_the_rest_says_that_it_has_none(tmp_path: Path) -> None:
    named = dict(parse_certificate(text) for text in ("force=K-17@2031-05-01", "stroke_1=W-3"))
    write_first_files(tmp_path, Answers(certificates=named))
    channels = {one.name: one.calibration for one in load_stand(tmp_path / "stand.toml").controller.channel}
    assert channels["force"].certificate == "K-17"
    assert channels["force"].valid_until == date(2031, 5, 1)
    assert (channels["stroke_1"].certificate, channels["stroke_1"].valid_until) == ("W-3", None)
    assert channels["stroke_2"].certificate == ""
    assert "simulated" not in (tmp_path / "stand.toml").read_text().partition("[simulation]")[0].replace(
        "simulated twin", ""
    )


@pytest.mark.parametrize(
    "text", ["force", "=K", "force=", "temper=K", "force=K@tomorrow", "force=K@2031-13-01"]
)
def test_a_certificate_of_another_form_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="--certificate"):
        parse_certificate(text)


@pytest.mark.parametrize(
    "text", ["force", "force=", "force=1", "force=1,2,3", "force=a,b", "force=0,0", "force=nan,1", "x=0,1"]
)
def test_coefficients_of_another_form_are_refused(text: str) -> None:
    with pytest.raises(BadInput, match="--coefficients"):
        parse_coefficients(text)
    assert parse_coefficients("stroke_1 = -40; 8e-3") == ("stroke_1", (-40.0, 0.008))


def test_nothing_is_written_over_and_nothing_half(tmp_path: Path) -> None:
    (tmp_path / "checklist.toml").write_text("mine")
    with pytest.raises(BadInput, match="is there already; nothing was written"):
        write_first_files(tmp_path, Answers())
    assert [path.name for path in tmp_path.iterdir()] == ["checklist.toml"]
    with pytest.raises(BadInput, match="no valid campaign, and nothing was written"):
        write_first_files(tmp_path / "other", Answers(campaign="sweeps", max_stroke_mm=45.0, model=False))
    assert not (tmp_path / "other").exists()


def test_the_shipped_spring_stands_for_no_specimen_of_another_kind(tmp_path: Path) -> None:
    for other in ({"elastic_system": "ring-spring"}, {"kind": "draw-gear"}, {"max_stroke_mm": 75.0}):
        with pytest.raises(BadInput, match="give --no-model"):
            write_first_files(tmp_path / "lab", Answers(**other))
    done = bufferstand("init", tmp_path / "lab", "--yes", "--elastic-system", "ring-spring")
    assert done.returncode == 0
    assert "\nmodel = " not in (tmp_path / "lab" / "specimens" / "A-0001.toml").read_text()


def test_without_a_terminal_it_asks_for_options(tmp_path: Path) -> None:
    done = bufferstand("init", tmp_path / "lab")
    assert done.returncode == 2
    assert "there is no terminal to ask at; add --yes" in done.stderr
    done = bufferstand("init", tmp_path / "lab", "--yes", "--campaign", "warm-up")
    assert done.returncode == 0
    assert f"check {tmp_path}/lab/stand.toml" in done.stdout


def test_the_questions_are_asked_with_proposals(tmp_path: Path) -> None:
    with in_terminal("init", tmp_path / "lab", "--controller", "polling") as terminal:
        terminal.wait_for(r"Laboratory \[laboratory\]")
        terminal.press("Hall 7\n")
        terminal.wait_for(r"Id of the stand \[stand-1\]")
        terminal.press("\n")
        terminal.wait_for("Its address")
        terminal.press("\n")
        terminal.wait_for("Its port")
        terminal.press("many\n")
        terminal.wait_for("not a valid integer")
        terminal.press("15021\n" + "\n" * 3)
        terminal.wait_for("Draw wires")
        terminal.press("1\n")
        terminal.wait_for("pressure in the cylinder")
        terminal.press("n\nn\n4\n" + "\n" * 5)
        terminal.wait_for("Are calibration certificates at hand")
        terminal.press("y\n")
        terminal.wait_for("certificate, NUMBER@YYYY-MM-DD")
        terminal.press("K-17@soon\n")
        terminal.wait_for("“soon” is no day")
        terminal.press("K-17@2031-05-01\n")
        terminal.wait_for("ZERO,SLOPE in kN and kN per count")
        terminal.press("0.5,1.1e-4\n" + "\n" * 9)
        assert terminal.end() == 0
    stand = load_stand(tmp_path / "lab" / "stand.toml")
    assert (stand.stand.laboratory, stand.controller.port, stand.controller.profile) == (
        "Hall 7",
        15021,
        "registers.toml",
    )
    force = next(one for one in stand.controller.channel if one.name == "force")
    assert (force.calibration.certificate, force.calibration.coefficients) == ("K-17", (0.5, 1.1e-4))
    assert [one.name for one in stand.controller.channel][1:3] == ["stroke_1", "position"]
    assert sum(one.role == "specimen" for one in stand.temperature[0].sensor) == 4
