"""Settings files: what is wrong is said with file, line, key and remedy."""

from __future__ import annotations

from datetime import UTC, date, datetime
from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.loading import (
    Day,
    Moment,
    Numbers,
    Settings,
    load_settings,
    parse_settings,
)


class Wheel(Settings):
    kind: Literal["wheel"] = "wheel"
    diameter_mm: float = Field(gt=0)


class Spring(Settings):
    kind: Literal["spring"] = "spring"
    stiffness_kN_per_mm: float


class Cart(Settings):
    name: str
    wheel: list[Wheel] = Field(default_factory=list)
    part: list[Wheel | Spring] = Field(default_factory=list)
    spring: Spring | None = None
    made: Moment | None = None
    checked: Day | None = None
    table: Numbers = ()


def refuse(text: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        parse_settings(text, Cart, Path("cart.toml"))
    return caught.value


def test_unknown_key_names_line_and_nearest_key() -> None:
    error = refuse('name = "a"\n\n[[wheel]]\ndiameter_mm = 1.0\n[[wheel]]\ndiamter_mm = 2.0\n')
    assert error.place == "line 6: wheel.diamter_mm"
    assert "unknown key “diamter_mm”" in error.problem
    assert error.remedy == "did you mean “diameter_mm”?"


def test_unknown_key_is_compared_with_the_keys_of_its_own_table() -> None:
    error = refuse('name = "a"\n[spring]\nstifness = 3.0\n')
    assert error.remedy == "did you mean “stiffness_kN_per_mm”?"


def test_unknown_table_without_a_near_name_says_what_to_do() -> None:
    assert refuse('name = "a"\n[zzz]\nq = 1\n').remedy.startswith("remove it")


def test_missing_key() -> None:
    error = refuse("[spring]\nstiffness_kN_per_mm = 1.0\n")
    assert (error.place, error.problem, error.remedy) == (
        "name",
        "this key is missing",
        "add it: a text in quotes",
    )


def test_wrong_value_shows_what_was_given_and_its_line() -> None:
    error = refuse('name = "a"\n[[wheel]]\ndiameter_mm = -2.0\n')
    assert error.place == "line 3: wheel.diameter_mm"
    assert (error.problem, error.remedy) == ("-2.0 is too small", "write a number greater than 0")


def test_text_is_not_taken_for_a_number() -> None:
    error = refuse('name = "a"\n[spring]\nstiffness_kN_per_mm = "3"\n')
    assert (error.problem, error.remedy) == ("“3” is not possible here", "write a number")


def test_a_further_finding_has_a_line_of_its_own() -> None:
    error = refuse("name = 3\n[spring]\nstiffness_kN_per_mm = true\n")
    assert [line.partition(": ")[2][:14] for line in str(error).splitlines()] == [
        "line 1: name: ",
        "spring.stiffne",
    ]


def test_syntax_error_names_the_line() -> None:
    assert "line 3" in refuse('name = "a"\nwheel = [\n= 3').problem


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_no_number_is_refused(value: str) -> None:
    assert "finite" in refuse(f'name = "a"\n[spring]\nstiffness_kN_per_mm = {value}\n').problem


def test_message_is_one_line_with_file_place_problem_and_remedy() -> None:
    error = refuse('nam = "a"\n')
    assert "\n" not in str(error)
    assert str(error).startswith("cart.toml: line 1: nam: unknown key “nam”")
    assert str(error).endswith("did you mean “name”?")


def test_dates_as_toml_or_text_and_utc_where_no_zone_is_given() -> None:
    as_text = parse_settings('name="a"\nmade="2026-03-01T10:00:00"\nchecked="2026-03-02"', Cart, Path("c"))
    as_toml = parse_settings('name="a"\nmade=2026-03-01T10:00:00Z\nchecked=2026-03-02', Cart, Path("c"))
    assert as_text == as_toml
    assert as_text.made == datetime(2026, 3, 1, 10, tzinfo=UTC)
    assert as_text.checked == date(2026, 3, 2)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such file"):
        load_settings(tmp_path / "none.toml", Cart)
    with pytest.raises(BadInput, match="cannot be read"):
        load_settings(tmp_path, Cart)
    latin = tmp_path / "latin.toml"
    latin.write_bytes('name = "Prüfstand"'.encode("latin-1"))
    with pytest.raises(BadInput, match="not UTF-8"):
        load_settings(latin, Cart)


class Bracket(Settings):
    limit_N: float | Literal["open", "none"] = "none"
    load_N: float | Literal["open"] = "open"


def test_a_value_of_no_permitted_type_names_all_of_them() -> None:
    with pytest.raises(BadInput) as caught:
        parse_settings('limit_N = "about 5"\nload_N = "x"\n', Bracket, Path("b.toml"))
    assert caught.value.place == "line 1: limit_N"
    assert caught.value.problem == "“about 5” is not possible here"
    assert caught.value.remedy == "write a number, “open” or “none”"
    assert str(caught.value).splitlines()[1:] == [
        "  line 2: load_N: “x” is not possible here; write a number or “open”"
    ]


def test_two_keys_with_the_same_wrong_value_are_two_findings() -> None:
    error = refuse('name = "a"\n[spring]\nkind = 1\nstiffness_kN_per_mm = "1"\n')
    assert error.place == "line 3: spring.kind"
    assert len(str(error).splitlines()) == 2
    assert "\n  line 4: spring.stiffness_kN_per_mm: “1” is not possible here" in str(error)


def test_all_that_is_wrong_is_said_at_once_and_of_very_much_the_count() -> None:
    error = refuse('name = "a"\nx = 1\nwheel = 2\n[spring]\nstiffness_kN_per_mm = "1"\n')
    lines = str(error).splitlines()
    assert [line.partition(":")[0].strip() for line in lines[1:]] == ["line 3", "line 5"]
    assert lines[0].startswith("cart.toml: line 2: x: unknown key “x”")
    many = "".join(f"x{number} = 1\n" for number in range(20))
    assert str(refuse(f'{many}name = "a"\n[spring]\nstiffness_kN_per_mm = 1\n')).endswith("\n  and 7 more")
