"""``bufferstand instruments --probe``: what a foreign device could be, and that it is only read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.stand.instruments import command
from bufferstand.cli.main import main
from bufferstand.drivers.check import known_devices
from bufferstand.drivers.register_maps.amplifier_map import load_amplifier_map
from tests.drivers.amplifiers import RegisterAmplifier
from tests.peers.labjack.emulator import LabJackEmulator
from tests.peers.modbus_io.laumas import Transmitter
from tests.peers.modbus_io.wago import Module, WagoNode, ten_volt_word
from tests.peers.modbus_io.wire import Server
from tests.peers.modbus_io.wiren_board import M1W2


def probed(*words: str) -> dict[str, tuple[str, str]]:
    """Return verdict and reason of every candidate, by its name."""
    done = CliRunner().invoke(command, ["--json", "--probe", *words], catch_exceptions=False)
    content: dict[str, Any] = json.loads(done.stdout)
    assert content["schema"] == "bufferstand/probe/1"
    found = {one["name"]: (one["verdict"], one["why"]) for one in content["candidates"]}
    assert set(found) == {one.name for one in known_devices()}
    assert all(why for _, why in found.values())
    return found


def fitting(found: dict[str, tuple[str, str]], verdict: str) -> set[str]:
    return {name for name, (said, _) in found.items() if said == verdict}


def test_a_wago_node_is_told_by_its_constants() -> None:
    with Server(WagoNode([Module([lambda: ten_volt_word(2.5), lambda: 0])])) as far:
        found = probed(f"127.0.0.1:{far.port}")
        functions = {function for _, function, _, _ in far.requests}
    assert fitting(found, "fits") == {"wago-750-10v", "wago-750-471", "wago-750-pt100"}
    assert "first_word" in found["wago-750-10v"][1]
    assert "no float of a measurement" in found["eagle-ei"][1] or "refused" in found["eagle-ei"][1]
    assert "exception 2" in found["laumas"][1]
    assert functions <= {1, 2, 3, 4}


def test_a_transmitter_on_a_line_may_fit_and_others_say_why_not(tmp_path: Path) -> None:
    with Server(Transmitter(unit=7, gross=-500), tmp_path / "line") as far:
        found = probed(str(tmp_path / "line"), "--unit", "7", "--baud", "115200")
        functions = {function for _, function, _, _ in far.requests}
    assert fitting(found, "fits") == set()
    assert fitting(found, "may fit") == {"laumas"}
    assert "gross (address 7) reads 500" in found["laumas"][1]
    assert "illegal function" in found["wb-m1w2"][1]
    assert functions <= {1, 2, 3, 4}


def test_a_gateway_of_thermometers_may_fit() -> None:
    with Server(M1W2(first=25.0625)) as far:
        found = probed(f"127.0.0.1:{far.port}")
    assert fitting(found, "may fit") == {"wb-m1w2"}
    assert "reads 401" in found["wb-m1w2"][1]


def test_a_labjack_and_an_amplifier_are_told_by_their_test_values() -> None:
    with LabJackEmulator({0: lambda t: 0.0 * t}) as far:
        found = probed(f"127.0.0.1:{far.port}")
    assert found["labjack"][0] == "fits"
    assert "T7" in found["labjack"][1]
    amplifier = RegisterAmplifier(load_amplifier_map("dms-float", Path()), 1000.0)
    try:
        found = probed(f"127.0.0.1:{amplifier.port}")
    finally:
        amplifier.close()
    assert found["dms-float"][0] == "fits"


def test_in_words_the_best_come_first() -> None:
    with Server(WagoNode([Module([lambda: 0, lambda: 0])])) as far:
        done = CliRunner().invoke(command, ["--probe", f"127.0.0.1:{far.port}"], catch_exceptions=False)
    assert done.exit_code == 0
    places = [done.stdout.index(f"\n{verdict}:") for verdict in ("fits", "may fit", "does not fit")]
    assert places == sorted(places)
    assert "nothing was written" in done.stdout


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["--probe", "127.0.0.1:0"], 2, "write HOST"),
        (["--probe", ":502"], 2, "write HOST"),
        (["--probe", "127.0.0.1:1"], 4, "Connection refused"),
        (["--probe", "/nowhere/line"], 4, "cannot open the serial line"),
        (["--probe", "127.0.0.1", "--unit", "256"], 2, "256"),
    ],
)
def test_what_cannot_be_asked_is_one_message(
    words: list[str], status: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["instruments", *words])
    assert ended.value.code == status
    shown = capsys.readouterr().err
    assert said in shown
    assert "Traceback" not in shown


def test_who_does_not_answer_at_this_unit_is_looked_for_at_others(capsys: pytest.CaptureFixture[str]) -> None:
    with Server(Transmitter(unit=3)) as far, pytest.raises(SystemExit) as ended:
        main(["instruments", "--probe", f"127.0.0.1:{far.port}"])
    assert ended.value.code == 4
    assert "unit 3 does: try --unit 3" in capsys.readouterr().err
