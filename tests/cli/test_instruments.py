"""``bufferstand instruments``: every kind is listed with what it is made from."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.stand.instruments import command
from bufferstand.cli.main import main
from bufferstand.drivers import known_instruments
from bufferstand.drivers.acquisition import acquisition_kinds
from bufferstand.drivers.controllers import controller_kinds
from bufferstand.drivers.controllers.rmc.program import NAMES
from bufferstand.drivers.instruments import kinds


def test_every_kind_is_listed_and_names_its_documents() -> None:
    listed = {(one.table, one.name): one for one in known_instruments()}
    expected = {("controller", one.name) for one in controller_kinds()}
    expected |= {("acquisition", one.name) for one in acquisition_kinds()}
    expected |= {(one.table, one.name) for one in kinds()}
    assert expected <= set(listed)
    for one in listed.values():
        assert one.title, one
        assert one.sources, one


def test_the_list_says_what_no_hardware_has_confirmed() -> None:
    said = CliRunner().invoke(command, [])
    assert said.exit_code == 0
    assert "Delta RMC75 or RMC150" in said.stdout
    assert "not confirmed on hardware" in " ".join(said.stdout.split())
    assert max(map(len, said.stdout.splitlines())) <= 110


def test_json_has_nothing_else_on_its_output() -> None:
    content = json.loads(CliRunner().invoke(command, ["--json"]).stdout)
    assert content["schema"] == "bufferstand/instruments/1"
    (rmc,) = [one for one in content["instruments"] if (one["table"], one["name"]) == ("controller", "rmc")]
    assert rmc["confirmed"] is False
    assert any("RMCTools" in source for source in rmc["sources"])


def test_the_program_of_an_rmc_has_every_variable_in_its_place() -> None:
    text = CliRunner().invoke(command, ["--program", "rmc"]).stdout
    assert "NOT CONFIRMED ON HARDWARE" in text
    for number, name in enumerate(NAMES[:-6], start=100):
        assert f"\n  {number} {name} " in text, name
    assert f"{100 + len(NAMES) - 6} to {100 + len(NAMES) - 1} " in text


def test_a_kind_without_a_program_is_said_to_have_none(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["instruments", "--program", "gsv2"])
    assert ended.value.code == 2
    assert "there is one for rmc" in capsys.readouterr().err
