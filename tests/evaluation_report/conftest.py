"""One campaign of eleven synthetic runs, and everything that is made from it, for all tests of the room."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import pytest

from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.evaluation.report.source.source import ReportSource
from tests.evaluation_report import signed_reports
from tests.evaluation_report.make_runs import hand_made_document, write_campaign
from tests.evaluation_report.signed_reports import SignedReport


@dataclass
class Made:
    """A report of the whole campaign."""

    folder: Path
    source: ReportSource
    content: Content
    figures: tuple[str, ...]
    html: str
    pdf: bytes

    @cached_property
    def detailed(self) -> Content:
        """The same report with the tables by cycle and every budget in its annex."""
        return build_content(replace(self.source, detailed=True))


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = write_campaign(tmp_path_factory.mktemp("campaign"))
    source = read_source(folder, hand_made_document())
    content = build_content(source)
    figures = tuple(draw(picture.plot) for picture in content.pictures())
    return Made(folder, source, content, figures, render_html(content, figures), render_pdf(content, figures))


@pytest.fixture(scope="session")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> SignedReport:
    return signed_reports.made(tmp_path_factory.mktemp("signed"))
