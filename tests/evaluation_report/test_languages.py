"""A whole report in each language: nothing of ours left in English, the same figures, pages that hold."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import openpyxl
import pytest

from bufferstand.daq.guards.missing_guards import unguarded_at
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.figures.paint import draw
from bufferstand.evaluation.figures.trends import TrendSeries
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content import Cell, Content, Picture, Table
from bufferstand.evaluation.report.pictures.trends import _warned
from bufferstand.evaluation.report.rendering.html import render_html
from bufferstand.evaluation.report.rendering.pdf import render_pdf
from bufferstand.evaluation.report.source.fields import ReportFields, read_fields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.report.source.specimens import side_by_side
from bufferstand.evaluation.report.writing import write_report
from bufferstand.evaluation.wording import LANGUAGES, Code, Language, Worded, language_of
from bufferstand.foundation import BadInput
from tests.evaluation_report.campaigns import settling, write_eventful_campaign
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import hand_made_document
from tests.evaluation_report.test_content import with_run
from tests.evaluation_report.test_rendering import pages, squeezed
from tests.house.test_recipes import RUNS as SAMPLES
from tests.monitor.browser import chromium

OTHERS: tuple[Code, ...] = LANGUAGES[1:]
PHONE = {"width": 390, "height": 844}
MORE_PAGES = 2
"""So many more than the English report may one in another language have."""
OF_NOBODY = frozenset({"bufferstand", "SHA-256", "Monte Carlo"})


@dataclass(frozen=True)
class Spoken:
    content: Content
    html: str
    pages: list[str]


@pytest.fixture(scope="module")
def spoken_reports(report: Made) -> dict[Code, Spoken]:
    made = {}
    for code in OTHERS:
        source = replace(report.source, language=language_of(code, "Europe/Prague"))
        content = build_content(source)
        figures = [draw(picture.plot, content.language) for picture in content.pictures()]
        made[code] = Spoken(content, render_html(content, figures), pages(render_pdf(content, figures)))
    return made


def parts_of(text: str) -> Iterator[str]:
    """Return the plain texts that a text is made of."""
    if not isinstance(text, Worded):
        yield text
        return
    made_of = text._made_of
    inner = [*made_of.get("facts", {}).values(), *made_of.get("parts", ()), made_of.get("text")]
    for one in inner:
        if isinstance(one, str):
            yield from parts_of(one)


def plain_texts(value: Any) -> Iterator[str]:
    """Return every plain text of content, but for codes and names of fields."""
    if isinstance(value, str):
        yield from parts_of(value)
    elif isinstance(value, tuple):
        for one in value:
            yield from plain_texts(one)
    elif is_dataclass(value) and not isinstance(value, Language) and getattr(value, "tone", "") != "code":
        for one in fields(value):
            if one.name not in {"id", "tone", "suffix", "kind", "verdict", "software", "ended", "unit"}:
                yield from plain_texts(getattr(value, one.name))


def cells_of(content: Content) -> Iterator[Cell]:
    blocks = [*content.certificate, *(block for section in content.sections for block in section.blocks)]
    for block in blocks:
        table = block.numbers if isinstance(block, Picture) else block
        if isinstance(table, Table):
            yield from (cell for row in table.rows for cell in row)


def test_every_text_of_ours_can_be_said_in_a_language(report: Made) -> None:
    """A plain text is one of the records, the document or the laboratory; ours know what they are made of."""
    recorded = json.dumps([run.metadata for run in report.source.runs], ensure_ascii=False, default=str)
    recorded += json.dumps(report.source.document, ensure_ascii=False, default=str)
    recorded += " ".join(run.file for run in report.source.runs) + report.source.name
    recorded = recorded.replace('\\"', '"')
    ours = {
        text
        for text in plain_texts(report.detailed)
        if re.search(r"[A-Za-z]{3}", text) and text.strip() not in recorded and text not in OF_NOBODY
        if Language("de").say(text) == text  # else a reason that is told by its form
    }
    left = {text for text in ours if not all(part.strip(" .") in recorded for part in text.split("; "))}
    assert {text for text in left if not re.fullmatch(r"[\d ]+(min|h|s|[\d ])+", text)} == set()


@pytest.mark.parametrize("code", OTHERS)
def test_figures_are_the_same_in_every_language(
    report: Made, spoken_reports: dict[Code, Spoken], code: Code
) -> None:
    content = spoken_reports[code].content
    english, other = list(cells_of(report.content)), list(cells_of(content))
    assert len(english) == len(other) > 500
    compared = 0
    for one, same in zip(english, other, strict=True):
        assert one.tone == same.tone
        if one.tone == "number":
            assert content.language.plain(same.text) == str(one.text)
            compared += "." in one.text
    assert compared > 200
    for drawn, same_drawn in zip(report.content.pictures(), content.pictures(), strict=True):
        for line, same_line in zip(drawn.plot.curves, same_drawn.plot.curves, strict=True):
            np.testing.assert_array_equal(line.y, same_line.y)


@pytest.mark.parametrize("code", OTHERS)
def test_no_english_heading_is_left(report: Made, spoken_reports: dict[Code, Spoken], code: Code) -> None:
    content = spoken_reports[code].content
    assert content.report_id != report.content.report_id
    for section, same in zip(report.content.sections, content.sections, strict=True):
        assert section.id == same.id
        assert section.title != same.title or (code, section.title) == ("fr", "Figures")
    english = {cell.text for cell in cells_of(report.content) if cell.tone in {"good", "bad", "open"}}
    assert english & {cell.text for cell in cells_of(content)} == set()


@pytest.mark.parametrize("code", OTHERS)
def test_the_pages_hold_the_longer_words(
    report: Made, spoken_reports: dict[Code, Spoken], code: Code
) -> None:
    made = spoken_reports[code]
    assert len(made.pages) <= len(pages(report.pdf)) + MORE_PAGES
    text = squeezed("".join(made.pages))
    for section in made.content.sections:
        assert squeezed(section.title) in text
    statement = made.content.certificate[0]
    assert squeezed(statement.sentence) in squeezed(made.pages[0])  # type: ignore[union-attr]
    for number, page in enumerate(made.pages, start=1):
        words = {"de": "Seite {} von {}", "cs": "Strana {} z {}", "fr": "Page {} sur {}"}[code]
        assert words.format(number, len(made.pages)) in page


ENGLISH = re.compile(
    r"\b(the|of|is|are|and|which|from|by|with|has|cannot|not|what|that|between|at least|same|first|whole)\b"
)
"""Words that a sentence of ours has in English, and none in another language."""
NOT_OURS = ("not_guarded", "readings", "in_force")
"""Facts of a run file in words of ours: they are no laboratory's."""


def laboratory_says(source: ReportSource) -> str:
    """Return everything on record that somebody wrote: names, titles, places, models."""

    def given(value: Any) -> Iterator[str]:
        if isinstance(value, str):
            yield value
        elif isinstance(value, dict | list | tuple):
            pairs = value.items() if isinstance(value, dict) else enumerate(value)
            yield from (text for key, one in pairs if key not in NOT_OURS for text in given(one))

    texts = [text for run in source.runs for text in (*given(run.metadata), run.file)]
    return "\n".join(texts) + source.name


def left_in_english(content: Content, source: ReportSource, code: Code) -> set[str]:
    """Return the plain texts of a report that its language leaves as they are, and that are ours."""
    recorded = laboratory_says(source)
    return {
        text
        for text in plain_texts(content)
        if ENGLISH.search(text) and text.strip(" .") not in recorded and Language(code).say(text) == text
    }


@pytest.fixture(scope="module")
def spoken_sources(tmp_path_factory: pytest.TempPathFactory) -> list[ReportSource]:
    """Reports that the evaluation is ours of: the samples, a campaign with holds, a force that drifts."""
    folder = tmp_path_factory.mktemp("spoken")
    time, stroke, force = settling()
    drifting = ("drifting", "harmonic", (time, stroke, force + 20.0 * time / time[-1]), {})
    paths = [
        SAMPLES,
        write_eventful_campaign(folder / "e"),
        write_eventful_campaign(folder / "d", [drifting]),
    ]
    given = Given(options=Options(draws=200))
    return [read_source(path, None, given) for path in paths]


@pytest.mark.parametrize("code", OTHERS)
def test_no_sentence_of_ours_is_left_in_english(spoken_sources: list[ReportSource], code: Code) -> None:
    """In no report: also not what the evaluation found or the stand could not guard."""
    unguarded = (unguarded_at(6.0, cast(StandFile, SimpleNamespace(amplifier="there")))[0],)
    for source in spoken_sources:
        metadata = {**source.runs[0].metadata}
        metadata["limits"] = {**metadata.get("limits", {}), "not_guarded": unguarded}
        full = replace(with_run(source, 1, metadata=metadata), detailed=True)
        assert left_in_english(build_content(full), full, code) == set()
    pair = side_by_side(spoken_sources[:2], ReportFields())
    whole = build_comparison(pair)
    assert {
        text
        for text in left_in_english(whole, spoken_sources[0], code)
        if text not in laboratory_says(spoken_sources[1])
    } == set()


def test_a_sentence_without_translation_would_be_found(spoken_sources: list[ReportSource]) -> None:
    source = spoken_sources[2]
    metadata = {**source.runs[0].metadata}
    metadata["limits"] = {"not_guarded": ["the moon, which is not there"]}
    source = with_run(source, 1, metadata=metadata)
    assert left_in_english(build_content(source), source, "de") == {"the moon, which is not there"}


QUESTIONS = re.compile(
    r"(What|How|Where|Was|Wie|Wo|Co|Jak|Kde|Ce qu|Comment|Où|Against|Gegenüber|Oproti)\b|.*\bothers$"
)
"""How people begin to talk, but no heading of a laboratory's report."""


def test_headings_are_those_of_a_laboratory(report: Made, spoken_reports: dict[Code, Spoken]) -> None:
    for content in (report.content, *(made.content for made in spoken_reports.values())):
        titles = [section.title for section in content.sections]
        titles += [block.title for s in content.sections for block in s.blocks if isinstance(block, Table)]
        assert len(titles) > 20
        assert [title for title in titles if QUESTIONS.match(title)] == []


def test_names_stand_behind_the_colon_of_the_language(report: Made) -> None:
    source = replace(report.source, fields=ReportFields(checked_by="K. Veselá"), language=language_of("fr"))
    content = build_content(source)
    html = render_html(content, ["<svg/>"] * len(content.pictures()))
    assert re.search("Vérifié par[ \u00a0\u202f]: K. Veselá", html)
    figures = [draw(one.plot, content.language) for one in content.pictures()]
    assert re.search("Vérifié par[ \u00a0\u202f]: K. Veselá", pages(render_pdf(content, figures))[0])


def test_a_test_is_feminine_in_czech_where_a_run_is_not(spoken_reports: dict[Code, Spoken]) -> None:
    statement = spoken_reports["cs"].content.certificate[0]
    assert "EN 15551: statická zkouška, " in statement.subject  # type: ignore[union-attr]


@pytest.mark.parametrize("code", OTHERS)
def test_times_are_local_with_their_offset(spoken_reports: dict[Code, Spoken], code: Code) -> None:
    assert "UTC+01:00" in spoken_reports[code].html
    assert f'<html lang="{code}">' in spoken_reports[code].html


def test_on_a_phone_every_language_fits(spoken_reports: dict[Code, Spoken], tmp_path: Path) -> None:
    with chromium() as browser:
        for code, made in spoken_reports.items():
            file = tmp_path / f"{code}.html"
            file.write_text(made.html, encoding="utf-8")
            context = browser.new_context(viewport=PHONE, java_script_enabled=False)
            page = context.new_page()
            page.goto(file.as_uri(), wait_until="load")
            width = page.evaluate("document.documentElement.scrollWidth")
            beyond = page.evaluate(
                "[...document.querySelectorAll('main *')].filter(e => !e.closest('.box') && "
                "e.getClientRects().length && e.getBoundingClientRect().right > innerWidth + 1)"
                ".map(e => e.outerHTML.slice(0, 80))"
            )
            context.close()
            assert width == PHONE["width"], code
            assert beyond == [], code


def test_the_workbook_holds_numbers_whatever_the_decimal_sign(report: Made, tmp_path: Path) -> None:
    values = {}
    for code in ("en", "de"):
        table = tmp_path / f"{code}.xlsx"
        write_report(
            report.folder,
            tmp_path,
            formats=("html",),
            document=hand_made_document(),
            given=Given(language=code),
            table=table,
        )
        book = openpyxl.load_workbook(table)
        values[code] = [
            cell.value
            for sheet in book
            for row in sheet.iter_rows()
            for cell in row
            if isinstance(cell.value, int | float)
        ]
        titles = [str(sheet.cell(2, 1).value) for sheet in book]
        assert ("Anforderung" in titles) == (code == "de")
    assert values["en"] == values["de"]
    assert len(values["de"]) > 500


def test_english_without_a_zone_is_the_report_as_it_was(report: Made) -> None:
    assert report.source.language == Language()
    named = read_source(report.folder, hand_made_document(), Given(language="en"))
    assert build_content(named).report_id == report.content.report_id


def test_the_option_goes_before_the_file_and_the_zone_is_kept(report: Made, tmp_path: Path) -> None:
    file = tmp_path / "report.toml"
    file.write_text('language = "fr"\ntime_zone = "Europe/Paris"\n', encoding="utf-8")
    given = Given(fields=read_fields(file))
    assert read_source(report.folder, hand_made_document(), given).language.code == "fr"
    other = read_source(report.folder, hand_made_document(), replace(given, language="cs")).language
    assert (other.code, str(other.zone)) == ("cs", "Europe/Paris")


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ('language = "deutsch"', "language"),
        ("language = 5", "language"),
        ('time_zone = "Mars/Olympus"', "time_zone"),
        ('time_zone = "../../etc/passwd"', "time_zone"),
        ('langauge = "de"', "langauge"),
    ],
)
def test_a_wrong_language_or_zone_is_refused_with_its_place(tmp_path: Path, line: str, place: str) -> None:
    file = tmp_path / "report.toml"
    file.write_text(line + "\n", encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        read_fields(file)
    assert str(refused.value.file) == str(file)
    assert place in str(refused.value)


def test_fields_of_a_user_stay_as_they_are(report: Made) -> None:
    source = replace(
        report.source,
        fields=ReportFields(remarks=("Painted grey, again by hand.",), customer="Force and Sons"),
        language=language_of("de"),
    )
    html = render_html(build_content(source), ["<svg/>"] * len(report.content.pictures()))
    assert "Painted grey, again by hand." in html
    assert "Force and Sons" in html


def test_a_warning_of_one_series_alone_is_told_in_the_language() -> None:
    """A caption that names the series before its warning kept the warning in English."""
    confounded = "confounded: temperature differs by 1.1 K between the runs"
    one, two = (
        TrendSeries(name, np.zeros(2), np.zeros(2), np.zeros(2)) for name in ("20 ± 20 mm", "40 ± 40 mm")
    )
    (caption,) = _warned([({}, one), ({"warnings": [confounded]}, two)])
    assert caption == f"40 ± 40 mm – {confounded}."
    assert "vermengt: Die Temperatur" in Language("de").say(caption)
    (shared,) = _warned([({"warnings": [confounded]}, one), ({"warnings": [confounded]}, two)])
    assert shared == f"C{confounded[1:]}."
    assert "ermengt: Die Temperatur" in Language("de").say(shared)
    amplitude = "confounded: amplitude varies from 5 to 30 mm along with frequency"
    (both,) = _warned([({}, one), ({"warnings": [amplitude, confounded]}, two)])
    assert both == f"40 ± 40 mm – {amplitude}; {confounded}.", "the series is named once"
    assert "vermengt: Die Amplitude ändert sich mit der Frequenz von 5 bis 30 mm; " in Language("de").say(
        both
    )
