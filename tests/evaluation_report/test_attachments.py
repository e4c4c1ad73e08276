"""What the PDF has inside: read by another program than the one that put it there."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import pikepdf
import pytest

import bufferstand as bs
from bufferstand.evaluation.archive import load_evaluation
from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.report import write_comparison, write_report
from bufferstand.evaluation.report.attachments import attachments_of
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.digital import render_digital
from bufferstand.evaluation.report.rendering import render_pdf
from bufferstand.evaluation.report.source import Given, ReportFields, read_source
from bufferstand.foundation.files import file_hash
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import hand_made_document
from tests.evaluation_report.test_rendering import pages, squeezed


def inside(pdf: bytes) -> dict[str, bytes]:
    """Return the files inside a PDF, by name."""
    with pikepdf.open(io.BytesIO(pdf)) as document:
        return {name: one.get_file().read_bytes() for name, one in document.attachments.items()}


def attached(report: Made) -> bytes:
    source = report.source
    digital = render_digital(source, report.content)
    files = attachments_of(report.content, source, {"evaluation.json": source.evaluation_json}, digital)
    return render_pdf(report.content, report.figures, files)


@pytest.fixture(scope="module")
def pdf(report: Made) -> bytes:
    return attached(report)


def test_the_pdf_says_that_it_is_pdf_a_3b_and_lists_its_files_as_its_data(pdf: bytes) -> None:
    with pikepdf.open(io.BytesIO(pdf)) as document:
        said = document.open_metadata()
        assert (said["pdfaid:part"], said["pdfaid:conformance"]) == ("3", "B")
        files = list(document.Root.AF)
        assert [str(one.UF) for one in files] == ["digital-report.xml", "evaluation.json", "proof.json"]
        assert {str(one.AFRelationship) for one in files} == {"/Data"}
        assert [str(one.EF.F.Subtype) for one in files] == [
            "/application/xml",
            "/application/json",
            "/application/json",
        ]


def test_the_evaluation_inside_is_the_one_that_the_report_is_made_from(
    report: Made, pdf: bytes, tmp_path: Path
) -> None:
    (tmp_path / "evaluation.json").write_bytes(inside(pdf)["evaluation.json"])
    document = load_evaluation(tmp_path / "evaluation.json")
    given = hand_made_document()
    assert [entry["run"]["id"] for entry in document["runs"]] == [run.id for run in report.source.runs]
    by_id = {entry["run"]["id"]: entry for entry in given["runs"]}
    for entry in document["runs"]:
        own = by_id[entry["run"]["id"]]
        assert {key: entry[key] for key in own if key != "run"} == {
            k: v for k, v in own.items() if k != "run"
        }
        assert {**entry["run"], "path": None} == {**own["run"], "path": None}
        assert entry["run"]["path"].startswith("runs/")
    assert document["trends"] == given["trends"]


def test_the_hash_of_the_evaluation_is_printed_and_those_of_the_runs_are_inside(
    report: Made, pdf: bytes
) -> None:
    files = inside(pdf)
    text = squeezed("".join(pages(pdf)))
    assert sha256(files["evaluation.json"]).hexdigest() in text
    proof = json.loads(files["proof.json"])
    assert proof["report"] == report.content.report_id
    assert proof["evaluations"] == [
        {"file": "evaluation.json", "sha256": sha256(files["evaluation.json"]).hexdigest()}
    ]
    assert {one["file"]: one["sha256"] for one in proof["runs"]} == {
        path.name: file_hash(path) for path in (report.folder / "runs").glob("*.h5")
    }


def test_the_same_report_has_the_same_bytes_wherever_its_folder_lies(
    report: Made, pdf: bytes, tmp_path: Path
) -> None:
    assert attached(report) == pdf
    moved = tmp_path / report.folder.name
    moved.symlink_to(report.folder)
    source = read_source(moved, hand_made_document())
    assert source.evaluation_json == report.source.evaluation_json


def test_runs_of_an_evaluation_that_are_not_in_the_report_are_not_in_its_file(report: Made) -> None:
    strange = {"run": {"id": "of-another-customer", "path": "x.h5"}, "cycles": []}
    document = hand_made_document()
    source = read_source(report.folder, {**document, "runs": [*document["runs"], strange]})
    assert b"of-another-customer" not in source.evaluation_json


def test_names_of_folders_of_a_machine_are_left_out(report: Made) -> None:
    document: Mapping[str, Any] = {
        **hand_made_document(),
        "copies": [{"path": "/srv/lab/copy.h5", "of": "a", "same": "file"}],
        "failures": [{"path": "/srv/lab/torn.h5", "problem": "torn"}],
    }
    source = read_source(report.folder, document)
    assert b"/srv/lab" not in source.evaluation_json
    assert b'"path":"torn.h5"' in source.evaluation_json


def test_another_evaluation_gives_another_report(report: Made) -> None:
    entry = report.source.runs[0]
    changed = {**entry.evaluated, "cycles": [{**entry.evaluated["cycles"][0], "damping": 0.3210001}]}
    runs = (replace(entry, evaluated=changed), *report.source.runs[1:])
    other = replace(report.source, runs=runs)
    assert build_content(other).report_id != report.content.report_id


def test_a_comparison_has_the_evaluation_of_each_side(report: Made, tmp_path: Path) -> None:
    runs = sorted((report.folder / "runs").glob("*.h5"))
    given = Given(fields=ReportFields())
    written = write_comparison(runs[:2], tmp_path, formats=("pdf",), given=given)
    files = inside(written[0].read_bytes())
    assert set(files) == {"evaluation-A.json", "evaluation-B.json", "proof.json"}
    for name, run in zip(("evaluation-A.json", "evaluation-B.json"), runs[:2], strict=True):
        document = json.loads(files[name])
        assert [entry["run"]["path"] for entry in document["runs"]] == [run.name]
        assert document["settings"]


def test_what_is_written_has_its_files_inside(report: Made, tmp_path: Path) -> None:
    written = write_report(report.folder, tmp_path, formats=("pdf",), document=hand_made_document())
    assert set(inside(written[0].read_bytes())) == {"digital-report.xml", "evaluation.json", "proof.json"}


def test_the_digital_report_inside_is_the_one_that_is_written_alone(report: Made, tmp_path: Path) -> None:
    document = hand_made_document()
    pdf, alone = write_report(
        report.folder, tmp_path, formats=("pdf",), document=document, digital=tmp_path / "alone.xml"
    )
    files = inside(pdf.read_bytes())
    assert files["digital-report.xml"] == alone.read_bytes()
    proof = json.loads(files["proof.json"])
    assert proof["attached"] == [{"file": "digital-report.xml", "sha256": file_hash(alone)}]


def test_runs_that_do_not_say_when_they_were_made_give_a_report_without_a_digital_one(
    tmp_path: Path,
) -> None:
    record = tmp_path / "record.csv"
    lines = [
        f"{n / 50},{50 + 50 * math.sin(n / 50)},{300 + 250 * math.sin(n / 50 + 0.1)}" for n in range(1500)
    ]
    record.write_text("\n".join(["time [s],stroke [mm],force [kN]", *lines]))
    run = bs.import_record(record, tmp_path / "runs").path
    given = Given(options=Options(draws=0), fields=ReportFields())
    (pdf,) = write_report(run, tmp_path, formats=("pdf",), given=given)
    assert set(inside(pdf.read_bytes())) == {"evaluation.json", "proof.json"}
