"""Which channels a controller can sample: names, register profiles, and the simulated registers."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from bufferstand.drivers.register_maps.profile import SHIPPED, load_profile
from bufferstand.drivers.register_maps.sampled_channels import hole_in_strokes, quantity_of
from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.wires.controller_registers import RegisterBank
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.channels.channel import CHANNEL_UNITS, Quantity
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.units import conversion
from tests.many_channels import FURTHER, stand_with

POLLING = (SHIPPED / "polling.toml").read_text(encoding="utf-8")
RAW = (
    '\n[[register]]\nname = "raw_{name}"\naddress = {address}\ntype = "i16"\naccess = "r"\ntable = "input"\n'
)
READS = '"command"]]'
ADDED = "".join(
    RAW.format(name=name, address=address)
    for name, address in (("pressure_1", 14), ("acceleration_1", 15))
)  # fmt: skip


def test_every_quantity_has_units_that_are_understood() -> None:
    assert set(get_args(Quantity)) == CHANNEL_UNITS.keys()
    for quantity, units in CHANNEL_UNITS.items():
        for unit in units:
            assert conversion("stroke" if unit == "mm" else quantity, unit)[0] > 0.0


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("force", "force"), ("force_2", "force"), ("force_1", None), ("stroke", None), ("stroke_4", "stroke"),
        ("stroke_5", None), ("command_2", "command"), ("pressure_1", "pressure"), ("pressure", None),
        ("pressure_100", None), ("pressure_01", None), ("acceleration_12", "acceleration"), ("valve_1", None),
        ("temperature_4", "temperature"), ("tick", None), ("time_1", None),
    ],
)  # fmt: skip
def test_a_name_says_what_is_measured(name: str, quantity: str | None) -> None:
    assert quantity_of(name) == quantity


def test_draw_wires_are_numbered_without_a_hole() -> None:
    assert not hole_in_strokes(["force", "stroke_1", "stroke_2"])
    assert "“stroke_3” is not there" in hole_in_strokes(["stroke_1", "stroke_2", "stroke_4"])


def polling(folder: Path, *, registers: str = ADDED) -> str:
    """Write a polled profile that reads pressure and acceleration, too."""
    text = POLLING.replace(READS, READS.replace("]]", ', "pressure_1", "acceleration_1"]]'))
    assert text != POLLING
    head, table, poll = text.partition("\n[poll]")
    (folder / "polling.toml").write_text(head + registers + table + poll, encoding="utf-8")
    return "polling.toml"


def test_a_polled_controller_shows_its_further_channels(tmp_path: Path) -> None:
    path = stand_with(tmp_path, wires=2, further=True)
    text = path.read_text(encoding="utf-8")
    assert FURTHER in text
    path.write_text(text.replace("ring.toml", polling(tmp_path)), encoding="utf-8")
    stand = load_stand(path)
    assert list(stand.profile().sampled)[-2:] == ["pressure_1", "acceleration_1"]
    device = make_device(stand, lambda: 0.0)
    device.advance(50)
    bank = RegisterBank(device, stand.profile())
    _, columns = device.ring.window(device.ring.total - 1, 1)
    assert columns["pressure_1"].dtype == "i2"
    values = bank.read(14, 2, "input")
    assert values == [int(columns[name][0]) & 0xFFFF for name in ("pressure_1", "acceleration_1")]


def test_a_polled_channel_needs_its_register(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="register “raw_pressure_1” is missing"):
        load_profile(polling(tmp_path, registers=""), tmp_path)
