"""From the stand file to the right controller on the right wire."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.controllers.polling_controller import PollingController
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import Endpoints, wires_from, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput
from tests.drivers.conftest import SAMPLE_STAND

TCP = 'host = "127.0.0.1"\nport = 15020'
RTU = 'serial = "wires/line"\nbaud = 115200\nparity = "even"\nstop_bits = 1'


def stand(folder: Path, wire: str = TCP, profile: str = "ring") -> Path:
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    for old, new in ((TCP, wire), ('profile = "ring"', f'profile = "{profile}"')):
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("profile", "kind"), [("ring", RingController), ("polling", PollingController)])
def test_the_profile_says_how_it_is_sampled_and_the_wire_where(
    tmp_path: Path, profile: str, kind: type
) -> None:
    controller = build_controller(load_stand(stand(tmp_path, profile=profile)), WallClock())
    assert isinstance(controller, kind)
    assert "127.0.0.1:15020 unit 1" in controller.facts.device
    controller = build_controller(load_stand(stand(tmp_path, RTU, profile)), WallClock())
    assert isinstance(controller, kind)
    line = f"{tmp_path / 'wires' / 'line'} (115200 baud, 8 data bits, even parity, 1 stop) unit 1"
    assert line in controller.facts.device


@pytest.mark.parametrize(
    ("wire", "message"),
    [
        ("port = 15020", r"give either host \(Modbus TCP\) or serial \(Modbus RTU\)"),
        (f"{TCP}\n{RTU}", r"give either host \(Modbus TCP\) or serial \(Modbus RTU\)"),
        (RTU.replace("115200", "4800"), "timeout_s = 0.5 is too short: at 4800 baud"),
        (
            RTU.replace("even", "mark"),
            "controller.parity: “mark” is not known here; write “none”, “even” or “odd”",
        ),
        (
            RTU.replace("stop_bits = 1", "stop_bits = 3"),
            "controller.stop_bits: 3 is not known here; write 1 or 2",
        ),
    ],
)
def test_a_wire_that_is_none_is_refused(tmp_path: Path, wire: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        load_stand(stand(tmp_path, wire))


def test_a_simulated_line_takes_the_place_of_the_real_one(tmp_path: Path) -> None:
    file = load_stand(stand(tmp_path, RTU))
    assert file.controller_serial() == tmp_path / "wires" / "line"
    other = with_endpoints(file, Endpoints(controller_serial=tmp_path / "far"))
    assert other.controller_serial() == tmp_path / "far"
    moved = wires_from(file, tmp_path / "original")
    assert moved.controller_serial() == tmp_path / "original" / "wires" / "line"
    assert load_stand(stand(tmp_path)).controller_serial() is None
