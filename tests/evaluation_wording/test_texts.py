"""Texts that know what they were made of, and what a language makes of them."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.wording import (
    ENGLISH,
    Language,
    capital,
    day,
    joined,
    language_of,
    moment,
    numeral,
    said,
    said_count,
    span,
    spoken,
)
from bufferstand.foundation import BadInput

GERMAN, CZECH, FRENCH = (Language(code) for code in ("de", "cs", "fr"))
AT = datetime(2026, 3, 5, 14, 2, 11, tzinfo=UTC)


def test_a_text_is_its_english_and_says_itself_in_a_language() -> None:
    text = said("Force at {stroke} mm", stroke=numeral("62.5"))
    assert text == "Force at 62.5 mm"
    assert GERMAN.say(text) == "Kraft bei 62,5 mm"
    assert CZECH.say(text) == "Síla při 62,5 mm"
    assert FRENCH.say(text) == "Effort à 62,5 mm"
    assert ENGLISH.say(text) == text


def test_what_is_added_and_joined_is_said_part_by_part() -> None:
    text = "A: " + said("Force") + " ± U"
    assert text == "A: Force ± U"
    assert GERMAN.say(text) == "A: Kraft ± U"
    assert GERMAN.say(joined(said(" and "), (said("Force"), said("Stroke")))) == "Kraft und Hub"
    assert GERMAN.say(capital(said_count("run {numbers}", "runs {numbers}", 2, numbers="1–2"))) == "Läufe 1–2"
    assert str(text) is text


@pytest.mark.parametrize(("count", "czech"), [(1, "1 cyklus"), (3, "3 cykly"), (5, "5 cyklů")])
def test_a_number_of_things_has_the_form_of_the_language(count: int, czech: str) -> None:
    text = said_count("{count} cycle", "{count} cycles", count)
    assert CZECH.say(text) == czech
    assert text == (f"{count} cycle" if count == 1 else f"{count} cycles")


def test_a_text_is_the_same_in_another_process() -> None:
    text = pickle.loads(pickle.dumps(said("Force at {stroke} mm", stroke=numeral("1.5"))))
    assert GERMAN.say(text) == "Kraft bei 1,5 mm"


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("18160 ± 130", "18\u202f160 ± 130"),
        ("−0.0162 … 1234.5", "−0,0162 … 1234,5"),
        ("≥ 12500", "≥ 12\u202f500"),
        ("1.2e−04", "1,2e−04"),
        ("> 99.9 %", "> 99,9 %"),
        ("1#2", "1#2"),
    ],
)
def test_numbers_have_a_comma_and_thin_spaces(english: str, german: str) -> None:
    assert GERMAN.say(numeral(english)) == german
    assert GERMAN.plain(german) == english.replace(" ", " ")


@given(st.floats(-1e9, 1e9).map(lambda value: f"{value:.3f}"))
def test_a_number_is_the_same_in_every_language(text: str) -> None:
    for language in (GERMAN, CZECH, FRENCH):
        assert float(language.plain(language.say(numeral(text)))) == float(text)


def test_days_and_times_have_the_language_and_the_zone() -> None:
    assert moment(AT) == "2026-03-05 14:02:11 UTC"
    assert GERMAN.say(moment(AT)) == "05.03.2026 14:02:11 UTC"
    berlin = ZoneInfo("Europe/Berlin")
    assert Language("en", berlin).say(moment(AT)) == "2026-03-05 15:02:11 UTC+01:00"
    assert Language("de", berlin).say(moment(AT)) == "05.03.2026 15:02:11 UTC+01:00"
    assert Language("cs", berlin).say(day(date(2026, 7, 1))) == "1. 7. 2026"
    assert Language("fr", berlin).say(day(date(2026, 7, 1))) == "1 juil. 2026"


def test_a_summer_time_that_begins_in_between_is_told() -> None:
    night = datetime(2026, 3, 29, 0, 30, tzinfo=UTC)
    text = span(night, night + timedelta(hours=1))
    assert text == "2026-03-29, 00:30:00 to 01:30:00 UTC"
    local = Language("de", ZoneInfo("Europe/Berlin")).say(text)
    assert local == "29.03.2026 01:30:00 UTC+01:00 bis 29.03.2026 03:30:00 UTC+02:00"


def test_a_span_within_a_day_tells_the_day_once() -> None:
    text = span(AT, AT + timedelta(minutes=5))
    assert GERMAN.say(text) == "05.03.2026, 14:02:11 bis 14:07:11 UTC"
    india = timezone(timedelta(hours=5, minutes=30))
    assert moment(AT.astimezone(india)) == "2026-03-05 19:32:11 UTC+05:30"


def test_reasons_of_a_document_are_told_by_their_form() -> None:
    text = "94.26 mm at 601 kN: the record stops short of full stroke; condition broken: cycle-count"
    assert GERMAN.say(text) == (
        "94,26 mm bei 601 kN: die Aufzeichnung endet vor dem vollen Hub; Bedingung verletzt: cycle-count"
    )
    assert GERMAN.say("cycle 1: no uncertainty of damping: it is not finite") == (
        "Zyklus 1: keine Unsicherheit von damping: sie ist nicht endlich"
    )


@pytest.mark.parametrize(
    "text",
    [
        "The buffer was painted grey.",
        "cycle 1: no uncertainty of damping: somebody switched it off",
        "within the limits; and somebody says so",
        "AXTONE 4.2",
    ],
)
def test_what_nobody_knows_stays_as_it_is(text: str) -> None:
    assert GERMAN.say(text) == text


def test_data_are_said_whatever_their_shape() -> None:
    @dataclass(frozen=True)
    class Part:
        text: str
        tone: str
        rest: tuple[object, ...] = ()

    part = Part(said("Force"), "text", (1.5, None, said("Stroke")))
    assert spoken(part, ENGLISH) is part
    assert spoken(part, GERMAN) == Part("Kraft", "text", (1.5, None, "Hub"))
    untouched = Part("X", "code")
    assert spoken(untouched, GERMAN) is untouched


@pytest.mark.parametrize("name", ["Europe/Berlinn", "../etc/passwd", "", "/etc/localtime"])
def test_a_time_zone_that_is_none_is_refused(name: str) -> None:
    if not name:
        assert language_of("de", name).zone is None
        return
    with pytest.raises(BadInput, match="no time zone"):
        language_of("de", name)
