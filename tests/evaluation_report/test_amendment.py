"""A report that replaces another one names it by its hash, and says which figures are others."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pikepdf
import pytest

from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.report import write_comparison, write_report
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content import Content, Sheet, Texts
from bufferstand.evaluation.report.source import Given, ReportFields, read_fields, read_source
from bufferstand.evaluation.report.verifying import Against, Finding, verify_report
from bufferstand.foundation import BadInput
from tests.evaluation_report.signed_reports import GIVEN, RUN, SignedReport


def fields(old: Path, **more: str) -> ReportFields:
    return ReportFields(
        amends_report=str(old),
        amendment_reason="serial number corrected",
        amendment_changes=("Serial number 0815 instead of 0816.",),
        **more,
    )


def amended(old: Path, options: Options = GIVEN.options) -> Content:
    return build_content(read_source(RUN, given=replace(GIVEN, options=options, fields=fields(old))))


def said(content: Content) -> tuple[dict[str, str], list[str]]:
    """Return facts and texts of the section on the amendment."""
    (section,) = [one for one in content.sections if one.id == "amendment"]
    facts = {n: c.text for block in section.blocks if isinstance(block, Sheet) for n, c in block.facts}
    return facts, [text for block in section.blocks if isinstance(block, Texts) for text in block.items]


def identity(pdf: bytes) -> str:
    with pikepdf.open(io.BytesIO(pdf)) as document:
        proof = json.loads(document.attachments["proof.json"].get_file().read_bytes())
    return str(proof["report"])


def test_it_names_the_report_that_it_replaces_by_id_and_hash(sealed: SignedReport, tmp_path: Path) -> None:
    old = sealed.put(tmp_path, sealed.signed)
    content = amended(old)
    facts, texts = said(content)
    assert facts["SHA-256 of its PDF"] == sha256(sealed.signed).hexdigest()
    assert texts[-2:] == [
        "Serial number 0815 instead of 0816.",
        "No result and no verdict is another than in that report.",
    ]
    was = identity(sealed.signed)
    assert f"Amendment: this report replaces report {was}, which is no longer valid." in content.notices
    assert content.report_id != was
    assert "reevaluation" not in [section.id for section in content.sections]


def test_figures_that_are_others_are_listed(sealed: SignedReport, tmp_path: Path) -> None:
    content = amended(sealed.put(tmp_path, sealed.plain), replace(GIVEN.options, moving_mass_kg=900.0))
    _, texts = said(content)
    assert texts[-1] == "Results, verdicts or runs are others: see Comparison with the earlier evaluation."
    (section,) = [one for one in content.sections if one.id == "reevaluation"]
    assert any("moving mass kg" in cell.text for cell in section.blocks[1].rows[0])  # type: ignore[union-attr]


@pytest.mark.slow
def test_verify_compares_it_with_the_report_that_it_replaces(sealed: SignedReport, tmp_path: Path) -> None:
    old = sealed.put(tmp_path / "old", sealed.signed)
    given = replace(GIVEN, fields=fields(old))
    (new,) = write_report(RUN, tmp_path / "new", formats=("pdf",), given=given)

    def found(path: Path | None) -> Finding:
        findings = verify_report(new, Against(runs=(RUN,), predecessor=path))
        (only,) = [finding for finding in findings if finding.place == "predecessor"]
        return only

    assert found(None).level == "note"
    assert found(old).level == "holds"
    unsigned = sealed.put(tmp_path / "unsigned", sealed.plain)
    assert (found(unsigned).level, "its SHA-256 is another" in found(unsigned).text) == ("fault", True)
    assert "this one replaces BR-" in found(new).text
    (none,) = [
        finding for finding in verify_report(old, Against(predecessor=new)) if finding.place == "predecessor"
    ]
    assert (none.level, none.text.endswith("this report replaces none")) == ("fault", True)


def test_the_report_that_is_replaced_is_kept(sealed: SignedReport, tmp_path: Path) -> None:
    old = tmp_path / f"{RUN.stem}-report.pdf"
    old.write_bytes(sealed.plain)
    with pytest.raises(BadInput, match="would take the place of the one that it replaces"):
        write_report(RUN, tmp_path, formats=("pdf",), given=replace(GIVEN, fields=fields(old)))
    assert old.read_bytes() == sealed.plain


@pytest.mark.slow
def test_a_comparison_names_it_too(sealed: SignedReport, tmp_path: Path) -> None:
    old = sealed.put(tmp_path, sealed.plain)
    other = RUN.with_name("005-harmonic-20mm-20mm-1.27Hz.h5")
    given = replace(GIVEN, fields=fields(old))
    (pdf,) = write_comparison([RUN, other], tmp_path / "out", formats=("pdf",), given=given)
    findings = verify_report(pdf, Against(runs=(RUN.parent,), predecessor=old))
    assert [finding for finding in findings if finding.level == "fault"] == []
    assert [finding.level for finding in findings if finding.place == "predecessor"] == ["holds"]
    assert [finding.level for finding in findings if finding.place.startswith("evaluation-")] == ["holds"] * 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            'amends = "BR-000000000000"\namends_report = "report.pdf"\namendment_reason = "x"\n',
            "this is report BR-",
        ),
        ('amends_report = "gone.pdf"\namendment_reason = "x"\n', "gone.pdf: cannot be read"),
        ('amends_report = "report.toml"\namendment_reason = "x"\n', "no PDF that is whole"),
        ('amends_report = "report.pdf"\n', "amendment_reason: the report amends"),
        ('amendment_reason = "x"\n', "add amends_report, the PDF of the report that it replaces"),
    ],
)
def test_what_does_not_fit_together_gets_one_message(
    sealed: SignedReport, tmp_path: Path, text: str, words: str
) -> None:
    sealed.put(tmp_path, sealed.plain)
    (tmp_path / "report.toml").write_text(text)
    with pytest.raises(BadInput) as caught:
        read_source(RUN, given=Given(options=GIVEN.options, fields=read_fields(tmp_path / "report.toml")))
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
