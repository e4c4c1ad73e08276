from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from bufferstand.drivers.instruments.wire_address import FolderAddress, SerialAddress
from bufferstand.drivers.register_maps.profile import SHIPPED
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import (
    Endpoints,
    StandFile,
    StandFileLimits,
    wires_from,
    with_endpoints,
)
from bufferstand.foundation.errors import BadInput
from tests.drivers.conftest import SAMPLE_STAND

SAMPLE = re.sub(
    r"(?ms)^(machine_stiffness_kN_per_mm = .*?\n|force_speed = \[.*?\n\]\n)",
    "",
    SAMPLE_STAND.read_text(encoding="utf-8"),
)
"""Without its optional limits, so that a test can state its own."""
SPEED = "speed_max_mm_per_s = 800.0\n"
"""The last of the required limits: what is optional is put behind it."""


def amplifier_port(stand: StandFile) -> Path:
    """Return the serial device of the only amplifier."""
    (one,) = stand.instruments
    wire = one.kind.wire(one.settings, one.folder)
    assert isinstance(wire, SerialAddress)
    return wire.path


def thermometer_wire(stand: StandFile) -> Path:
    """Return the folder or serial device of the only thermometers."""
    (one,) = stand.thermometers
    wire = one.wire()
    assert isinstance(wire, SerialAddress | FolderAddress)
    return wire.path


POSITION = SAMPLE[
    SAMPLE.index("[[controller.channel]] # signed") : SAMPLE.index('[[controller.channel]]\nname = "command"')
]


def changed(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = SAMPLE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_shipped_stand() -> None:
    stand = load_stand(SAMPLE_STAND)
    assert stand.limits.force_max_kN == 600.0
    assert stand.controller.port == 15020
    assert {channel.name for channel in stand.controller.channel} == set(stand.profile().sampled)
    assert amplifier_port(stand) == SAMPLE_STAND.parent / "wires" / "amplifier"
    assert thermometer_wire(stand) == SAMPLE_STAND.parent / "wires" / "w1" / "devices"
    assert [sensor.role for sensor in stand.temperature_sensors] == ["specimen", "specimen", "ambient"]
    assert stand.simulation is not None
    assert stand.simulation["model"] == "models/category-a-elastomer.toml"
    assert stand.profile().facts.id == "bufferstand-ring"


def test_shipped_coefficients_are_those_of_the_devices() -> None:
    stand = load_stand(SAMPLE_STAND)
    slope = {channel.name: channel.calibration.coefficients[1] for channel in stand.controller.channel}
    assert slope["stroke_1"] == slope["stroke_2"] == 500.0 / 65536
    assert slope["position"] == slope["command"] == 0.01
    assert slope["force"] * 2**31 > stand.limits.force_max_kN  # int32 counts reach beyond the limit
    assert stand.instruments[0].channel.calibration.coefficients[1] == pytest.approx(
        1.05 * 630.0 / 0x7FFFFF, rel=1e-12
    )


def test_temperature_counts_are_sixteenths_of_a_degree() -> None:
    stand = load_stand(SAMPLE_STAND)
    channel = stand.temperature_sensors[0].channel()
    assert channel.calibration.apply(16 * 40) == 40.0
    assert (channel.name, channel.unit, channel.place) == ("temperature_1", "°C", "spring plate 3")


def test_what_goes_into_the_run_file_names_no_folder_of_this_machine() -> None:
    text = json.dumps(load_stand(SAMPLE_STAND).model_dump(mode="json"))
    assert str(SAMPLE_STAND.parent) not in text


def test_amplifier_and_sensors_are_optional(tmp_path: Path) -> None:
    text = SAMPLE[: SAMPLE.index("[amplifier]")]
    path = tmp_path / "stand.toml"
    path.write_text(text, encoding="utf-8")
    stand = load_stand(path)
    assert stand.amplifier == ()
    assert not stand.instruments
    assert stand.temperature == stand.thermometers == stand.temperature_sensors == ()
    elsewhere = with_endpoints(
        stand, Endpoints(instruments=dict.fromkeys(("amplifier", "thermometers"), tmp_path))
    )
    assert elsewhere.amplifier == elsewhere.temperature == ()


def test_stiffness_and_force_speed_curve_are_optional_and_come_back_as_written(tmp_path: Path) -> None:
    (tmp_path / "bare.toml").write_text(SAMPLE, encoding="utf-8")
    bare = StandFile.model_validate(load_stand(tmp_path / "bare.toml").model_dump()).limits
    assert set(bare.model_dump()) == {
        "force_max_kN", "stroke_max_mm", "frequency_max_Hz", "speed_max_mm_per_s",
    }  # fmt: skip
    text = "machine_stiffness_kN_per_mm = 150.0\nforce_speed = [[0, 800], [400.0, 560.0], [630.0, 0.0]]\n"
    (tmp_path / "stand.toml").write_text(SAMPLE.replace(SPEED, SPEED + text), encoding="utf-8")
    limits = load_stand(tmp_path / "stand.toml").limits
    assert limits.machine_stiffness_kN_per_mm == 150.0
    assert limits.force_speed == ((0.0, 800.0), (400.0, 560.0), (630.0, 0.0))
    assert json.loads(json.dumps(limits.model_dump(mode="json")))["force_speed"][1] == [400.0, 560.0]
    assert StandFileLimits.model_validate(limits.model_dump(mode="json")) == limits


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[limits]", "[limit]", "unknown key “limit”"),
        (
            "force_max_kN = 600.0",
            "force_max_kN = 0.0",
            "limits.force_max_kN: 0.0 is too small; write a number from 1 to 10000",
        ),
        ("stroke_max_mm = 250.0", "stroke_max = 250.0", "did you mean “stroke_max_mm”?"),
        ('profile = "ring"', 'profile = "rong"', "controller.profile: there is no register profile “rong”"),
        (
            "port = 15020",
            "port = 70000",
            "controller.port: 70000 is too large; write a whole number from 1 to 65535",
        ),
        ("watchdog_s = 2.0", "watchdog_s = 0.9", "must be at least twice timeout_s = 0.5"),
        ('name = "stroke_2"', 'name = "stroke_1"', "channel “stroke_1” is there twice"),
        (
            'name = "stroke_2"',
            'name = "stroke_5"',
            "no channel “stroke_5”; its channels are force, position, command (further ones force_2 …),",
        ),
        (
            'name = "stroke_2"',
            'name = "stroke_3"',
            "“stroke_2” is not there, though a later one is; number the draw wires from 1 on",
        ),
        (
            'name = "stroke_2"\nquantity = "stroke"\nunit = "mm"',
            'name = "pressure_1"\nquantity = "pressure"\nunit = "psi"',
            "unit = “psi” is not possible for the channel “pressure_1”; write unit = “bar”",
        ),
        (
            'name = "stroke_2"\nquantity = "stroke"\nunit = "mm"',
            'name = "force_2"\nquantity = "force"\nunit = "kN"',
            "two channels of the stand have the name “force_2”; give each its own",
        ),
        (
            POSITION,
            "",
            "channels are incomplete; add position (position: the following error is counted from it",
        ),
        ("force_max_kN = 600.0", "force_max_kN = 630000", "limits.force_max_kN: 630000.0 is too large"),
        (
            'unit = "kN"',
            'unit = "N"',
            "controller.channel.unit: unit = “N” is not possible for the channel “force”; write unit = “kN”",
        ),
        (
            'protocol = "gsv2"',
            'protocol = "gsv8"',
            "protocol = “gsv8” is not known; write “aed”, “ascii-line”, “gsv2” or “modbus”",
        ),
        (
            "rate_Hz = 250.0",
            "rate_Hz = 1000.0",
            "rate_Hz = 1000 does not fit the line: 38400 baud carries 768",
        ),
        ('name = "force_2"', 'name = "force"', "two channels of the stand have the name “force”"),
        ('rom = "28-00000a3f92d7"', 'rom = "28-00000a3f91c2"', "two sensors have the rom “28-00000a3f91c2”"),
        (
            'rom = "28-00000a3f92d7"',
            'rom = "28-00000A3F92D7"',
            "does not have the form that is wanted here; write 28- and 12",
        ),
        ('name = "temperature_2"', 'name = "temperature_1"', "two sensors have the name “temperature_1”"),
        (
            'place = "spring plate 5"',
            'place = "spring plate 3"',
            "two sensors have the place “spring plate 3”",
        ),
        ('role = "ambient"', 'role = "air"', "write “specimen” or “ambient”"),
        ("[amplifier]\n", "[amplifier]\nfilter_Hz = 10\n", "unknown key “filter_Hz”"),
        (
            SPEED,
            f"{SPEED}machine_stiffness_kN_per_mm = 0.0\n",
            "0.0 is too small; write a number from 1 to 100000",
        ),
        (SPEED, f"{SPEED}force_speed = [[0.0, 800.0]]\n", "force_speed: a curve needs two pairs"),
        (
            SPEED,
            f"{SPEED}force_speed = [[0.0, 800.0, 1.0], [630.0, 0.0]]\n",
            "force_speed (entry 1): a list of 3 entries is not possible here; write two numbers",
        ),
        (
            SPEED,
            f"{SPEED}force_speed = 800.0\n",
            "limits.force_speed: 800.0 is not possible here; write a list of pairs of numbers",
        ),
        (
            SPEED,
            f"{SPEED}force_speed = [[0.0, 800.0], [0.0, 500.0], [630.0, 0.0]]\n",
            "pair 2 has 0 kN after 0 kN: the forces must rise",
        ),
        (
            SPEED,
            f"{SPEED}force_speed = [[0.0, 500.0], [300.0, 600.0], [630.0, 0.0]]\n",
            "pair 2 has 600 mm/s at 300 kN after 500 mm/s at 0 kN: a valve gives no more speed at more force",
        ),
        (SPEED, f"{SPEED}force_speed = [[0.0, 800.0], [630.0, -1.0]]\n", "pair 2 is [630, -1]"),
        (SPEED, f"{SPEED}force_speed = [[0.0, 0.0], [630.0, 0.0]]\n", "the stand could not move"),
        (
            SPEED,
            f"{SPEED}force_speed = [[0.0, 800.0], [500.0, 100.0]]\n",
            "limits.force_max_kN: force_max_kN = 600 is more than force_speed knows of, which ends at 500 kN",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_file_and_place(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(BadInput, match=re.escape(message)) as caught:
        load_stand(changed(tmp_path, (old, new)))
    assert str(tmp_path / "stand.toml") in str(caught.value)


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        (
            '"command:i16", "valve:i16"',
            "ring.sample: the controller has no channel “valve”; its channels are",
        ),
        ('"valve:i16"', "ring.sample must name each of force, stroke_1, position, command exactly once"),
        ('"command:i16", "command:i16"', "ring.sample must name each of force, stroke_1, position, command"),
        (
            '"command:i16", "pressure_1:u16"',
            "samples pressure_1, which the stand file does not describe; add a [[controller.channel]] of",
        ),
    ],
)
def test_a_profile_with_other_channels_does_not_fit(tmp_path: Path, sample: str, message: str) -> None:
    text = (SHIPPED / "ring.toml").read_text(encoding="utf-8").replace('"command:i16"', sample)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape(message)):
        load_stand(changed(tmp_path, ('profile = "ring"', 'profile = "mine.toml"')))


def test_a_stand_file_with_a_channel_that_its_profile_does_not_sample(tmp_path: Path) -> None:
    wire, pressure = 'name = "stroke_2"\nquantity = "stroke"', 'name = "speed_1"\nquantity = "speed"'
    with pytest.raises(BadInput, match="profile “ring” samples stroke_2, which the stand file does not"):
        load_stand(changed(tmp_path, (f'{wire}\nunit = "mm"', f'{pressure}\nunit = "mm/s"')))
    more = '\n[[controller.channel]]\nname = "speed_1"\nquantity = "speed"\nunit = "mm/s"\n\n[amplifier]\n'
    with pytest.raises(
        BadInput,
        match=r"does not sample “speed_1”; it samples force, stroke_1, stroke_2, position, command; "
        r"leave the channel out, or name a profile whose ring\.sample has it, e\.g\. “speed_1:i16”",
    ):
        load_stand(changed(tmp_path, ("\n[amplifier]\n", more)))


def test_endpoints_replace_the_wires_and_nothing_else(tmp_path: Path) -> None:
    stand = load_stand(SAMPLE_STAND)
    other = with_endpoints(
        stand,
        Endpoints(
            host="::1",
            port=4711,
            instruments={"amplifier": tmp_path / "pty", "thermometers": tmp_path / "w1"},
        ),
    )
    assert (other.controller.host, other.controller.port) == ("::1", 4711)
    assert amplifier_port(other) == tmp_path / "pty"
    assert thermometer_wire(other) == tmp_path / "w1"
    assert other.path == stand.path
    before, after = stand.model_dump(mode="json"), other.model_dump(mode="json")
    for content in (before, after):
        for table, key in (
            ("controller", "host"),
            ("controller", "port"),
            ("amplifier", "port"),
            ("temperature", "root"),
        ):
            del content[table][key]
    assert after == before
    assert with_endpoints(stand, Endpoints()) == stand


def test_a_copy_of_a_stand_file_can_keep_the_devices_of_the_original(tmp_path: Path) -> None:
    original = load_stand(SAMPLE_STAND)
    (tmp_path / "copy.toml").write_text(SAMPLE, encoding="utf-8")
    copy = load_stand(tmp_path / "copy.toml")
    assert amplifier_port(copy) != amplifier_port(original)
    wired = wires_from(copy, SAMPLE_STAND.parent)
    assert amplifier_port(wired) == amplifier_port(original)
    assert thermometer_wire(wired) == thermometer_wire(original)
    assert wired.controller == original.controller


def test_the_moving_mass_is_recorded_with_the_stand(tmp_path: Path) -> None:
    assert load_stand(SAMPLE_STAND).stand.moving_mass_kg is None
    stand = load_stand(changed(tmp_path, ('id = "simulated-630kN"', 'id = "s"\nmoving_mass_kg = 150')))
    assert stand.model_dump(mode="json")["stand"]["moving_mass_kg"] == 150.0
    with pytest.raises(BadInput, match="moving_mass_kg"):
        load_stand(changed(tmp_path, ('id = "simulated-630kN"', 'id = "s"\nmoving_mass_kg = -1')))


W1 = 'kind = "w1"\nroot = "wires/w1/devices"\n'
GSV2 = 'protocol = "gsv2"\nport = "wires/amplifier"\nbaud = 38400\nrate_Hz = 250.0\n'
MODBUS = 'protocol = "modbus"\nrate_Hz = 50.0\nmodbus = { map = "dms-float", host = "::1" }\n'


def test_a_serial_1_wire_adapter_and_a_networked_amplifier_have_no_folder_and_no_port(tmp_path: Path) -> None:
    stand = load_stand(changed(tmp_path, (W1, 'kind = "ds2480b"\nport = "wires/onewire"\n'), (GSV2, MODBUS)))
    assert thermometer_wire(stand) == tmp_path / "wires" / "onewire"
    assert stand.instruments[0].settings.port == ""
    elsewhere = wires_from(stand, SAMPLE_STAND.parent)
    assert thermometer_wire(elsewhere) == SAMPLE_STAND.parent.absolute() / "wires" / "onewire"
    assert elsewhere.amplifier == stand.amplifier


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (W1, 'kind = "ds2480b"\n', "port names the serial device of kind = “ds2480b”"),
        ('kind = "w1"', 'kind = "w1"\nport = "a"', "port names the serial device of kind = “ds2480b”"),
        (GSV2, GSV2 + "aed = { output = 9 }\n", "protocol = “gsv2” has no key “aed”; it is a key of aed"),
        (
            GSV2,
            GSV2.replace("gsv2", "modbus"),
            "amplifier.modbus: this key is missing; add it: a table under [amplifier.modbus]",
        ),
        (GSV2, GSV2.replace('port = "wires/amplifier"\n', ""), "port must name the serial device"),
        (GSV2, GSV2 + "gsv2 = { rate_code = 7 }\n", "rate_code is only sent with set_up = true"),
        (
            GSV2,
            GSV2.replace("gsv2", "aed") + "aed = { output = 9 }\n",
            "rate_Hz = 250 does not fit the line: 38400 baud carries 205.348",
        ),
        (GSV2, GSV2.replace("gsv2", "aed") + "aed = { output = 5 }\n", "output must be 0, 1, 2, 3, 4, 6, 8"),
        (
            GSV2,
            GSV2.replace("gsv2", "aed") + "aed = { output = 9, checksum = true }\n",
            "a checksum needs the output format 8 or 12",
        ),
    ],
)
def test_what_cannot_be_of_a_sensor_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(BadInput, match=re.escape(message)):
        load_stand(changed(tmp_path, (old, new)))
