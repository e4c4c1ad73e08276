"""``[controller] kind`` and ``[controller.rmc]``: what is taken and refused; old files read as before."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers import build_controller
from bufferstand.drivers.controllers.rmc import RmcLink
from bufferstand.drivers.stand_file import load_stand
from bufferstand.foundation import BadInput, WallClock
from tests.contract.controller.backends import RMC, write_stand
from tests.peers.rmc_stand import write_rmc_stand


def refused(folder: Path, old: str, new: str) -> str:
    path = write_rmc_stand(folder, 1502)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BadInput) as error:
        load_stand(path)
    return str(error.value)


def test_an_old_stand_file_is_of_the_kind_registers_and_is_written_as_before(tmp_path: Path) -> None:
    stand = load_stand(write_stand(tmp_path, {}))
    assert stand.controller.kind == "registers"
    content = stand.model_dump()["controller"]
    assert "kind" not in content
    assert "rmc" not in content


def test_an_rmc_is_reached_through_its_gateway(tmp_path: Path) -> None:
    stand = load_stand(write_stand(tmp_path, RMC))
    assert stand.controller.profile == "rmc", "where the file names none"
    assert stand.model_dump()["controller"]["rmc"]["model"] == "rmc150"
    controller = build_controller(stand, WallClock())
    assert isinstance(controller._link, RmcLink)
    controller.close()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kind = "rmc"', 'kind = "rcm"', "there are registers, rmc"),
        ('kind = "rmc"\n', "", "is of kind = “rmc”"),
        ("axis = 0", "axis = 16", "axis"),
        ('model = "rmc150"', 'model = "rmc200"', "model"),
        ('force = "%MD9.8"', 'force = "9.8"', "write e.g. “%MD9.8”"),
        ('word_order = "little"\n', "", "word_order"),
        ("clear_mm = -5.0", "clear_mm = 5.0", "clear_mm"),
        ("variables = 100", "variables = 1020", "variables"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert said in refused(tmp_path, old, new)


def test_a_kind_without_its_table_is_refused(tmp_path: Path) -> None:
    path = write_stand(tmp_path, {'profile = "ring"': 'kind = "rmc"'})
    with pytest.raises(BadInput, match=r"needs a table \[controller.rmc\]"):
        load_stand(path)
