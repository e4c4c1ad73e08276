"""Every kind of thermometers keeps its contract; one of a laboratory's own package is as good as ours."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, ClassVar

import pytest

from bufferstand.drivers.instruments import catalogue
from bufferstand.drivers.instruments.catalogue import kinds, stream_name
from bufferstand.drivers.instruments.thermometer_kind import ThermometerKind
from bufferstand.drivers.instruments.wire_address import FolderAddress, SerialAddress
from bufferstand.drivers.stand_file.bounds import power_on_C
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import Endpoints, wires_from, with_endpoints
from bufferstand.drivers.thermometers.w1.kind import W1Kind
from bufferstand.foundation.channels.thermometers import recorded_thermometers
from bufferstand.foundation.errors import BadInput
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.test_instrument_catalogue import SAMPLES, install_example, run
from tests.house.house_page import ROOT, files_of

KINDS = [kind for kind in kinds() if isinstance(kind, ThermometerKind)]
SECOND = """
[[temperature]]
kind = "ds2480b"
port = "wires/adapter"
period_s = 2.0
[[temperature.sensor]]
rom = "28-00000a4e6f02"
name = "temperature_4"
place = "buffer head"
calibration = { coefficients = [-1.5, 0.0625] }
"""
METER = """
[[temperature]]
kind = "pt100-meter"
port = "wires/meter"
period_s = 0.5
[[temperature.sensor]]
input = 1
name = "temperature_4"
place = "buffer head"
[[temperature.sensor]]
input = 2
name = "temperature_5"
place = "oil"
role = "ambient"
"""


def stand_with(folder: Path, tables: str) -> Path:
    """Write the sample stand, its thermometers as an entry of a list, with further ones."""
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace('model = "', f'model = "{SAMPLES}/', 1)
    before, mark, after = text.replace("\n[temperature]\n", "\n[[temperature]]\n").partition("\n[simulation]")
    path = folder / "stand.toml"
    path.write_text(before + tables + mark + after, encoding="utf-8")
    return path


def test_our_kinds_are_there_and_each_is_a_folder() -> None:
    assert {kind.name for kind in KINDS} >= {"w1", "ds2480b"}
    for kind in KINDS:
        folder = ROOT / "drivers" / "thermometers" / kind.name
        assert {file.stem for file in folder.glob("*.py")} >= {
            "__init__", "kind", "settings", "thermometer", "simulated",
        }  # fmt: skip


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_kind_says_what_its_sensors_are(kind: ThermometerKind[Any]) -> None:
    assert kind.__doc__
    what = kind.sensor_type
    assert what.form.whole
    assert all(text is None or "look" in text for text in what.faults.values())
    shown_C = what.nominal.apply([what.form.low, what.form.high])
    assert shown_C[0] < -20.0
    assert shown_C[1] > 100.0
    assert what.power_on is None or what.form.low < what.power_on < what.form.high


def test_what_a_kind_leaves_out_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = {"driver": None, "__doc__": "x"}
    methods = {name: lambda *_: None for name in ("drivers", "simulated", "wire", "moved")}
    kind = type("NoType", (ThermometerKind,), {"name": "w1", "settings": W1Kind.settings} | whole | methods)()
    monkeypatch.setattr(catalogue, "_in_folder", lambda: iter([kind]))
    with pytest.raises(TypeError, match=r"instrument “w1” .* does not state its sensor_type"):
        kinds.__wrapped__()

    class Other(W1Kind):
        name: ClassVar = "w2"

    monkeypatch.setattr(catalogue, "_in_folder", lambda: iter([Other()]))
    with pytest.raises(TypeError, match=r"kind of .*W1Settings.* must be Literal\['w2'\]"):
        kinds.__wrapped__()


def test_a_stand_lists_as_many_devices_as_it_has(tmp_path: Path) -> None:
    stand = load_stand(stand_with(tmp_path, SECOND))
    assert [one.stream for one in stand.thermometers] == ["thermometers", "thermometers_2"]
    assert [one.name for one in stand.temperature_sensors] == [
        f"temperature_{number}" for number in (1, 2, 3, 4)
    ]
    assert stream_name("temperature", 2) == "thermometers_3"
    written = stand.model_dump(mode="json")
    assert [one["kind"] for one in written["temperature"]] == ["w1", "ds2480b"]
    assert type(stand).model_validate_json(json.dumps(written)).model_dump(mode="json") == written
    assert [one["name"] for one in recorded_thermometers(written)] == [
        one.name for one in stand.temperature_sensors
    ]
    assert power_on_C(stand) == 83.5  # the fourth shows 1.5 K less of what it reads
    folder, adapter = (one.wire() for one in stand.thermometers)
    assert isinstance(folder, FolderAddress)
    assert adapter == SerialAddress(tmp_path / "wires" / "adapter", 9600)


def test_each_device_can_be_reached_elsewhere(tmp_path: Path) -> None:
    stand = load_stand(stand_with(tmp_path, SECOND))
    moved = with_endpoints(stand, Endpoints(instruments={"thermometers_2": tmp_path / "far"}))
    assert moved.thermometers[0].wire() == stand.thermometers[0].wire()
    assert moved.thermometers[1].wire() == SerialAddress(tmp_path / "far", 9600)
    copied = wires_from(stand, tmp_path / "copy")
    assert [one.wire().path.is_relative_to(tmp_path / "copy") for one in copied.thermometers] == [True, True]  # type: ignore[union-attr]


def test_one_device_is_written_as_ever_and_none_as_null(tmp_path: Path) -> None:
    listed = load_stand(stand_with(tmp_path, ""))
    table = load_stand(SAMPLE_STAND).model_dump(mode="json")["temperature"]
    assert listed.model_dump(mode="json")["temperature"] == table
    assert isinstance(table, dict)
    assert recorded_thermometers({"temperature": table}) == tuple(table["sensor"])
    assert recorded_thermometers({"temperature": None}) == recorded_thermometers({}) == ()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("ds2480b", "ds2480c", r"line 114: temperature.kind: kind = “ds2480c” is not .*mean “ds2480b”"),
        ("period_s = 2.0", "period_s = 20.0", r"line 116: temperature\S*.period_s"),
        ("period_s", "periods", r"line 116: temperature\S*: unknown key “periods”; did you mean “period_s”"),
        ("28-00000a4e6f02", "28-1", r"line 118: temperature\S*.rom"),
        ("temperature_4", "temperature_3", "two channels of the stand have the name “temperature_3”"),
        ("buffer head", "spring plate 3", "two sensors have the place “spring plate 3”"),
        ("[-1.5, 0.0625]", "[-9.0, 0.0625]", r"line 121: temp\S*: temperature_4 would show -9 °C of 0 °C"),
        ('port = "wires/adapter"\n', "", "port names the serial device of kind = “ds2480b”"),
    ],
)  # fmt: skip
def test_a_wrong_entry_is_refused_with_its_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SECOND
    with pytest.raises(BadInput) as refused:
        load_stand(stand_with(tmp_path, SECOND.replace(old, new)))
    assert re.search(said, refused.value.message()), refused.value.message()


# --- a package of a laboratory's own ----------------------------------------------------------------


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install_example(tmp_path_factory.mktemp("laboratory"), "add-a-thermometer.md", "our_thermometer")


def test_the_page_names_one_folder_a_test_and_a_page() -> None:
    assert files_of("Add a thermometer", "meter") == [
        "drivers/thermometers/meter/",
        "tests/drivers/test_meter.py",
        "docs/sensors.md",
    ]


@pytest.mark.slow
def test_the_contract_suite_drives_a_kind_of_a_package(laboratory: Path) -> None:
    words = ("-q", "-p", "no:cacheprovider", "tests/contract/temperature", "-k", "pt100-meter")
    done = run(laboratory, "pytest", *words)
    assert done.returncode == 0, done.stdout
    (passed,) = re.findall(r"(\d+) passed", done.stdout)
    assert int(passed) >= 5


def test_a_stand_file_names_it_and_its_schema_has_it(laboratory: Path, tmp_path: Path) -> None:
    path = stand_with(tmp_path, METER)
    schema = json.loads(run(laboratory, "bufferstand", "schema", "stand").stdout)
    assert {"MeterSettings", "MeterSensor", "W1Settings", "Ds2480bSettings"} <= schema["$defs"].keys()
    with pytest.raises(BadInput, match="kind = “pt100-meter” is not known"):  # here it is not installed
        load_stand(path)


IN_PROCESS = """
import json, sys
from pathlib import Path
from bufferstand.daq.guards.kinds.temperature import TemperatureGuard
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand

stand = open_in_process(load_stand(Path(sys.argv[1])), faults=[parse_fault("temperature_5=missing@5")])
meters = [one for one in stand.stand.sensors if one.facts.name in ("temperature_4", "temperature_5")]
for sensor in stand.stand.sensors:
    sensor.start()
stand.clock.sleep(10.0)
told = {}
for sensor in meters:
    items = sensor.drain()
    (channel,) = sensor.facts.channels
    blocks = [one for one in items if isinstance(one, SampleBlock)]
    told[sensor.facts.name] = {
        "count": len(blocks),
        "dtype": str(blocks[0].counts[channel.name].dtype),
        "shown_C": float(channel.calibration.apply(blocks[0].counts[channel.name])[0]),
        "said": sorted({one.what for one in items if not isinstance(one, SampleBlock)}),
        "device": sensor.facts.device,
    }
guard = TemperatureGuard("temperature_4", "", 90.0, 30.0, grace_s=5.0, readings=meters[0].facts.readings)
told["guard"] = guard.facts()["readings"]
told["same"] = TemperatureGuard.from_facts(guard.facts()) == guard
print(json.dumps(told))
"""


def test_it_is_simulated_and_guarded_as_what_it_is(laboratory: Path, tmp_path: Path) -> None:
    (laboratory / "in_process.py").write_text(IN_PROCESS, encoding="utf-8")
    done = run(laboratory, "in_process", stand_with(tmp_path, METER))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["temperature_4"]["count"] == 20  # every half a second
    assert told["temperature_5"]["count"] == 9
    assert told["temperature_4"]["dtype"] == "int32"
    assert told["temperature_4"]["shown_C"] == pytest.approx(21.0, abs=0.2)
    assert told["temperature_4"]["device"] == "input 1, simulated"
    assert told["temperature_5"]["said"] == [
        "temperature_5 (simulated): its input is open; look at its plug and cable"
    ]
    assert told["guard"] == {"low_C": -200.0, "high_C": 600.0, "power_on_C": None}
    assert told["same"]


def test_a_fault_that_it_cannot_have_is_refused(laboratory: Path, tmp_path: Path) -> None:
    words = ("simulate-stand", stand_with(tmp_path, METER), "--port", 0, "--fault", "temperature_4=crc@1")
    done = run(laboratory, "bufferstand", *words)
    assert done.returncode == 2
    assert "temperature_4 is of kind “pt100-meter”, which has no fault “crc”" in done.stderr
    assert "silent, missing, frozen" in done.stderr


CHECKED = """
import json, sys
from pathlib import Path
from bufferstand.drivers.check.devices import check_stand
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.drivers.transcripts.recorder import record_wires
from bufferstand.foundation.clock import WallClock

path, folder = Path(sys.argv[1]), Path(sys.argv[2])
with start_process(path, directory=folder / "run", faults=["temperature_5=missing@0"]) as process:
    reached = with_endpoints(load_stand(path), process.served.endpoints())
    with record_wires(reached, folder / "session.txt") as tapped:
        rows = check_stand(tapped, WallClock(), watch_s=0.0)
print(json.dumps({f"{row.device} {row.item}": [row.value, row.verdict.value, row.remark] for row in rows}))
"""


@pytest.mark.slow
def test_check_and_transcripts_know_it_on_its_wire(laboratory: Path, tmp_path: Path) -> None:
    (laboratory / "checked.py").write_text(CHECKED, encoding="utf-8")
    done = run(laboratory, "checked", stand_with(tmp_path, METER), tmp_path)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)
    value, verdict, _ = rows["temperature_4 temperature_4"]
    assert (verdict, "°C (buffer head)" in value) == ("ok", True)
    assert rows["temperature_4 identity"][0] == "input 1"
    assert "its input is open" in rows["temperature_5 reading"][2]
    assert rows["temperature_1 temperature_1"][1] == "ok"
    text = (tmp_path / "session.txt").read_text(encoding="utf-8")
    assert "# thermometers_2: pt100-meter, 9600 baud" in text
    assert b"R1\r\n".hex(" ") in text
