"""Reports of the shipped campaigns and a comparison, in each language: no English left, pages that hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.report.source.specimens import side_by_side
from bufferstand.evaluation.wording import ENGLISH, Code, Language, language_of, said
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.daq.test_paper_at_80 import SAMPLES, campaign_at_80
from tests.evaluation_report.test_figures import cut_labels
from tests.evaluation_report.test_languages import MORE_PAGES, OTHERS, left_in_english
from tests.evaluation_report.test_pages import Printed, broken
from tests.evaluation_report.test_pages_of_comparison import of_specimen
from tests.evaluation_report.test_paper_section import of_paper
from tests.house.test_recipes import RUNS

GIVEN = Given(options=Options(draws=200), fields=ReportFields())


@dataclass(frozen=True)
class Reported:
    """A report that can be built in each language, and the records that it is of."""

    sources: tuple[ReportSource, ...]
    build: Callable[[Language], Content]


def of_source(source: ReportSource) -> Reported:
    whole = replace(source, detailed=True)
    return Reported((whole,), lambda language: build_content(replace(whole, language=language)))


def run_here(campaign: Path, folder: Path) -> Reported:
    """Run a campaign in virtual time and return its report."""
    plan, stand_file = sample_plan(campaign)
    opened = open_in_process(stand_file)
    outcome = run_campaign(plan, opened.stand, opened.clock, folder, facts_of(stand_file), settings=COARSE)
    assert outcome.status == "complete", outcome.reason
    return of_source(read_source(folder, None, GIVEN))


def standard(folder: Path) -> Reported:
    """Return the report of ``en15551.toml``."""
    return run_here(SAMPLES / "en15551.toml", folder / "out")


def paper_at_80(folder: Path) -> Reported:
    """Return that of ``paper.toml`` without what is not at 80 mm."""
    return run_here(campaign_at_80(folder), folder / "out")


def paper(_folder: Path) -> Reported:
    """Return a report as of ``paper.toml``, of the shipped runs, which are some of its steps."""
    return of_source(of_paper(read_source(RUNS, None, GIVEN)))


def comparison(_folder: Path) -> Reported:
    """Return the comparison of three specimens."""
    source = read_source(RUNS, None, GIVEN)
    sources = [of_specimen(source, *one) for one in (("KX-1", 6), ("KX-2", 6), ("KX-3", 4))]

    def build(language: Language) -> Content:
        own = [replace(one, language=language) for one in sources]
        return build_comparison(side_by_side(own, ReportFields()))

    return Reported(tuple(sources), build)


CASES = (standard, paper_at_80, paper, comparison)
"""The second takes the longest: a run of every test has the others."""


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case.__name__)
def reported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Reported:
    made: Reported = request.param(tmp_path_factory.mktemp("campaign"))
    return made


@pytest.fixture(scope="module")
def printed(reported: Reported) -> dict[Code, Printed]:
    return {code: printed_in(reported, code) for code in ("en", *OTHERS)}


def printed_in(reported: Reported, code: Code) -> Printed:
    content = reported.build(ENGLISH if code == "en" else language_of(code))
    figures = [draw(one.plot, content.language) for one in content.pictures()]
    return Printed(code, content, render_pdf(content, figures))


@pytest.mark.dose(3)
def test_no_sentence_of_ours_is_left_in_english(reported: Reported) -> None:
    content = reported.build(ENGLISH)
    for code in OTHERS:
        left = [left_in_english(content, source, code) for source in reported.sources]
        assert set.intersection(*left) == set(), code


@pytest.mark.dose(3)
def test_the_pages_hold_the_longer_words(printed: dict[Code, Printed]) -> None:
    """No number broken over a line, no heading alone at the end of a page, few pages more."""
    pages = {code: len(one.texts()) for code, one in printed.items()}
    assert {code for code in OTHERS if pages[code] > pages["en"] + MORE_PAGES} == set(), pages
    for code, one in printed.items():
        assert list(broken(one.pdf)) == [], code
        assert alone(one, Language(code)) == [], code


def alone(made: Printed, language: Language) -> list[str]:
    """Return the headings that end a page, each with what it heads on the next."""
    titles = {block.title for s in made.content.sections for block in s.blocks if hasattr(block, "title")}
    titles |= {section.title for section in made.content.sections} | {language.say(said("Annex"))}
    ends = []
    for text in made.texts():
        lines = [line.strip() for line in text.splitlines()]
        ends.append([line for line in lines if line and line != made.content.subtitle][-1])
    return [line for line in ends if line in titles]


@pytest.mark.dose(3)
def test_no_label_of_a_figure_is_cut(reported: Reported) -> None:
    pictures = reported.build(ENGLISH).pictures()
    for code in OTHERS:
        cut = {one.caption: cut_labels(one, language_of(code)) for one in pictures}
        assert {caption: labels for caption, labels in cut.items() if labels} == {}, code


def test_a_sentence_in_english_and_a_heading_alone_would_be_found() -> None:
    reported = comparison(Path())
    content = reported.build(language_of("de"))
    named = replace(content, notices=(*content.notices, "The moon is of the same cheese."))
    found = [left_in_english(named, source, "de") for source in reported.sources]
    assert set.intersection(*found) == {"The moon is of the same cheese."}
    made = printed_in(reported, "de")
    last = [line.strip() for line in made.texts()[1].splitlines() if line.strip()]
    heading = [line for line in last if line != content.subtitle][-1]
    (first, *others) = made.content.sections
    headed = replace(made.content, sections=(replace(first, title=heading), *others))
    assert alone(replace(made, content=headed), Language("de")) == [heading]
