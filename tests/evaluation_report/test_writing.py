from __future__ import annotations

import copy
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.sections.verdicts import name_of
from bufferstand.evaluation.report.source import fields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.writing import write_report
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.hashes import file_hash
from bufferstand.recording.finding.run_facts import run_files
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import PAPER_LIKE, hand_made_document, write_campaign
from tests.evaluation_report.make_runs import Made as MadeRun
from tests.evaluation_report.test_content import strings

FEW = (PAPER_LIKE[0], PAPER_LIKE[3])

IN_ANOTHER_PROCESS = """
import sys
from pathlib import Path
from bufferstand.evaluation.report.sections.verdicts import name_of
from bufferstand.evaluation.report.writing import write_report
from tests.evaluation_report.make_runs import hand_made_document
from tests.evaluation_report.test_writing import FEW
write_report(Path(sys.argv[1]), Path(sys.argv[2]), document=hand_made_document(FEW))
"""


def test_the_same_runs_give_the_same_bytes_in_another_process_zone_and_place(tmp_path: Path) -> None:
    folder = write_campaign(tmp_path / "campaign", FEW)
    document = hand_made_document(FEW)
    first = write_report(folder, tmp_path / "one", document=document)
    moved = tmp_path / "elsewhere" / "campaign"
    shutil.copytree(folder, moved)
    environment = os.environ | {
        "PYTHONHASHSEED": "7",
        "TZ": "Asia/Tokyo",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-c", IN_ANOTHER_PROCESS, str(moved), str(tmp_path / "two")]
    subprocess.run(command, check=True, env=environment, timeout=300)
    assert [path.name for path in first] == ["campaign-report.html", "campaign-report.pdf"]
    for path in first:
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
    assert not list((tmp_path / "one").glob("*.tmp"))


def test_a_single_run_makes_a_report_of_its_own(tmp_path: Path, report: Made) -> None:
    file = report.folder / "runs" / "04-h-20-20-c.h5"
    (path,) = write_report(file, tmp_path / "deep" / "er", formats=("html",), document=hand_made_document())
    assert path == tmp_path / "deep" / "er" / "04-h-20-20-c-report.html"
    text = path.read_text()
    assert "h-20-20-c" in text
    assert "static-1" not in text


def test_runs_are_found_below_runs_or_directly(report: Made, tmp_path: Path) -> None:
    assert run_files([report.folder]) == run_files([report.folder / "runs"])
    one = report.folder / "runs" / "01-static-1.h5"
    assert run_files([one]) == [one]
    with pytest.raises(BadInput, match=r"no run files .* in this folder"):
        run_files([tmp_path])
    with pytest.raises(BadInput, match="no such file or folder"):
        run_files([tmp_path / "nothing"])


def test_runs_are_in_the_order_of_their_start_with_their_files_hashes(report: Made) -> None:
    assert [run.id for run in report.source.runs] == [made.id for made in PAPER_LIKE]
    for run in report.source.runs:
        assert run.sha256 == file_hash(report.folder / "runs" / run.file)


def test_a_damaged_run_is_named_and_the_others_are_reported(report: Made, tmp_path: Path) -> None:
    folder = tmp_path / "campaign"
    shutil.copytree(report.folder, folder)
    broken = folder / "runs" / "02-h-20-20-a.h5"
    broken.write_bytes(broken.read_bytes()[:5000])
    (folder / "runs" / "12-left.journal").write_bytes(b"x")
    source = read_source(folder, hand_made_document())
    assert len(source.runs) == len(PAPER_LIKE) - 1
    assert any(
        "02-h-20-20-a.h5 could not be read and is not in this report" in text for text in source.findings
    )
    assert any("12-left.journal" in text for text in source.findings)


def test_two_runs_of_one_id_are_told_apart_or_refused_by_name(tmp_path: Path) -> None:
    """A copy is the same run and is in the report once; another run of the same id cannot be."""
    folder = write_campaign(tmp_path / "campaign", FEW)
    file = sorted((folder / "runs").glob("*.h5"))[0]
    shutil.copy(file, file.with_name("copy.h5"))
    source = read_source(folder, hand_made_document(FEW))
    assert len(source.runs) == len(FEW)
    (finding,) = source.findings
    assert str(file) in finding
    assert "copy.h5" in finding
    other = write_campaign(tmp_path / "other", FEW, specimen="another")
    shutil.copytree(other, folder / "other")
    with pytest.raises(BadInput, match="which has the same id: one report cannot tell them apart") as refused:
        read_source(folder, hand_made_document(FEW))
    assert str(folder / "other") in refused.value.message()
    assert str(folder / "runs") in refused.value.message()


def test_a_damaged_file_alone_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.h5"
    file.write_bytes(b"no HDF5")
    with pytest.raises(BadInput, match=r"run\.h5"):
        read_source(file, hand_made_document())


def test_a_document_of_other_runs_or_other_content_is_refused(report: Made) -> None:
    with pytest.raises(BadInput, match="lacks run “h-80-10”"):
        read_source(report.folder, hand_made_document(PAPER_LIKE[:-1]))
    other = copy.deepcopy(hand_made_document())
    other["runs"][0]["run"]["sha256"] = "0" * 64
    with pytest.raises(BadInput, match="of another content of run “static-1”"):
        read_source(report.folder, other)
    with pytest.raises(BadInput, match="not an evaluation document"):
        read_source(report.folder, {"schema": "something else"})


def test_an_unknown_format_is_refused_before_anything_is_done(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no report format “docx”; use html or pdf"):
        write_report(tmp_path / "nothing", tmp_path, formats=("docx",), document=hand_made_document())


def test_without_typst_the_pdf_is_refused_with_the_remedy(
    report: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "typst", None)
    file = report.folder / "runs" / "04-h-20-20-c.h5"
    with pytest.raises(BadInput, match=r"typst, which is not installed; install it"):
        write_report(file, tmp_path, document=hand_made_document())
    assert not list(tmp_path.iterdir()), "a report is whole or not there"


def test_a_folder_that_cannot_be_written_is_bad_input(report: Made, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    file = report.folder / "runs" / "04-h-20-20-c.h5"
    with pytest.raises(BadInput, match="the report cannot be written"):
        write_report(file, tmp_path / "file", formats=("html",), document=hand_made_document())


def test_report_toml_fills_in_and_a_wrong_key_is_named(tmp_path: Path) -> None:
    path = tmp_path / fields.FILE_NAME
    path.write_text('customer = "Wagon works"\nissued = 2026-03-09\ndeviations = ["one", "two"]\n')
    read = fields.load_fields(tmp_path)
    assert (read.customer, str(read.issued), read.deviations) == ("Wagon works", "2026-03-09", ("one", "two"))
    path.write_text('custommer = "Wagon works"\n')
    with pytest.raises(BadInput, match="did you mean “customer”"):
        fields.load_fields(tmp_path)
    path.write_text('amends = "BR-1"\n')
    with pytest.raises(BadInput, match="does not say why"):
        fields.load_fields(tmp_path)
    assert fields.load_fields(tmp_path / "nowhere") == fields.ReportFields()


def test_a_specimen_with_markup_in_its_name_goes_all_the_way(tmp_path: Path) -> None:
    runs = (MadeRun("h", 20.0, 10.0, 0.5, 3),)
    folder = write_campaign(tmp_path / "campaign", runs, specimen="<script>alert(1)</script>")
    (path,) = write_report(folder, tmp_path, formats=("html",), document=hand_made_document(runs))
    text = path.read_text()
    assert "<script" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text


def test_without_a_document_the_runs_are_evaluated_and_the_rule_is_stated(tmp_path: Path) -> None:
    runs = (PAPER_LIKE[0], PAPER_LIKE[2], PAPER_LIKE[4])
    folder = write_campaign(tmp_path / "campaign", runs, rate_Hz=100.0)
    source = read_source(folder, given=Given(options=Options(decision_rule="guard-band")))
    text = "\n".join(strings(build_content(source).document()))
    assert "Guard band (ILAC-G8:09/2019, w = U)" in text
    static = source.runs[0]
    assert static.evaluated["verdict"] == "inconclusive"
    assert len(static.cycles) == 3
    for requirement in static.requirements:
        assert name_of(requirement) in text
    damping = [run.result("damping") for run in source.runs]
    # The loops of make_runs.py: unloading at 0.55 of the loading force.
    assert damping[0] == pytest.approx(0.45, abs=0.005)
    assert f"{damping[0]:.3f}" in text


def test_a_document_without_a_rule_is_not_credited_with_one(report: Made) -> None:
    document = {key: value for key, value in hand_made_document().items() if key != "decision_rule"}
    text = "\n".join(strings(build_content(read_source(report.folder, document)).document()))
    assert "does not state by which decision rule" in text
    assert "Simple acceptance" not in text


def test_a_workbook_may_lie_in_the_folder_that_the_report_makes(report: Made, tmp_path: Path) -> None:
    out = tmp_path / "new" / "report"
    written = write_report(
        report.folder, out, formats=("html",), document=hand_made_document(), table=out / "report.xlsx"
    )
    assert [path.name for path in written] == [f"{report.folder.name}-report.html", "report.xlsx"]
    assert all(path.is_file() for path in written)
    with pytest.raises(BadInput, match="no such folder"):
        write_report(report.folder, out, formats=("html",), table=tmp_path / "other" / "report.xlsx")
    assert not (tmp_path / "other").exists()
