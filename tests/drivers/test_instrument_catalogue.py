"""Every kind of instrument keeps its contract; one of a laboratory's own package is as good as ours."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal

import pytest

from bufferstand.drivers.instruments import catalogue
from bufferstand.drivers.instruments.catalogue import kind_of, kinds, stream_name
from bufferstand.drivers.instruments.kind import TAGS, SerialKind, SignalKind
from bufferstand.drivers.instruments.wire_address import SerialAddress, TcpAddress
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings import Settings
from tests.drivers.conftest import SAMPLE_STAND
from tests.house.house_page import ROOT, example_of, files_of

SAMPLES = SAMPLE_STAND.parent
SIGNALS = [kind for kind in kinds() if isinstance(kind, SignalKind)]
FURTHER = """
[[amplifier]]
protocol = "aed"
port = "wires/amplifier_2"
rate_Hz = 100.0
range_kN = 630.0
channel = { name = "force_3", quantity = "force", unit = "kN", calibration = { id = "x", coefficients = [0.0, 7.885695443832332e-05] } }

[[sensor]]
kind = "modbus"
rate_Hz = 50.0
channel = { name = "pressure_1", quantity = "pressure", unit = "bar", calibration = { id = "gauge", coefficients = [0.0, 1.0] } }
modbus = { map = "dms-float", host = "127.0.0.1", tcp_port = 15021 }
"""  # noqa: E501 - as a user writes it


def stand_with(folder: Path, tables: str = FURTHER) -> Path:
    """Write the sample stand with further instruments, its amplifier as an entry of a list."""
    text = SAMPLE_STAND.read_text(encoding="utf-8").replace('model = "', f'model = "{SAMPLES}/', 1)
    text = text.replace("[amplifier]\n", "[[amplifier]]\n").replace(
        "[amplifier.channel]", "[amplifier.channel]"
    )
    path = folder / "stand.toml"
    path.write_text(text + tables, encoding="utf-8")
    return path


def test_our_kinds_are_there_and_each_is_a_folder() -> None:
    found = {(kind.table, kind.name) for kind in kinds()}
    assert found >= {
        ("amplifier", "gsv2"),
        ("amplifier", "aed"),
        ("amplifier", "modbus"),
        ("sensor", "modbus"),
    }
    for kind in SIGNALS:
        folder = ROOT / "drivers" / "amplifiers" / kind.name.replace("-", "_")
        assert {file.stem for file in folder.glob("*.py")} >= {"__init__", "kind", "settings", "amplifier"}


@pytest.mark.parametrize("kind", SIGNALS, ids=lambda kind: f"{kind.table}-{kind.name}")
def test_a_kind_says_what_it_is_and_how_it_is_reached(kind: SignalKind[Any], tmp_path: Path) -> None:
    assert kind.__doc__
    entry: dict[str, Any] = {
        TAGS[kind.table]: kind.name,
        "port": "wire",
        "rate_Hz": 20.0,
        "channel": {"name": "force_2", "quantity": "force", "unit": "kN"},
    }
    entry |= {"range_kN": 600.0} if kind.table == "amplifier" else {}
    entry |= {"modbus": {"map": "dms-float"}} if kind.name == "modbus" else {}
    if kind.name == "ascii-line":
        entry |= {"line": {"description": "mantracourt-dsc", "answers": {"station": "001", "decimals": 3}}}
    settings = kind.settings.model_validate(entry)
    assert kind_of(settings) is kind
    form = kind.form(settings, tmp_path)
    assert form.low < 0.0 < form.high
    assert form.rate_Hz == form.every * 20.0
    wire = kind.wire(settings, tmp_path)
    assert isinstance(wire, SerialAddress)
    assert wire.path == tmp_path / "wire"
    moved = kind.moved(settings, tmp_path / "elsewhere")
    assert kind.wire(moved, Path("/nowhere")).path == tmp_path / "elsewhere"
    assert (kind.simulated(settings) is None) == (kind.registers(settings, tmp_path) is not None)


def test_what_a_kind_leaves_out_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    class NoRate(Settings):
        protocol: Literal["x"]
        channel: Channel

    class OtherName(NoRate):
        rate_Hz: float
        protocol: Literal["x"]

    whole = {"name": "x", "table": "amplifier", "settings": OtherName}
    for changes, said in [
        ({"settings": NoRate}, r"settings of instrument “x” .* have no key rate_Hz"),
        ({"name": "y"}, r"protocol of .*OtherName.* must be Literal\['y'\]"),
        ({"table": "sensor"}, r"settings of instrument “x” .* have no key kind"),
    ]:
        methods = {"driver": lambda *_: None, "form": lambda *_: None}
        kind = type("Incomplete", (SerialKind,), whole | changes | methods)()
        monkeypatch.setattr(catalogue, "_in_folder", lambda kind=kind: iter([kind]))
        with pytest.raises(TypeError, match=said):
            kinds.__wrapped__()
    with pytest.raises(TypeError, match=r"abstract method.*driver"):
        type("NoDriver", (SerialKind,), whole | {"form": lambda *_: None})()


def test_two_of_a_name_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "_installed", lambda: iter([type(kinds()[0])()]))
    with pytest.raises(TypeError, match=r"two kinds of \[\[amplifier\]\] are called aed"):
        kinds.__wrapped__()


def test_a_stand_lists_as_many_as_it_has(tmp_path: Path) -> None:
    stand = load_stand(stand_with(tmp_path))
    assert [one.stream for one in stand.instruments] == ["amplifier", "amplifier_2", "sensor"]
    assert [one.channel.name for one in stand.instruments] == ["force_2", "force_3", "pressure_1"]
    written = stand.model_dump(mode="json")
    assert [one["protocol"] for one in written["amplifier"]] == ["gsv2", "aed"]
    assert type(stand).model_validate_json(json.dumps(written)).model_dump(mode="json") == written
    last = stand.instruments[-1]
    assert last.kind.wire(last.settings, tmp_path) == TcpAddress("127.0.0.1", 15021)
    assert stream_name("sensor", 1) == "sensor_2"


def test_one_amplifier_is_written_as_ever(tmp_path: Path) -> None:
    listed = load_stand(stand_with(tmp_path, ""))
    assert (
        listed.model_dump_json()
        == load_stand(SAMPLE_STAND).model_copy(update={"simulation": listed.simulation}).model_dump_json()
    )
    assert isinstance(listed.model_dump()["amplifier"], dict)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'protocol = "aed"',
            'protocol = "aed"\nbauds = 1',
            r"line 147: amplifier.bauds: unknown key “bauds”",
        ),
        ('kind = "modbus"', 'kind = "modbas"', "kind"),
        ("rate_Hz = 100.0", "rate_Hz = 900.0", "line .*rate_Hz = 900 does not fit the line"),
        ('name = "force_3"', 'name = "force_2"', "two channels of the stand have the name “force_2”"),
        (
            'name = "pressure_1", quantity = "pressure"',
            'name = "pressure_1", quantity = "presure"',
            "quantity",
        ),
    ],
)
def test_a_wrong_entry_is_refused_with_its_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in FURTHER
    with pytest.raises(BadInput) as refused:
        load_stand(stand_with(tmp_path, FURTHER.replace(old, new)))
    assert re.search(said, refused.value.message()), refused.value.message()


# --- a package of a laboratory's own ----------------------------------------------------------------


def install_example(folder: Path, page: str, package: str) -> Path:
    """Install the package of a how-to page in a folder on the import path, with its entry point."""
    (folder / package).mkdir()
    (folder / package / "__init__.py").write_text(example_of(page, "python"), encoding="utf-8")
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (group,) = re.findall(r'entry-points\."(.*)"', example_of(page, "toml"))
    named = example_of(page, "toml").splitlines()[1].replace('"', "")
    (about / "entry_points.txt").write_text(f"[{group}]\n{named}\n")
    return folder


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install_example(tmp_path_factory.mktemp("laboratory"), "add-an-instrument.md", "our_amplifier")


def run(laboratory: Path, *words: object) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join((str(ROOT), str(laboratory)))
    return subprocess.run(
        [sys.executable, "-P", "-m", *map(str, words)],
        env=os.environ | {"PYTHONPATH": paths},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_the_page_names_one_folder_a_test_and_a_page() -> None:
    source, test, page = files_of("Add an instrument", "lines")
    assert (source, test, page) == (
        "drivers/amplifiers/lines/",
        "tests/drivers/test_lines.py",
        "docs/sensors.md",
    )


@pytest.mark.slow
def test_the_contract_suite_drives_a_kind_of_a_package(laboratory: Path) -> None:
    done = run(
        laboratory, "pytest", "-q", "-p", "no:cacheprovider", "tests/contract/amplifier", "-k", "lines"
    )
    assert done.returncode == 0, done.stdout
    (passed,) = re.findall(r"(\d+) passed", done.stdout)
    assert int(passed) >= 8


def test_a_stand_file_names_it_and_its_schema_has_it(laboratory: Path, tmp_path: Path) -> None:
    entry = FURTHER.split("[[sensor]]", maxsplit=1)[0].replace('"aed"', '"lines"')
    path = stand_with(tmp_path, entry)
    code = (
        "import sys; from pathlib import Path; from bufferstand.drivers.stand_file import load_stand; "
        "print([one.kind.name for one in load_stand(Path(sys.argv[1])).instruments])"
    )
    paths = os.pathsep.join((str(ROOT), str(laboratory)))
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, path],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "['gsv2', 'lines']"
    schema = run(laboratory, "bufferstand", "schema", "stand")
    assert "LinesSettings" in json.loads(schema.stdout)["$defs"]
    with pytest.raises(BadInput, match="protocol = “lines” is not known"):  # here it is not installed
        load_stand(path)


def test_a_package_that_cannot_be_loaded_is_refused_by_name(laboratory: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken-1.0.dist-info"
    broken.mkdir()
    (broken / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (broken / "entry_points.txt").write_text("[bufferstand.instruments]\nbad = nowhere_at_all:KIND\n")
    done = run(tmp_path, "bufferstand", "check", SAMPLE_STAND)
    assert done.returncode == 2
    assert "instrument “bad” of broken cannot be loaded" in done.stderr
    assert "Traceback" not in done.stderr
