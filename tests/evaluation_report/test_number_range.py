"""The laboratory's own number range: each number once, the same evaluation the same one, a draft none."""

from __future__ import annotations

import csv
import fcntl
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from bufferstand.evaluation.report.numbering import with_number
from bufferstand.evaluation.report.source import number_range
from bufferstand.evaluation.report.source.fields import read_fields
from bufferstand.evaluation.report.source.number_range import number_of_range
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_content import FILLED

PATTERN = "PB-{year}-{running:04}"


def given(register: Path, evaluation: str, *, pattern: str = PATTERN, year: int = 2026) -> str:
    return number_of_range(pattern, register, year=year, evaluation=evaluation, report="campaign")


def test_each_evaluation_has_the_next_number_and_keeps_it(tmp_path: Path) -> None:
    register = tmp_path / "numbers.csv"
    assert [given(register, each) for each in ("a", "b", "a", "c")] == [
        "PB-2026-0001",
        "PB-2026-0002",
        "PB-2026-0001",
        "PB-2026-0003",
    ]
    before = register.read_bytes()
    assert given(register, "b") == "PB-2026-0002"
    assert register.read_bytes() == before
    rows = list(csv.DictReader(register.read_text("utf-8").splitlines()))
    assert [row["evaluation"] for row in rows] == ["a", "b", "c"]


def test_the_running_number_begins_anew_with_the_year_where_the_pattern_has_it(tmp_path: Path) -> None:
    by_year, through = tmp_path / "by-year.csv", tmp_path / "through.csv"
    assert [given(by_year, f"{year}", year=year) for year in (2026, 2027)] == ["PB-2026-0001", "PB-2027-0001"]
    running = [given(through, f"{year}", year=year, pattern="P{running}") for year in (2026, 2027)]
    assert running == ["P1", "P2"]


def test_a_range_goes_on_behind_numbers_that_were_given_by_hand(tmp_path: Path) -> None:
    register = tmp_path / "numbers.csv"
    register.write_text("number,running,year,evaluation,report\nPB-2026-0137,137,2026,,on paper", "utf-8")
    assert given(register, "a") == "PB-2026-0138"
    assert given(register, "b") == "PB-2026-0139"


def test_many_at_once_never_get_one_number(tmp_path: Path) -> None:
    register = tmp_path / "numbers.csv"
    with ThreadPoolExecutor(8) as pool:
        numbers = list(pool.map(lambda each: given(register, str(each)), range(40)))
    assert sorted(numbers) == [f"PB-2026-{number:04}" for number in range(1, 41)]


def test_a_register_that_another_program_holds_is_waited_for_and_then_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(number_range, "_WAIT_S", 0.0)
    register = tmp_path / "numbers.csv"
    with register.open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with pytest.raises(BadInput, match="another program has had the register"):
            given(register, "a")
    assert given(register, "a") == "PB-2026-0001"


HEAD = "number,running,year,evaluation,report\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("numbers\n", "line 1: .*the first line is not “number,running,year,evaluation,report”"),
        (HEAD + "PB-2026-0001,1,20", "line 2: .*it has 3 entries; 5 are wanted"),
        (HEAD + "PB-2026-0001,one,2026,a,x\n", "line 2: .*running and year are no whole numbers"),
        (HEAD + "P1,1,2026,a,x\nP1,2,2026,b,x\n", "line 3: .*P1 stands in line 2 already"),
        (HEAD + "PB-2026-0002,1,2026,b,x\n", "the next number, PB-2026-0002, is given already"),
    ],
)
def test_a_damaged_register_gives_no_number_and_is_left_as_it_is(
    tmp_path: Path, text: str, said: str
) -> None:
    register = tmp_path / "numbers.csv"
    register.write_text(text, "utf-8")
    with pytest.raises(BadInput, match=said) as refused:
        given(register, "a")
    assert str(register) in str(refused.value)
    assert register.read_text("utf-8") == text


def test_a_register_in_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot be used: No such file or directory"):
        given(tmp_path / "none" / "numbers.csv", "a")


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ('number = "PB-{year}"\nnumber_register = "n.csv"', "needs {running} once"),
        ('number = "{running}{running}"\nnumber_register = "n.csv"', "needs {running} once"),
        (
            'number = "{runing:04}"\nnumber_register = "n.csv"',
            "the pattern has no {runing}; it has {running}",
        ),
        ('number = "{running:x}"\nnumber_register = "n.csv"', "“x” is no width of {running}"),
        ('number = "{running!r}"\nnumber_register = "n.csv"', "“r” is no width of {running}"),
        ('number = "{running.real}"\nnumber_register = "n.csv"', "the pattern has no {running.real}"),
        ('number = "P{running"\nnumber_register = "n.csv"', "the pattern cannot be read"),
        ('number = "P-{running}"', "no register of the given numbers is named"),
        ('number = "P-1"\nnumber_register = "n.csv"', "a register of numbers is named, and the number is no"),
    ],
)
def test_what_is_no_range_is_refused_by_file_and_key(tmp_path: Path, written: str, said: str) -> None:
    file = tmp_path / "report.toml"
    file.write_text(written, "utf-8")
    with pytest.raises(BadInput, match=re.escape(said)) as refused:
        read_fields(file)
    assert str(refused.value).startswith(f"{file}: number")


def test_a_draft_takes_no_number_and_a_report_keeps_its_own(report: Made, tmp_path: Path) -> None:
    register = tmp_path / "numbers.csv"
    of_range = {"number": PATTERN, "number_register": str(register)}
    draft = with_number(
        replace(report.source, fields=FILLED.model_copy(update=of_range | {"checked_by": ""}))
    )
    assert draft.fields.number == "given when the report is no draft any more"
    assert not register.exists()
    whole = replace(report.source, fields=FILLED.model_copy(update=of_range))
    assert with_number(whole).fields.number == "PB-2026-0001"
    corrected = replace(whole, fields=whole.fields.model_copy(update={"remarks": ("A comma.",)}))
    assert with_number(corrected).fields.number == "PB-2026-0001"
    other_rule = replace(whole, decision_rule="guard-band")
    assert with_number(other_rule).fields.number == "PB-2026-0002"
    amended = replace(whole, fields=whole.fields.model_copy(update={"amends": "BR-0123456789ab"}))
    assert with_number(amended).fields.number == "PB-2026-0003"
    next_year = replace(whole, fields=whole.fields.model_copy(update={"issued": date(2027, 1, 8)}))
    assert with_number(next_year).fields.number == "PB-2027-0001"


def test_an_evaluation_with_what_is_no_number_has_one_too(report: Made, tmp_path: Path) -> None:
    of_range = {"number": PATTERN, "number_register": str(tmp_path / "numbers.csv")}
    whole = replace(report.source, fields=FILLED.model_copy(update=of_range))
    run = whole.runs[0]
    spoiled = {**run.evaluated, "summary": {**run.evaluated["summary"], "damping": float("nan")}}
    document = {**whole.document, "runs": [spoiled, *(other.evaluated for other in whole.runs[1:])]}
    source = replace(whole, runs=(replace(run, evaluated=spoiled), *whole.runs[1:]), document=document)
    assert with_number(source).fields.number == "PB-2026-0001"
