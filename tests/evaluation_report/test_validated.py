"""What the report says of the validation of its software."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.report.content.content import Section, Sheet, Texts
from bufferstand.evaluation.report.sections.software import software_section
from bufferstand.evaluation.report.source.fields import read_fields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.validation.standard_sets import shipped_sets
from bufferstand.evaluation.validation.validation_record import validate
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made


@cache
def validation_record() -> Mapping[str, Any]:
    """Return the record of a validation by one set."""
    (one,) = (one for one in shipped_sets() if one.id == "closed-form/elastic")
    return validate([one], by="J. Novák", made=datetime(2026, 3, 1, 9, 0, tzinfo=UTC)).document()


def words(section: Section) -> str:
    parts = []
    for block in section.blocks:
        if isinstance(block, Sheet):
            parts += [f"{name}: {cell.text}" for name, cell in block.facts]
        if isinstance(block, Texts):
            parts += block.items
    return "\n".join(parts)


def evaluated_by(source: ReportSource, code: str) -> ReportSource:
    document = {**source.document, "software": {"version": "0.1.0", "code_sha256": code}}
    return dataclasses.replace(source, document=document, validation=validation_record())


def test_a_validated_version_is_stated_with_its_hashes(report: Made) -> None:
    record = validation_record()
    text = words(software_section(evaluated_by(report.source, record["software"]["code_sha256"])))
    assert "2026-03-01 09:00" in text
    assert "By: J. Novák" in text
    assert "3 of 3 agreed values in 1 sets" in text
    assert record["sha256"] in text
    assert "another version" not in text


def test_a_record_of_another_version_proves_nothing_and_says_so(report: Made) -> None:
    assert "another version" in words(software_section(evaluated_by(report.source, "0" * 64)))


def test_a_bad_validation_is_told(report: Made) -> None:
    record = {**validation_record(), "good": False, "values_missed": 2}
    source = dataclasses.replace(report.source, validation=record)
    text = words(software_section(source))
    assert "1 of 3 agreed values" in text
    assert "must not be relied upon" in text


def test_no_record_is_said(report: Made) -> None:
    source = dataclasses.replace(report.source, validation=None)
    assert "No validation record is named" in words(software_section(source))


def test_the_record_is_found_beside_report_toml_and_a_wrong_one_refused(report: Made, tmp_path: Path) -> None:
    (tmp_path / "validation.json").write_text(json.dumps(validation_record()), encoding="utf-8")
    (tmp_path / "report.toml").write_text('validation = "validation.json"\n', encoding="utf-8")
    given = Given(fields=read_fields(tmp_path / "report.toml"))
    source = read_source(report.folder, report.source.document, given)
    assert source.validation == validation_record()
    (tmp_path / "validation.json").write_text("{}", encoding="utf-8")
    with pytest.raises(BadInput, match="no validation record"):
        read_source(report.folder, report.source.document, given)
