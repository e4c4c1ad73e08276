"""What a stand cannot guard is said, as its guards really are; no specimen of rubber is tested blind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from cli.commands.plan import command
from daq.unguarded import unguarded
from foundation.errors import BadInput
from tests.bounds.files import Files, Table, base_campaign, base_specimen, base_stand, guards_of, with_key

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
    with pytest.raises(BadInput, match=r"no temperature stop.*no_temperature_stop = .reason. under"):
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
        stops = [one for one in guards.temperatures if one.stop_C is not None]
        assert ("no temperature stop" in said) == (not stops)
        assert ("no second force" in said) == (guards.agreement is None)
        assert ("no sample ring" in said) == (not guards.controller.own_clock)
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


def test_plan_refuses_with_one_line_and_status_2(tmp_path: Path) -> None:
    path = Files(tmp_path).write(stand=blind_stand())
    done = subprocess.run(
        [sys.executable, "-m", "cli", "plan", str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "limits: this campaign has no temperature stop" in line
