"""Details that a reader stumbles over: hashes in sentences, the order of channels, signs, full stops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bufferstand.evaluation.figures.trends import TrendSeries
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Picture, Section, Sheet, Table, Texts
from bufferstand.evaluation.report.pictures.trends import _warned
from bufferstand.evaluation.report.sections.identity import calibrations, stand_sheet
from bufferstand.evaluation.report.sections.results import runs_section
from bufferstand.evaluation.report.sections.statements import warnings_section
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.wording import Language
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_content import with_evaluated

HASH = "3e51eb16c711e049dd65b5362975aa8a853367f60e94c6c8d7b0a83d6810c870"
PROFILE = "bufferstand-ring edition 3"


def with_metadata(source: ReportSource, **changes: object) -> ReportSource:
    runs = tuple(replace(run, metadata=dict(run.metadata) | changes) for run in source.runs)
    return replace(source, runs=runs)


def test_a_hash_in_the_name_of_the_controller_is_shortened(report: Made) -> None:
    stand = dict(report.source.runs[0].metadata["stand"])
    for identity in (f"ring {PROFILE} sha256 {HASH}", {"profile": f"{PROFILE} sha256 {HASH}"}):
        sheet = stand_sheet(with_metadata(report.source, stand=stand | {"identity": identity}))
        assert isinstance(sheet, Sheet)
        (text,) = [cell.text for name, cell in sheet.facts if name == "Controller"]
        assert text.endswith(f"{PROFILE}, SHA-256\u00a03e51eb16c711…")


def test_the_force_comes_first_among_the_calibrations(report: Made) -> None:
    streams = report.source.runs[0].metadata["streams"]
    force, *_ = streams["controller"]["channels"]
    second = {"second": {"channels": [force | {"name": "force_2"}]}}
    section = calibrations(with_metadata(report.source, streams=second | dict(streams)))
    assert isinstance(section, Section)
    (table,) = section.blocks
    assert isinstance(table, Table)
    names = list(dict.fromkeys(row[0].text for row in table.rows))
    assert names == ["force", "force_2", "stroke_1", "stroke_2", "temperature_1", "temperature_2"]


def test_a_correlation_has_a_true_minus_sign_in_every_language() -> None:
    warning = "confounded: temperature differs by 1.8 K between the runs (correlation with frequency -0.88)"
    one, two = (TrendSeries(name, np.zeros(2), np.zeros(2), np.zeros(2)) for name in ("a", "b"))
    (caption,) = _warned([({}, one), ({"warnings": [warning]}, two)])
    assert "frequency −0.88)" in caption
    assert "vermengt: Die Temperatur" in Language("de").say(caption)
    assert "Frequenz −0,88)" in Language("de").say(caption)


def test_every_warning_is_a_sentence(report: Made) -> None:
    told = ["no summary: no cycle is complete and steady", "Something else was seen."]
    section = warnings_section(with_evaluated(report.source, 1, warnings=told))
    assert section is not None
    (texts,) = section.blocks
    assert isinstance(texts, Texts)
    assert "Run 1: no summary: no cycle is complete and steady." in texts.items
    assert "Run 1: Something else was seen." in texts.items


def test_no_verdict_and_no_permitted_range_of_a_run_that_characterises(report: Made) -> None:
    first = next(run for run in report.source.runs if run.kind == "static")
    source = with_evaluated(report.source, first.number, purpose="characterisation")
    (table,) = runs_section(source).blocks
    assert isinstance(table, Table)
    verdict = table.rows[first.number - 1][-1]
    assert (verdict.text, verdict.why) == ("—", "characterisation: no statement of conformity rests on it")
    content = build_content(source)
    (picture,) = [one for one in content.certificate if isinstance(one, Picture)]
    assert picture.plot.windows == ()
    assert "permitted" not in picture.caption
    judged = build_content(report.source)
    (picture,) = [one for one in judged.certificate if isinstance(one, Picture)]
    assert picture.plot.windows
