"""What a stand cannot guard is said, as its guards really are; no specimen of rubber is tested blind."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.campaign.plan import command
from bufferstand.cli.main import main
from bufferstand.daq.guards.kinds.agreement import AgreementGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.daq.guards.missing_guards import demand_thermometers, is_reason, unguarded, unguarded_at
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.prediction.curve_predictor import UnknownSpecimenPredictor
from tests.bounds.files import (
    SINE,
    Files,
    Table,
    base_campaign,
    base_specimen,
    base_stand,
    guards_of,
    with_key,
)

REASON = "two slow strokes of a cold spring"


def blind_stand() -> Table:
    """Return the sample stand with nothing but a controller."""
    stand = base_stand()
    del stand["temperature"], stand["amplifier"]
    return stand


def consent(campaign: Table | None = None) -> Table:
    return with_key(campaign or base_campaign(), ("limits", "no_temperature_stop"), REASON)


@pytest.mark.parametrize("system", ["elastomer", "rubber-steel", None])
def test_rubber_without_a_thermometer_needs_a_stated_consent(tmp_path: Path, system: str | None) -> None:
    specimen = base_specimen()
    specimen["specimen"].pop("elastic_system")
    if system is not None:
        specimen["specimen"]["elastic_system"] = system
    files = Files(tmp_path)
    with pytest.raises(
        BadInput, match=r"no temperature stop.*no_temperature_stop = .reason. .at least 3 words. under"
    ):
        files.prepare(stand=blind_stand(), specimen=specimen)
    plan = files.prepare(stand=blind_stand(), specimen=specimen, campaign=consent()).plan
    assert any(text.endswith(f"stated reason: {REASON}") for text in plan.not_guarded)


def test_a_ring_spring_needs_none_and_is_told_all_the_same(tmp_path: Path) -> None:
    specimen = with_key(base_specimen(), ("specimen", "elastic_system"), "ring-spring")
    plan = Files(tmp_path).prepare(stand=blind_stand(), specimen=specimen).plan
    assert any("no temperature stop" in text for text in plan.not_guarded)


def test_a_thermometer_in_the_air_is_none_on_the_specimen(tmp_path: Path) -> None:
    stand = base_stand()
    for sensor in stand["temperature"]["sensor"]:
        sensor["role"] = "ambient"
    with pytest.raises(BadInput, match="has no thermometer on the specimen"):
        Files(tmp_path).prepare(stand=stand)


NO_REASONS = (
    ".", "TODO", "to do", "none", "because", "x x x x x x x x x x", "no no no no no no", "- - - - - - - -",
    "1 2 3 4 5 6 7 8 9 10", "\u200b", "\u200b \u200b \u200b", "\u3164 \u3164 \u3164",
)  # fmt: skip
REASONS = ("two slow strokes", "eine Feder aus Stahl", "a peer has none; its springs are bits")


@pytest.mark.parametrize("text", REASONS)
def test_a_reason_has_words(text: str) -> None:
    assert is_reason(text)


def test_what_is_no_reason_is_no_consent(tmp_path: Path) -> None:
    files = Files(tmp_path)
    for text in NO_REASONS:
        campaign = with_key(base_campaign(), ("limits", "no_temperature_stop"), text)
        with pytest.raises(
            BadInput, match=r"no_temperature_stop = .* gives no reason|has no temperature stop"
        ):
            files.prepare(stand=blind_stand(), campaign=campaign)


COOLS = {"kind": "cool-down", "temperature_C": 25.0}
WARMS = {"kind": "warm-up", **SINE, "temperature_C": 24.0}
BAND = {"kind": "harmonic", **SINE, "start_temperature_C": [18.0, 25.0]}


@pytest.mark.parametrize(
    ("step", "needs", "instead"),
    [
        (COOLS, "waits until the specimen is at 25 °C or below", "kind = “hold” with duration_s"),
        (WARMS, "ends when the specimen is at 24 °C", "leave the step out"),
        (BAND, "begins at start_temperature_C = .18, 25. °C", "leave start_temperature_C out"),
        ({"kind": "repeat", "times": 2, "step": [COOLS]}, "waits until", "or leave the step out"),
    ],
)
def test_a_step_that_goes_by_a_thermometer_is_refused_without_one(
    tmp_path: Path, step: Table, needs: str, instead: str
) -> None:
    campaign = consent()
    campaign["step"].append(step)
    files = Files(tmp_path)
    with pytest.raises(
        BadInput, match=rf"step 2 .*{needs}.*no thermometer on the specimen.*{instead}"
    ) as caught:
        files.prepare(campaign=campaign, stand=blind_stand())
    assert "[[step]] 2" in caught.value.place
    del campaign["limits"]
    plan = files.prepare(campaign=campaign).plan
    demand_thermometers(
        plan, load_stand(blind(files)), {one.plan_hash for one in plan.steps}
    )  # done: no matter


def blind(files: Files) -> Path:
    files.write(stand=blind_stand())
    return files.folder / "stand.toml"


def test_a_consent_to_what_is_not_so_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="this campaign has a temperature stop"):
        Files(tmp_path).prepare(campaign=consent())


def test_what_is_said_is_what_the_guards_are(tmp_path: Path) -> None:
    """Each sentence against the guard set itself, on stands with and without."""
    ambient = base_stand()
    ambient["temperature"]["sensor"] = ambient["temperature"]["sensor"][2:]
    polled = blind_stand()
    polled["controller"]["profile"] = "polling"
    polled["controller"].pop("device_id", None)
    for stand in (base_stand(), blind_stand(), ambient, polled):
        files = Files(tmp_path)
        seen = "temperature" in stand and any(
            one.get("role") == "specimen" for one in stand["temperature"]["sensor"]
        )
        prepared = files.prepare(stand=stand, campaign=None if seen else consent())
        guards, said = guards_of(prepared), "\n".join(unguarded(prepared.plan, prepared.stand_file))
        stops = [one for one in guards.of(TemperatureGuard) if one.stop_C is not None]
        assert ("no temperature stop" in said) == (not stops)
        assert ("no second force" in said) == (not guards.of(AgreementGuard))
        assert ("no sample ring" in said) == (not guards.of(ControllerGuard)[0].own_clock)
        assert ("no controller lock" in said) == (stand["controller"]["profile"] == "polling")


def test_a_stand_that_guards_all_has_nothing_to_be_said(tmp_path: Path) -> None:
    assert Files(tmp_path).prepare().plan.not_guarded == ()


def test_a_guard_that_only_notes_and_a_stroke_that_nobody_stated_are_said(tmp_path: Path) -> None:
    campaign = base_campaign()
    campaign["guards"] = {"action": {"heating": "note", "wiring": "note"}}
    specimen = base_specimen()
    del specimen["specimen"]["max_stroke_mm"]
    said = "\n".join(Files(tmp_path).prepare(campaign=campaign, specimen=specimen).plan.not_guarded)
    assert "heats too fast is only noted" in said
    assert "that has come off, is only noted ([guards.action] wiring = “note”)" in said
    assert "the stroke guard knows the 250 mm of the stand only" in said


def test_plan_shows_it_and_its_json_has_it(tmp_path: Path) -> None:
    path = Files(tmp_path).write(stand=blind_stand(), campaign=consent())
    shown = " ".join(CliRunner().invoke(command, [str(path)]).output.split())
    assert "not guarded: this campaign has no temperature stop" in shown
    assert "not guarded: no second force" in shown
    assert '"not_guarded": [' in CliRunner().invoke(command, [str(path), "--json"]).output


def test_plan_refuses_with_one_line_and_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = Files(tmp_path).write(stand=blind_stand())
    with pytest.raises(SystemExit) as ended:
        main(["plan", str(path)])
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "limits: this campaign has no temperature stop" in line


@pytest.mark.parametrize(("speed", "said"), [(1.0, 0), (2.0, 0), (10.0, 1)])
def test_what_a_speed_does_not_let_judge_is_said_where_there_are_two_forces(
    tmp_path: Path, speed: float, said: int
) -> None:
    two, one = base_stand(), base_stand()
    del one["amplifier"]
    assert len(unguarded_at(speed, Files(tmp_path).prepare(stand=two).stand_file)) == said
    assert unguarded_at(speed, Files(tmp_path).prepare(stand=one).stand_file) == ()


def test_a_specimen_whose_curve_nobody_states_is_said(tmp_path: Path) -> None:
    prepared = Files(tmp_path).prepare()
    assert "no spring model" not in "\n".join(prepared.plan.not_guarded)
    said = "\n".join(unguarded(prepared.plan, prepared.stand_file, UnknownSpecimenPredictor()))
    assert "no spring model and no [catalogue]: a scale that is wrong in each force is not seen" in said
