"""A crate holds what it describes, says nothing of the machine, and is the same bytes each time."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from bufferstand.evaluation.publication import crate as crate_module
from bufferstand.evaluation.publication import publish
from bufferstand.evaluation.report import Given, write_report
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.runfile.file import open_run, read_metadata
from bufferstand.recording.sealing.verification import verify

from .conftest import FULL, LEAST, QUICK, Crate, campaign

pytestmark = pytest.mark.slow


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_every_file_is_described_with_its_size_and_hash(crate: Crate) -> None:
    files = contents(crate.folder)
    described = {one["@id"]: one for one in crate.graph.values() if one["@type"] == "File"}
    assert set(files) == {*described, "ro-crate-metadata.json", "ro-crate-preview.html"}
    assert set(described) == {part["@id"] for part in crate.graph["./"]["hasPart"]}
    for name, entity in described.items():
        assert entity["sha256"] == hashlib.sha256(files[name]).hexdigest()
        assert entity["contentSize"] == str(len(files[name]))
    runs = [name for name in files if name.endswith(".h5")]
    assert len(runs) == crate.published.runs == 2
    for name in runs:
        run = open_run(crate.folder / name)
        assert crate.graph[described[name]["identifier"]["@id"]]["value"] == run.sha256
        assert not [fault for fault in verify(crate.folder / name) if fault.level == "fault"]
        assert run.samples_sha256 == open_run(crate.campaign / name).samples_sha256


def test_every_reference_within_the_crate_leads_somewhere(crate: Crate) -> None:
    def references(value: object) -> list[str]:
        if isinstance(value, dict):
            return [value["@id"]] if set(value) == {"@id"} else []
        return [one for item in value for one in references(item)] if isinstance(value, list) else []

    for entity in crate.graph.values():
        for key, value in entity.items():
            for target in references(value):
                assert target in crate.graph or key == "conformsTo", (entity["@id"], key, target)


def test_who_what_and_with_what_is_described(crate: Crate) -> None:
    root = crate.graph["./"]
    assert root["name"] == "SIMULATED: Stiffness of a buffer"
    assert root["description"].startswith("These data are simulated: no specimen was tested. Static")
    assert root["license"] == {"@id": "https://spdx.org/licenses/CC-BY-4.0"}
    assert (root["datePublished"], root["version"]) == ("2026-11-28", "2")
    assert [one["@id"] for one in root["author"]] == [
        "https://orcid.org/0000-0002-1825-0097",
        "#person-J.%20Svoboda",
    ]
    person = crate.graph["https://orcid.org/0000-0002-1825-0097"]
    assert crate.graph[person["affiliation"]["@id"]]["name"] == "Laboratory"
    cited = [crate.graph[one["@id"]] for one in root["citation"]]
    assert [one["name"].split()[0] for one in cited] == ["The", "bufferstand"]
    specimen = crate.graph[root["about"]["@id"]]
    assert specimen["identifier"] == "A-105-E-01"
    stand = crate.graph["#stand-simulated-630kN"]
    parts = [crate.graph[one["@id"]] for one in stand["isRelatedTo"]]
    (cell,) = [one for one in parts if one.get("identifier") == "GTM-K-630-0001"]
    facts = {
        crate.graph[one["@id"]]["name"]: crate.graph[one["@id"]]["value"]
        for one in cell["additionalProperty"]
    }
    assert facts["calibration: date"] == "2026-01-15"
    assert facts["calibration: certificate"] == "simulated"
    assert facts["uncertainty: accuracy_percent"] == 0.5
    for run in [one for one in crate.graph.values() if one["@id"].startswith("#run-")]:
        assert run["object"] == {"@id": "#specimen-A-105-E-01"}
        assert {"@id": "#stand-simulated-630kN"} in run["instrument"]
        assert run["startTime"] < run["endTime"]


def test_evaluation_and_report_are_of_the_published_files(crate: Crate) -> None:
    document = json.loads((crate.folder / "evaluation.json").read_text(encoding="utf-8"))
    assert {one["run"]["path"]: one["run"]["sha256"] for one in document["runs"]} == {
        f"runs/{path.name}": read_metadata(path)["content_sha256"]
        for path in (crate.folder / "runs").iterdir()
    }
    assert document["runs"][0]["summary"]["damping"]["value"] == pytest.approx(
        publish_value(crate), rel=1e-12
    )
    for kind in ("html", "pdf"):
        assert (crate.folder / "report" / f"demo-report.{kind}").stat().st_size > 10_000


def publish_value(crate: Crate) -> float:
    """Return the damping of the first run as it was recorded."""
    from bufferstand.evaluation.document import evaluate_paths

    (path, _) = sorted((crate.campaign / "runs").iterdir())
    document = evaluate_paths([path], QUICK.options)
    return float(document["runs"][0]["summary"]["damping"]["value"])


def test_nothing_of_the_machine_is_in_it(crate: Crate, tmp_path_factory: pytest.TempPathFactory) -> None:
    secrets = ("127.0.0.1", "wires/", str(tmp_path_factory.getbasetemp()), ".publishing-", str(Path.home()))
    for path in crate.folder.rglob("*"):
        if path.is_file():
            text = (
                str(open_run(path).metadata)
                if path.suffix == ".h5"
                else path.read_bytes().decode(errors="replace")
            )
            assert [secret for secret in secrets if secret in text] == [], path
    assert "stand.controller.host" in crate.published.withheld
    assert crate.published.names == ("customer “demonstration”", "operator “demo”")
    assert crate.published.remarks == ("publication.toml has no author[2].orcid, which repositories ask for",)


AGAIN = """
import sys
from pathlib import Path
from bufferstand.evaluation.publication import publish
from tests.evaluation_publication.conftest import QUICK
publish(Path(sys.argv[1]), Path(sys.argv[2]), judging=QUICK)
"""


def test_a_file_made_in_another_process_zone_and_place_has_the_same_bytes(
    crate: Crate, tmp_path: Path
) -> None:
    moved = tmp_path / "elsewhere" / "another name"
    shutil.copytree(crate.campaign, moved)
    publish(crate.campaign, tmp_path / "one.zip", judging=QUICK)
    (tmp_path / "two.zip").write_text("an earlier one")
    environment = os.environ | {
        "PYTHONHASHSEED": "7",
        "TZ": "Asia/Tokyo",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-c", AGAIN, str(moved), str(tmp_path / "two.zip")]
    subprocess.run(command, check=True, env=environment, timeout=600)
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "two.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "one.zip") as archive:
        assert archive.testzip() is None
        assert {name: archive.read(name) for name in archive.namelist()} == contents(crate.folder)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elsewhere", "one.zip", "two.zip"]


def test_run_files_are_published_byte_by_byte_where_that_is_asked_for(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "campaign", LEAST)
    published = publish(folder, tmp_path / "crate", judging=QUICK, as_recorded=True)
    assert published.withheld == ()
    assert contents(folder / "runs") == contents(tmp_path / "crate" / "runs")


def refused(folder: Path, out: Path) -> str:
    """Return why nothing is published; what was there is as it was."""
    before = sorted(out.parent.rglob("*"))
    with pytest.raises(BadInput) as why:
        publish(folder, out, judging=QUICK)
    assert sorted(out.parent.rglob("*")) == before
    return str(why.value)


def test_a_damaged_run_is_not_published(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "campaign", runs="00[34]*.h5")
    path = sorted((folder / "runs").iterdir())[1]
    data = bytearray(path.read_bytes())
    data[-2000] ^= 1
    path.chmod(0o644)
    path.write_bytes(data)
    said = refused(folder, tmp_path / "crate.zip")
    assert path.name in said
    assert "damaged or altered" in said


def test_a_campaign_that_is_not_at_rest_is_not_published(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "campaign")
    (folder / "runs" / "004.journal").write_bytes(b"BSJ1")
    assert "004.journal" in refused(folder, tmp_path / "crate.zip")


def test_a_place_that_holds_something_else_or_lies_in_the_campaign_is_refused(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "campaign")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("mine")
    (tmp_path / "file").write_text("mine")
    assert "not empty" in refused(folder, tmp_path / "full")
    assert "no .zip" in refused(folder, tmp_path / "file")
    assert "campaign’s own folder" in refused(folder, folder / "crate")
    assert "no such folder" in refused(folder, tmp_path / "missing" / "crate")
    assert "no such folder" in refused(folder, tmp_path / "missing" / "crate.zip")


def test_without_the_library_it_is_said_how_to_add_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(crate_module, "find_spec", lambda _: None)
    assert "rocrate" in refused(campaign(tmp_path / "campaign"), tmp_path / "crate.zip")


def test_only_runs_that_are_known_to_be_simulated_are_called_so(crate: Crate) -> None:
    from bufferstand.evaluation.publication.entities import PublishedRun

    def run(name: str, simulated: bool | None) -> PublishedRun:
        facts = {"id": name} | ({} if simulated is None else {"simulated": simulated})
        return PublishedRun(f"runs/{name}.h5", {"run": facts})

    assert crate_module.simulated_words([run("a", False), run("b", None)]) == ("", "")
    mark, text = crate_module.simulated_words([run("a", True), run("b", False)])
    assert mark == "PARTLY SIMULATED: "
    assert text == "Of the 2 runs 1 are simulated, without a specimen: a. "


def test_the_command_says_what_was_left_out_and_what_is_missing(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "campaign", LEAST)

    def said(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-P", "-m", "bufferstand", "publish", "campaign", *words]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600)

    good = said("--out", "crate.zip")
    assert good.returncode == 0, good.stderr
    assert "1 run(s), without" in good.stdout
    assert "stand.controller.host" in good.stdout
    assert "operator “demo”" in good.stdout
    assert "has no software_url" in good.stderr
    (folder / "publication.toml").write_text(FULL.replace("title", "titel"), encoding="utf-8")
    bad = said("--out", "other.zip")
    assert bad.returncode == 2
    assert "publication.toml" in bad.stderr
    assert "Traceback" not in bad.stderr
    assert not (tmp_path / "other.zip").exists()


def test_a_copy_for_others_takes_no_number_of_the_range(tmp_path: Path) -> None:
    made = campaign(tmp_path / "campaign", LEAST)
    given = {
        **dict.fromkeys(("laboratory", "laboratory_address", "place_of_test", "customer", "method"), "T"),
        **dict.fromkeys(("customer_address", "checked_by", "authorised_by"), "T"),
        "number": "PB-{year}-{running:04}",
        "number_register": "../numbers.csv",
    }
    lines = [
        *(f'{key} = "{value}"' for key, value in given.items()),
        "received = 2026-02-20",
        "issued = 2026-03-09",
    ]
    (made / "report.toml").write_text("\n".join(lines), encoding="utf-8")
    write_report(made, tmp_path / "report", formats=("html",), given=Given(options=QUICK.options))
    register = tmp_path / "numbers.csv"
    before = register.read_bytes()
    assert b"PB-2026-0001" in before
    published = publish(made, tmp_path / "crate", judging=QUICK)
    assert register.read_bytes() == before
    assert any("no number of the range" in remark for remark in published.remarks)
    (html,) = (tmp_path / "crate" / "report").glob("*.html")
    assert "PB-2026" not in html.read_text(encoding="utf-8")
