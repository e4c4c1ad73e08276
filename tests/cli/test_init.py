"""The guided beginning: what it writes is valid together, commented, and takes no other file's place."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.cli.beginning import CAMPAIGNS, CONTROLLERS, Answers, parse_certificate, write_first_files
from bufferstand.cli.campaign import prepare
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from tests.cli.processes import bufferstand
from tests.terminals import in_terminal


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("campaign", CAMPAIGNS)
def test_every_choice_makes_files_that_can_be_planned(tmp_path: Path, campaign: str, controller: str) -> None:
    answers = Answers(campaign=campaign, controller=controller, second_force=controller == "ring")
    written = write_first_files(tmp_path, answers)
    assert [path.name for path in written[:2]] == ["stand.toml", f"{campaign}.toml"]
    prepared = prepare(tmp_path / f"{campaign}.toml")
    assert prepared.stand_file.controller.profile == controller
    assert prepared.plan.knows_heat
    assert prepared.specimen_file.specimen.id == "A-0001"
    for path in written[:-1]:  # the last is the shipped model
        assert path.read_text().startswith("#"), f"{path.name} says what it is"


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
        terminal.press("15021\n" + "\n" * 11)
        assert terminal.end() == 0
    stand = load_stand(tmp_path / "lab" / "stand.toml")
    assert (stand.stand.laboratory, stand.controller.port, stand.controller.profile) == (
        "Hall 7",
        15021,
        "polling",
    )
