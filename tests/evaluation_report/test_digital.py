"""The digital test report says what the printed one says, in elements and units that machines read."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.recordings.report import command
from bufferstand.evaluation.catalogue.quantity import UNITS
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.numbers import value_text
from bufferstand.evaluation.report.digital.elements import DCC, PROOF, SI, said
from bufferstand.evaluation.report.digital.proof import evaluation_hash
from bufferstand.evaluation.report.digital.quantities import DSI_UNITS, exact, numbers
from bufferstand.evaluation.report.digital.whole import render_digital
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.report.writing import write_report
from bufferstand.foundation.channels.channel import CHANNEL_UNITS
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.hashes import file_hash
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import PAPER_LIKE, hand_made_document, write_campaign

WHOLE = ReportFields(
    number="P-2026-17",
    laboratory="Test hall 2",
    laboratory_address="Studentská 1402/2, Liberec",
    country="CZ",
    place_of_test="Test hall 2",
    customer="Railway <&> Sons",
    customer_address="Praha",
    method="EN 15551:2022, procedure P-7 rev. 3",
    received=date(2026, 2, 20),
    issued=date(2026, 3, 9),
    tested_by="J. Novák",
    checked_by="A. Dvořák",
    authorised_by="B. Malá",
    amends="BR-0123456789ab",
    amends_issued=date(2026, 3, 1),
    amendment_reason="serial number",
    amendment_changes=("Serial number 0815.",),
)


def rendered(source: ReportSource) -> ET.Element:
    return ET.fromstring(render_digital(source, build_content(source)))


def one(parent: ET.Element, path: str) -> ET.Element:
    found = parent.find(path, {"dcc": DCC, "si": SI})
    assert found is not None, path
    return found


def texts(parent: ET.Element, path: str) -> list[str]:
    return [str(found.text) for found in parent.iterfind(path, {"dcc": DCC, "si": SI})]


@pytest.fixture(scope="module")
def root(report: Made) -> ET.Element:
    return rendered(report.source)


def quantities(root: ET.Element, result: str) -> Iterator[tuple[str, ET.Element]]:
    """Return the quantities of a result, each with its name."""
    for found in root.iter(f"{{{DCC}}}result"):
        if result in texts(found, "dcc:name/dcc:content")[0]:
            for quantity in found.iterfind("dcc:data/dcc:list/dcc:quantity", {"dcc": DCC}):
                yield texts(quantity, "dcc:name/dcc:content")[0], quantity


def test_results_are_those_of_the_evaluation_rounded_as_printed(report: Made, root: ET.Element) -> None:
    for run in report.source.runs:
        of = dict(quantities(root, f"Run {run.number} ("))
        entry = run.summary["stored_energy_J"]
        real = one(of["Stored energy"], "si:real")
        spread = one(real, "si:expandedUnc")
        value, expanded = (one(real, "si:value").text, one(spread, "si:uncertainty").text)
        assert f"{value} ± {expanded}" == value_text(entry["value"], entry["expanded_uncertainty"])
        assert one(real, "si:unit").text == r"\joule"
        assert one(spread, "si:coverageFactor").text == "2"
        assert one(spread, "si:coverageProbability").text == "0.95"


def test_every_requirement_has_its_limits_and_a_verdict_only_where_there_is_one(
    report: Made, root: ET.Element
) -> None:
    (static,) = [run for run in report.source.runs if run.stated]
    given = dict(quantities(root, "requirements"))
    assert len(given) == len(static.stated)
    energy = one(given["Stored energy, cycle 1"], "dcc:measurementMetaData/dcc:metaData")
    assert texts(energy, "dcc:conformity") == ["pass"]
    assert texts(energy, "dcc:norm") == ["EN 15551:2022"]
    assert texts(energy, "dcc:convention") == ["ILAC-G8:09/2019, simple acceptance, w = 0"]
    assert texts(energy, "dcc:data/dcc:quantity/si:real/si:value") == ["12500"]
    untested = given["Force at 100 mm, cycle 1"]
    meta = one(untested, "dcc:measurementMetaData/dcc:metaData")
    assert texts(meta, "dcc:conformity") == []
    assert "the record ends at 95.0 mm" in texts(meta, "dcc:declaration/dcc:content")[0]
    assert texts(untested, "dcc:noQuantity/dcc:content") == ["no value: the record ends at 95.0 mm"]


def test_a_clause_that_is_not_on_record_is_said_and_marks_a_draft(report: Made) -> None:
    document = copy.deepcopy(hand_made_document())
    for entry in document["runs"]:
        for requirement in entry["requirements"]:
            requirement |= {"clause": None, "edition": None, "source": "a paper"}
    runs = tuple(
        replace(run, evaluated={**run.evaluated, "requirements": entry["requirements"]})
        for run, entry in zip(report.source.runs, document["runs"], strict=True)
    )
    root = rendered(replace(report.source, runs=runs, document=document))
    (_, first), *_ = quantities(root, "requirements")
    meta = one(first, "dcc:measurementMetaData/dcc:metaData")
    assert meta.get("refType") == "basic_conformity bufferstand_draft"
    assert texts(meta, "dcc:norm") == ["EN 15551: edition not on record"]
    assert texts(meta, "dcc:reference") == ["EN 15551, clause not on record (source: a paper)"]


def test_who_where_and_when_are_those_of_the_laboratory_and_the_runs(report: Made) -> None:
    source = replace(report.source, fields=WHOLE)
    root = rendered(source)
    core = one(root, "dcc:administrativeData/dcc:coreData")
    assert one(core, "dcc:countryCodeISO3166_1").text == "CZ"
    assert one(core, "dcc:uniqueIdentifier").text == build_content(source).report_id
    assert one(core, "dcc:identifications/dcc:identification/dcc:value").text == "P-2026-17"
    starts = [run.started.date() for run in source.runs if run.started]
    assert one(core, "dcc:beginPerformanceDate").text == min(starts).isoformat()
    assert one(core, "dcc:performanceLocation").text == "laboratory"
    assert one(core, "dcc:issueDate").text == "2026-03-09"
    assert texts(core, "dcc:reportAmendedSubstituted/dcc:replacedUniqueIdentifier") == ["BR-0123456789ab"]
    data = one(root, "dcc:administrativeData")
    assert texts(data, "dcc:customer/dcc:name/dcc:content") == ["Railway <&> Sons"]
    assert texts(data, "dcc:respPersons/dcc:respPerson/dcc:person/dcc:name/dcc:content") == [
        "J. Novák",
        "A. Dvořák",
        "B. Malá",
    ]
    assert texts(data, "dcc:items/dcc:item/dcc:identifications/dcc:identification/dcc:value") == [
        "KX-0815",
        "0815",
    ]
    assert "Draft" not in texts(data, "dcc:statements/dcc:statement/dcc:name/dcc:content")


def test_what_is_missing_makes_a_draft_that_says_so_first(root: ET.Element) -> None:
    first = one(root, "dcc:administrativeData/dcc:statements/dcc:statement")
    assert first.get("refType") == "bufferstand_draft"
    said_of_it = texts(first, "dcc:declaration/dcc:content")
    assert "country of the laboratory (country = “…” in report.toml)" in said_of_it
    assert "date of issue" in said_of_it


def test_channels_stand_with_certificate_dates_and_limits(report: Made, root: ET.Element) -> None:
    (channel, *_) = report.source.runs[0].fact("streams")["controller"]["channels"]
    equipment = next(root.iter(f"{{{DCC}}}measuringEquipment"))
    assert channel["name"] in texts(equipment, "dcc:name/dcc:content")[0]
    assert channel["calibration"]["id"] in texts(
        equipment, "dcc:identifications/dcc:identification/dcc:value"
    )
    held = texts(equipment, ".//dcc:noQuantity/dcc:content")
    assert channel["calibration"]["date"] in held
    assert channel["calibration"]["valid_until"] in held


def test_the_hashes_are_those_of_the_files(report: Made, root: ET.Element) -> None:
    proof = one(root, f"dcc:comment/{{{PROOF}}}proof")
    files = {str(found.get("file")): str(found.text) for found in proof.iterfind(f"{{{PROOF}}}run")}
    on_disk = {file.name: file_hash(file) for file in (report.folder / "runs").glob("*.h5")}
    assert files == on_disk
    assert one(proof, f"{{{PROOF}}}evaluation").text == evaluation_hash(report.source.document)
    assert one(proof, f"{{{PROOF}}}report").text == report.content.report_id


def test_the_evaluations_hash_is_that_of_its_figures_wherever_the_files_lay() -> None:
    document = hand_made_document()
    first = evaluation_hash(document)
    moved = copy.deepcopy(document)
    moved["software"] = {"version": "9"}
    for entry in moved["runs"]:
        entry["run"]["path"] = "elsewhere.h5"
    assert evaluation_hash(moved) == first
    moved["runs"][0]["summary"]["damping"]["value"] += 1e-9
    assert evaluation_hash(moved) != first


def test_the_same_source_gives_the_same_bytes(report: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    first = render_digital(report.source, report.content)
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert render_digital(report.source, build_content(report.source)) == first
    assert first.startswith(b'<?xml version="1.0" encoding="UTF-8"?>\n<!-- Digital test report BR-')


def test_runs_that_do_not_say_when_they_were_made_are_refused(report: Made) -> None:
    def undated(metadata: Any) -> Any:
        return {**metadata, "run": {**metadata["run"], "started_utc": None, "ended_utc": None}}

    runs = tuple(replace(run, metadata=undated(run.metadata)) for run in report.source.runs)
    source = replace(report.source, runs=runs)
    with pytest.raises(BadInput, match="no run says when it was made") as refused:
        render_digital(source, build_content(source))
    assert "--dtr" in refused.value.remedy


def test_every_unit_of_results_and_channels_is_known_to_d_si() -> None:
    assert {*UNITS, *(unit for units in CHANNEL_UNITS.values() for unit in units)} <= DSI_UNITS.keys()


@pytest.mark.parametrize(
    ("value", "expanded", "written"),
    [
        (18098.84, 140.9, ("18100", "140")),
        (0.45266, 0.0024, ("0.4527", "0.0024")),
        (-0.0004, 0.041, ("0.000", "0.041")),
        (5.0, 0.0996, ("5.00", "0.10")),
        (94.40575, None, ("94.41", "")),
        (-0.00001, None, ("0", "")),
        (12_345.6, 0.0, ("12350", "")),
    ],
)
def test_numbers_are_rounded_to_two_digits_of_u(
    value: float, expanded: float | None, written: tuple[str, str]
) -> None:
    assert numbers(value, expanded) == written


def test_limits_keep_all_their_digits() -> None:
    assert [exact(value) for value in (12500.0, 0.42, -0.0, 1e-7, 2.0 / 3.0)] == [
        "12500",
        "0.42",
        "0",
        "0.0000001",
        "0.666666666667",
    ]


def test_names_cannot_break_the_file() -> None:
    assert said("a\x00b \x1b[31m\n\tc") == r"a\x00b \x1b[31m c"
    assert said("") == "not on record"


def test_the_command_writes_it_alone_or_beside_the_others(tmp_path: Path) -> None:
    folder = write_campaign(tmp_path / "campaign", PAPER_LIKE[3:4])
    file = tmp_path / "report.xml"
    done = CliRunner().invoke(command, [str(folder), "--dtr", str(file)], standalone_mode=False)
    assert done.exit_code == 0, done.output
    assert done.stdout.split() == [str(file)]
    assert ET.parse(file).getroot().get("schemaVersion") == "3.2.1"
    both = write_report(folder, tmp_path / "out", formats=("html",), digital=tmp_path / "again.xml")
    assert [path.name for path in both] == ["campaign-report.html", "again.xml"]
    assert both[1].read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ((), "nothing says where"),
        (("--dtr", "no-folder/report.xml"), "no such folder"),
        (("AGAIN", "--out", "out", "--dtr", "report.xml"), "of the runs of one PATH"),
    ],
)
def test_where_it_is_to_be_written_must_make_sense(
    report: Made, tmp_path: Path, words: tuple[str, ...], problem: str
) -> None:
    runs = sorted((report.folder / "runs").glob("*.h5"))
    given = [str(runs[1]) if word == "AGAIN" else word for word in words]
    given = [str(tmp_path / word) if word.endswith(".xml") or word == "out" else word for word in given]
    done = CliRunner().invoke(command, [str(runs[0]), *given], standalone_mode=False)
    assert isinstance(done.exception, BadInput)
    assert problem in done.exception.problem
    assert list(tmp_path.iterdir()) == []
