"""``resume`` goes on as the campaign was begun, and says what is another since."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pytest

from bufferstand.cli.arming import Consent
from bufferstand.cli.campaign import resume_checks as as_begun
from bufferstand.cli.campaign.preparation import PreparedCampaign, prepare
from bufferstand.cli.campaign.resume_checks import (
    accepted_changes,
    accepted_serial,
    demand_same_kind,
    going_on_simulated,
)
from bufferstand.daq.campaign_folder.first_start import CampaignStart, begun, software_version
from bufferstand.daq.campaign_folder.folder import CampaignFolder, CampaignRecord
from bufferstand.drivers.connect import ControllerAnswer
from bufferstand.drivers.interfaces import Identity
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.cli.test_edits import Lab

WAS = Identity("ring", "10.0.0.1:502", "4711", "ring edition 3 sha256 aa", 1000.0)
OTHER = Identity("ring", "10.0.0.1:502", "4712", "ring edition 3 sha256 aa", 1000.0)
SLOWER = Identity("ring", "10.0.0.1:502", "4711", "ring edition 3 sha256 aa", 500.0)
REAL = CampaignStart(simulate=False, simulated=False, controller=asdict(WAS), software=software_version())
YES_MOVE = Consent("specimen", "A", "tester", "2026-11-24T12:00:00+00:00", "--yes-move")


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


def restart(lab: Lab, **start: object) -> CampaignRecord:
    """Give the newest start other facts."""
    record = lab.record
    *before, last = record.starts
    CampaignFolder(lab.out).save(CampaignRecord(**{**vars(record), "starts": (*before, last | start)}))
    return lab.record


# --- on which kind of stand -------------------------------------------------------------------------


def test_a_campaign_begun_simulated_goes_on_so_at_its_speed_and_says_it(
    lab: Lab, capsys: pytest.CaptureFixture[str]
) -> None:
    record = restart(lab, speed=8.0)
    assert going_on_simulated(record, lab.out, simulate=False, speed=None) == (True, 8.0)
    said = capsys.readouterr().err
    assert "begun with --simulate" in said
    assert "at 8 times real time; the real stand is not touched" in said
    assert going_on_simulated(record, lab.out, simulate=True, speed=2.0) == (True, 2.0)
    assert capsys.readouterr().err == ""


def test_a_campaign_begun_on_the_stand_is_never_continued_on_a_simulated_one(lab: Lab) -> None:
    record = restart(lab, simulate=False, simulated=False)
    assert going_on_simulated(record, lab.out, simulate=False, speed=None) == (False, 1.0)
    with pytest.raises(BadInput, match="real and simulated runs never come into one folder"):
        going_on_simulated(record, lab.out, simulate=True, speed=None)


def test_the_kind_of_stand_is_fixed_from_the_beginning_nothing_recorded_or_not(tmp_path: Path) -> None:
    lab = Lab(tmp_path, done=False)
    record = restart(lab, simulate=False, simulated=None)
    with pytest.raises(
        BadInput, match="begun on the stand that its stand file leads to, and goes on there only"
    ):
        going_on_simulated(record, lab.out, simulate=True, speed=3.0)
    with pytest.raises(BadInput, match="never come into one folder; give --out another folder"):
        demand_same_kind(record, lab.out, simulate=True)
    demand_same_kind(record, lab.out, simulate=False)
    record = restart(lab, simulate=True, simulated=True)
    with pytest.raises(BadInput, match="begun with --simulate: real and simulated runs never"):
        demand_same_kind(record, lab.out, simulate=False)
    assert begun(record, lab.out).simulated is True
    record = restart(lab, simulate=False, simulated=True)
    assert begun(record, lab.out).simulated is True, "a served simulated stand binds as well"


def test_a_speed_for_a_real_stand_is_refused_without_sending_to_another_option(lab: Lab) -> None:
    record = restart(lab, simulate=False, simulated=False)
    with pytest.raises(
        BadInput, match=r"--speed: this campaign was begun on .* cannot go at 5 times"
    ) as refused:
        going_on_simulated(record, lab.out, simulate=False, speed=5.0)
    assert "--simulate" not in refused.value.message()


# --- what is another ---------------------------------------------------------------------------------


def changes(
    monkeypatch: pytest.MonkeyPatch,
    lab: Lab,
    look: ControllerAnswer | None,
    *,
    known: CampaignStart = REAL,
    accept: str | None = None,
    served: bool = False,
    consent: Consent = YES_MOVE,
) -> tuple[dict[str, object], ...]:
    """Return what is accepted where ``look`` is what answers (None: nobody does)."""

    def answer(_: object) -> ControllerAnswer:
        if look is None:
            raise DeviceFault("nobody answers")
        return look

    monkeypatch.setattr(as_begun, "look_at_controller", answer)
    prepared: PreparedCampaign = prepare(lab.campaign)
    return accepted_changes(prepared, known, simulate=False, served=served, consent=consent, accept=accept)


def test_the_same_controller_and_software_are_not_mentioned(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert changes(monkeypatch, lab, ControllerAnswer(WAS, simulated=False)) == ()
    assert changes(monkeypatch, lab, ControllerAnswer(WAS, simulated=False), accept="4711") == ()
    assert changes(monkeypatch, lab, None) == (), "the start will say that nobody answers"
    assert capsys.readouterr().err == ""


def test_another_serial_number_is_refused_without_consent(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadInput, match="another controller answers, with the serial number 4712") as refused:
        changes(monkeypatch, lab, ControllerAnswer(OTHER, simulated=False))
    assert "--accept-controller 4712" in refused.value.remedy
    assert "the controller’s serial number: 4711 → 4712" in capsys.readouterr().err
    with pytest.raises(BadInput, match="“4711” was given, and the controller that answers is “4712”"):
        changes(monkeypatch, lab, ControllerAnswer(OTHER, simulated=False), accept="4711")
    with pytest.raises(BadInput, match="“4712” was given, and no such controller answers"):
        changes(monkeypatch, lab, ControllerAnswer(WAS, simulated=False), accept="4712")
    taken = changes(monkeypatch, lab, ControllerAnswer(OTHER, simulated=False), accept="4712")
    assert [(one["now"], one["accepted"]) for one in taken] == [("4712", "--accept-controller")]
    assert accepted_serial(taken) == "4712"


@pytest.mark.slow
def test_other_differences_are_recorded_where_nobody_can_be_asked(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    firmware = Identity(WAS.device, WAS.address, WAS.serial, "ring edition 3 sha256 bb", 1000.0)
    known = CampaignStart(simulate=False, simulated=False, controller=asdict(WAS), software="0.0.9")
    taken = changes(monkeypatch, lab, ControllerAnswer(firmware, simulated=False), known=known)
    assert [(one["before"], one["now"], one["accepted"]) for one in taken] == [
        ("ring edition 3 sha256 aa", "ring edition 3 sha256 bb", "not asked: recorded"),
        ("0.0.9", software_version(), "not asked: recorded"),
    ]
    assert accepted_serial(taken) == ""
    said = capsys.readouterr().err
    assert f"bufferstand’s version: 0.0.9 → {software_version()}" in said
    assert "sha256 aa → ring edition 3 sha256 bb" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("look", "served"),
    [(ControllerAnswer(WAS, simulated=True), False), (ControllerAnswer(WAS, simulated=False), True)],
)
def test_a_simulated_stand_at_the_real_one_s_address_is_refused_before_anything_is_written(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, look: ControllerAnswer, *, served: bool
) -> None:
    with pytest.raises(BadInput, match=r"a simulated stand answers .* was begun on a real one"):
        changes(monkeypatch, lab, look, served=served)


@pytest.mark.slow
def test_a_real_stand_where_a_served_one_was_is_refused(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    known = CampaignStart(simulate=False, simulated=True, controller=asdict(WAS), software=software_version())
    with pytest.raises(BadInput, match=r"a real stand answers .* was begun on a simulated one"):
        changes(monkeypatch, lab, ControllerAnswer(WAS, simulated=False), known=known)
    assert changes(monkeypatch, lab, ControllerAnswer(OTHER, simulated=True), known=known) == (), (
        "its serial is a seed"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("answer", "look", "question", "accepted"),
    [
        ("4712", OTHER, "Type the serial number", True),
        ("4711", OTHER, "Type the serial number", False),
        ("yes", SLOWER, "Type yes", True),
        ("", SLOWER, "Type yes", False),
    ],
)
def test_at_a_terminal_it_is_asked(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, answer: str, look: Identity, question: str, *, accepted: bool
) -> None:
    asked: list[str] = []

    def types(text: str) -> str:
        asked.append(text)
        return answer

    monkeypatch.setattr(as_begun, "is_terminal", lambda _: True)
    monkeypatch.setattr(as_begun, "typed_line", types)
    typed = replace(YES_MOVE, how="typed")
    if accepted:
        taken = changes(monkeypatch, lab, ControllerAnswer(look, simulated=False), consent=typed)
        assert [one["accepted"] for one in taken] == ["typed"]
    else:
        with pytest.raises(BadInput, match="nothing was moved or written"):
            changes(monkeypatch, lab, ControllerAnswer(look, simulated=False), consent=typed)
    assert [text.startswith(question) for text in asked] == [True]
