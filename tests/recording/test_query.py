"""Expressions by which runs are found: what they mean, and what they are not."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding.query import QueryField, parse_query

FIELDS = {
    "kind": QueryField("kind", "text"),
    "specimen": QueryField("specimen", "text"),
    "date": QueryField("started_utc", "date"),
    "prestress_mm": QueryField("prestress_mm", "number"),
    "prestress": QueryField("prestress_mm", "number"),
    "frequency": QueryField("frequency_Hz", "number"),
    "damping": QueryField("damping", "number"),
}
RUN: dict[str, Any] = {
    "kind": "harmonic",
    "specimen": "A-105-E-01",
    "started_utc": "2026-03-05T14:02:11.5+00:00",
    "prestress_mm": 50.0,
    "frequency_Hz": 0.31830988,
    "damping": None,
}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('kind == "harmonic"', True),
        ('kind != "harmonic"', False),
        ('"harmonic" == kind', True),
        ("prestress > 49.9 and prestress_mm <= 50", True),
        ("20 < prestress < 50", False),
        ("20 < prestress <= 5e1", True),
        ("prestress >= -10", True),
        ("frequency == 0.318", True),
        ("frequency == 0.3", True),
        ("frequency == 0.31", False),
        ("frequency == 0.3183", True),
        ("frequency != 0.318", False),
        ("frequency in (0.16, 0.32)", True),
        ("frequency not in [0.16, 0.32]", False),
        ("frequency == 3.18e-1", True),
        ("prestress == 5e1", True),
        ('"105" in specimen', True),
        ('"106" not in specimen', True),
        ('kind in ("static", "impact")', False),
        ('not (kind == "static" or prestress > 60)', True),
        ('date == "2026-03-05"', True),
        ('date == "2026-03"', True),
        ('date > "2026-03-05"', False),
        ('date >= "2026-03-05"', True),
        ('date <= "2026"', True),
        ('date < "2026-03-05 14:03"', True),
        ('date > "2026-03-05T14:02:10"', True),
        ('"2026-01" < date < "2026-12-31"', True),
        ('date == "2026-03-05T14:02:11.5"', True),
        ('date == "2026-03-05T14:02:11.50+00:00"', True),
        ('date == "2026-03-05T14:02:11Z"', True),
        ('date == "2026-03-05T15:02:11+01:00"', True),
        ('date == "2026-03-05 15:02+0100"', True),
        ('date >= "2026-03-05T14:02:11.49"', True),
        ('date > "2026-03-05T14:02:11.5"', False),
        ('date < "2026-03-05T14:02:12.000000Z"', True),
        ("prestress == -(-(5e1))", True),
        ("prestress == +50", True),
        ("frequency == -(-(0.318))", True),
        ("frequency < 1e-400", False),
        ("prestress > 1\nand prestress < 60", True),
        ("damping is None", True),
        ("damping is not None", False),
        ("prestress is None", False),
        # What is not known matches nothing, nor does its contrary; but it may decide nothing.
        ("damping < 0.4", False),
        ("not damping < 0.4", False),
        ("damping != 0.4", False),
        ("not (damping < 0.4 and prestress > 60)", True),
        ('damping < 0.4 or kind == "harmonic"', True),
        ('not (damping < 0.4 or kind == "harmonic")', False),
        ("  prestress == 50  ", True),
    ],
)
def test_meaning(text: str, found: bool) -> None:
    assert parse_query(text, FIELDS).matches(RUN) is found


def test_facts_that_are_asked_for() -> None:
    assert parse_query('prestress > 1 and (kind == "x" or damping is None)', FIELDS).facts == {
        "prestress_mm", "kind", "damping"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ("dampin < 0.3", "column 1", "unknown name “dampin”; did you mean “damping”?"),
        ("prestress > 1 and xyz == 2", "column 19", "unknown name “xyz”; known are kind, specimen"),
        ("damping = 0.3", "column 9", "equality is written =="),
        ("damping <", "", "this is no expression"),
        ("", "", "this is no expression"),
        ("damping", "column 1", "is compared with nothing"),
        ("prestress > '20'", "column 13", "is a number; write it without quotes"),
        ("prestress > True", "column 13", "is a number"),
        ("prestress == None", "column 14", "is a number"),
        ("kind == harmonic", "column 9", "two names are compared; a text is written in quotes"),
        ("kind < 'x'", "column 8", "it has no order"),
        ("kind == 3", "column 9", "“kind” is a text; write it in quotes"),
        ("date > '5.3.2026'", "column 8", "“5.3.2026” is no date"),
        ('date > "2026-13"', "column 8", "“2026-13” is a date that there is not; write"),
        ('date in ("2026", "2026-02-30")', "column 18", "“2026-02-30” is a date that there is not"),
        ('date > "2026-03-05T24:00"', "column 8", "is no date"),
        ('date > "2026-03-05T14:60"', "column 8", "is a date that there is not"),
        ('date > "0001-01-01T00:00+05:00"', "column 8", "is a date that there is not"),
        ('date > "2026-03Z"', "column 8", "is no date"),
        ('date > "2026-03-05T14.5"', "column 8", "is no date"),
        ("frequency == 0x1ef", "column 14", "not a decimal one; write it as 495 or 4.95e2"),
        ("frequency < 0b1", "column 13", "not a decimal one"),
        ("frequency == 1e400", "column 14", "this number is too large"),
        ("frequency == 0e999", "column 14", "this number is too large"),
        ("frequency < -1e400", "column 14", "this number is too large"),
        ("prestress == 1" + "0" * 400, "column 14", "this number is too large"),
        ('specimen == "Ä漢" and xyz == 2', "column 22", "unknown name “xyz”"),
        ('  specimen == "Ä" and xyz == 2', "column 23", "unknown name “xyz”"),
        ('  specimen == "Ä" = 2', "column 19", "equality is written =="),
        ("(prestress > 1\nand xyz == 2)", "column 20", "unknown name “xyz”"),
        ("date in prestress", "column 1", "“in” is understood as"),
        ("'5' in prestress", "column 8", "“prestress_mm” is no text"),
        ("kind is 'static'", "column 9", "only for None"),
        ("1 < 2", "column 1", "there is no name to compare"),
        ("__import__('os').system('true')", "column 1", "only comparisons"),
        ("kind == __import__('os').getcwd()", "column 9", "“kind” is a text"),
        ("(lambda: 1)() == prestress", "column 1", "is a number"),
        ("[x for x in (1,)] == prestress", "column 1", "is a number"),
        ("prestress > 2**9999999", "column 13", "is a number"),
        ("kind.upper() == 'X'", "column 1", "there is no name"),
        ("prestress > 1; import os", "column 14", "this is no expression"),
        ("prestress > (" * 300 + "1", "", "longer than"),
    ],
)
def test_what_is_no_query(text: str, place: str, said: str) -> None:
    with pytest.raises(BadInput) as refusal:
        parse_query(text, FIELDS)
    assert refusal.value.file == "--where"
    assert not place or refusal.value.place == place
    assert said in str(refusal.value)


@pytest.mark.parametrize("text", ["(" * 900 + "prestress > 1" + ")" * 900, "not " * 450 + "prestress > 1"])
def test_deep_ones_are_understood_or_refused(text: str) -> None:
    with suppress(BadInput):
        assert parse_query(text, FIELDS).matches(RUN)


@pytest.mark.parametrize("stated", ["yesterday", "5.3.2026", ""])
def test_a_start_that_is_no_date_is_not_known(stated: str) -> None:
    for text in ('date > "2026"', 'not date > "2026"', 'date != "2026"'):
        assert not parse_query(text, FIELDS).matches({**RUN, "started_utc": stated})


def test_a_start_in_any_of_its_forms() -> None:
    for stated in ("2026-03-05T14:02:11Z", "2026-03-05 14:02:11+00:00", "2026-03-05T14:02:11.000+00:00"):
        run = {**RUN, "started_utc": stated}
        for text in ('date == "2026-03-05T14:02:11Z"', 'date == "2026-03-05T14:02:11.0"', 'date < "2027"'):
            assert parse_query(text, FIELDS).matches(run)
    short = {**RUN, "started_utc": "2026-03-05"}
    assert parse_query('date < "2026-03-05T14:02"', FIELDS).matches(short)


@pytest.mark.slow
@given(st.text(max_size=60))
def test_no_text_does_anything_but_be_refused(text: str) -> None:
    with suppress(BadInput):
        parse_query(text, FIELDS).matches(RUN)


@given(st.floats(-1e3, 1e3), st.integers(0, 6))
def test_a_number_matches_as_it_is_shown(value: float, decimals: int) -> None:
    shown = f"{value:.{decimals}f}"
    run = {**RUN, "prestress_mm": value}
    assert parse_query(f"prestress == {shown}", FIELDS).matches(run)
    other = f"{float(shown) + 1.2 * 10.0**-decimals:.{decimals + 2}f}"
    assert not parse_query(f"prestress == {other}", FIELDS).matches(run)
