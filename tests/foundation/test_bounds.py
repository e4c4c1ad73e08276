"""Bounds of settings: which number of a file is refused, and what a schema lets be written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from bufferstand.foundation.settings import Settings, Within
from bufferstand.foundation.settings.bounds import NumericKey, OutOfBounds, first_breach, numeric_keys

SMALL = Within(1.0, 5.0, "small")
WIDE = Within(0.0, 100.0, "wide")
PAIR = Within(-1.0, 1.0, "pair")


class Wheel(Settings):
    diameter_mm: Annotated[float, Field(gt=0), SMALL] = 2.0
    spokes: Annotated[int, SMALL] = 3
    round: Annotated[bool, SMALL] = False


class Round(Settings):
    kind: Literal["round", "ball"]
    radius: Annotated[float, Field(ge=2, lt=9)] = 3.0


class Square(Settings):
    kind: Literal["square"]
    side: Annotated[float, Field(gt=2, le=9), Within(3.0, 8.0, "square")] = 4.0


Shape = Annotated[Round | Square, Field(discriminator="kind")]


class Cart(Settings):
    wheel: Wheel = Wheel()
    mass_kg: Annotated[float | None, WIDE] = None
    loads: Annotated[tuple[Annotated[float, SMALL], ...], WIDE] = ()
    range: tuple[Annotated[float, PAIR], Annotated[float, SMALL]] = (0.0, 2.0)
    marks: Mapping[str, Annotated[float, SMALL]] = {}
    shape: Shape = Round(kind="round")
    name: str = "cart"
    free: float = Field(default=0.0, alias="free_of_all")
    spare: Wheel | None = None


def breach(**content: Any) -> OutOfBounds | None:
    return first_breach(Cart.model_validate(content))


@pytest.mark.parametrize("inside", [1.0, 1.5, 5.0])
def test_a_bound_itself_may_be_written(inside: float) -> None:
    assert breach(wheel={"diameter_mm": inside}) is None


@pytest.mark.parametrize("value", [math.nextafter(1.0, 0.0), math.nextafter(5.0, 9.0)])
def test_a_number_beyond_its_bound_is_found_with_its_place(value: float) -> None:
    assert breach(wheel={"diameter_mm": value}) == OutOfBounds(("wheel", "diameter_mm"), value, SMALL)


def test_whole_numbers_have_bounds_and_switches_have_none() -> None:
    assert breach(wheel={"spokes": 6}) == OutOfBounds(("wheel", "spokes"), 6, SMALL)
    assert breach(wheel={"round": True}) is None
    assert breach(wheel={"round": False}) is None


def test_each_entry_of_a_list_keeps_the_bounds_of_the_list_and_its_own() -> None:
    assert breach(loads=(1.0, 2.0, 5.0)) is None
    assert breach(loads=(2.0, 50.0)) == OutOfBounds(("loads", 1), 50.0, SMALL)
    assert breach(loads=(2.0, 150.0)) == OutOfBounds(("loads", 1), 150.0, WIDE)


def test_the_entries_of_a_pair_have_bounds_of_their_own() -> None:
    assert breach(range=(1.0, 5.0)) is None
    assert breach(range=(2.0, 2.0)) == OutOfBounds(("range", 0), 2.0, PAIR)
    assert breach(range=(0.0, 0.5)) == OutOfBounds(("range", 1), 0.5, SMALL)


def test_what_stands_under_keys_of_the_users_own_is_looked_at() -> None:
    assert breach(marks={"a": 2.0}) is None
    assert breach(marks={"a": 2.0, "b": 9.0}) == OutOfBounds(("marks", "b"), 9.0, SMALL)


def test_a_table_of_one_of_several_kinds_is_judged_by_that_kind() -> None:
    assert breach(shape={"kind": "square", "side": 8.0}) is None
    found = breach(shape={"kind": "square", "side": 9.0})
    assert found is not None
    assert (found.path, found.within.why) == (("shape", "side"), "square")


def test_where_nothing_is_written_or_bounded_nothing_is_found() -> None:
    assert breach() is None
    assert breach(free_of_all=1e300) is None
    assert breach(mass_kg=None) is None
    assert breach(mass_kg=101.0) == OutOfBounds(("mass_kg",), 101.0, WIDE)
    assert breach(spare={"spokes": 0}) == OutOfBounds(("spare", "spokes"), 0, SMALL)


def test_a_breach_says_the_bound_that_it_breaks_and_what_to_write() -> None:
    what_to_do = "write a number from 1 to 5: small"
    assert OutOfBounds((), 0.5, SMALL).said() == ("0.5 is too small: its bound is 1", what_to_do)
    assert OutOfBounds((), 6, SMALL).said() == ("6 is too large: its bound is 5", what_to_do)
    assert OutOfBounds((), math.nan, SMALL).said()[0] == "nan is too large: its bound is 5"


def row(key: NumericKey) -> tuple[object, ...]:
    return key.integer, key.low, key.low_open, key.high, key.high_open, key.why


def test_every_number_of_a_schema_is_listed_with_the_narrowest_of_its_bounds() -> None:
    found = {key.path: key for key in numeric_keys(Cart)}
    assert {path: row(key) for path, key in found.items()} == {
        ("wheel", "diameter_mm"): (False, 1.0, False, 5.0, False, "small"),
        ("wheel", "spokes"): (True, 1.0, False, 5.0, False, "small"),
        ("mass_kg",): (False, 0.0, False, 100.0, False, "wide"),
        ("loads", "[]"): (False, 1.0, False, 5.0, False, "small"),
        ("range", "[0]"): (False, -1.0, False, 1.0, False, "pair"),
        ("range", "[1]"): (False, 1.0, False, 5.0, False, "small"),
        ("marks", "[key]"): (False, 1.0, False, 5.0, False, "small"),
        ("shape", "kind=round", "radius"): (False, 2.0, False, 9.0, True, ""),
        ("shape", "kind=square", "side"): (False, 3.0, False, 8.0, False, "square"),
        ("free_of_all",): (False, -math.inf, False, math.inf, False, ""),
        ("spare", "diameter_mm"): (False, 1.0, False, 5.0, False, "small"),
        ("spare", "spokes"): (True, 1.0, False, 5.0, False, "small"),
    }
    assert found["loads", "[]"].name == "loads"
    assert found["marks", "[key]"].dotted == "marks"
    assert found["shape", "kind=round", "radius"].dotted == "shape.radius"
    assert found["shape", "kind=round", "radius"].owner is Round
    assert found["wheel", "spokes"].owner is Wheel
    assert found["mass_kg",].owner is Cart


class Edges(Settings):
    same_low: Annotated[float, Field(gt=1), Within(1.0, 9.0, "")] = 2.0
    same_high: Annotated[float, Within(1.0, 9.0, ""), Field(lt=9)] = 2.0
    reasons: Annotated[float, Within(0.0, 9.0, "first"), Within(1.0, 8.0, "second"), Field(gt=0, lt=20)] = 2.0
    same_high_open_first: Annotated[float, Field(lt=9), Within(1.0, 9.0, "")] = 2.0
    wider_later: Annotated[float, Field(gt=3, lt=4), Within(1.0, 9.0, "")] = 3.5


def test_an_open_bound_counts_where_both_are_the_same() -> None:
    found = {key.name: row(key) for key in numeric_keys(Edges)}
    assert found == {
        "same_low": (False, 1.0, True, 9.0, False, ""),
        "same_high": (False, 1.0, False, 9.0, True, ""),
        "reasons": (False, 1.0, False, 8.0, False, "second"),
        "same_high_open_first": (False, 1.0, False, 9.0, True, ""),
        "wider_later": (False, 3.0, True, 4.0, True, ""),
    }


class Node(Settings):
    size: Annotated[float, SMALL] = 2.0
    inner: Node | Wheel | None = None


class Choice(Settings):
    either: Wheel | Node = Wheel()
    number: Annotated[int, SMALL] | Annotated[float, PAIR] = 1
    deep: tuple[tuple[Annotated[float, PAIR], ...], ...] = ()


def test_a_table_within_itself_is_listed_once_and_kinds_without_a_key_by_their_names() -> None:
    assert [key.path for key in numeric_keys(Node)] == [
        ("size",),
        ("inner", "kind=Wheel", "diameter_mm"),
        ("inner", "kind=Wheel", "spokes"),
    ]
    assert [key.path for key in numeric_keys(Choice)] == [
        ("either", "kind=Wheel", "diameter_mm"),
        ("either", "kind=Wheel", "spokes"),
        ("either", "kind=Node", "size"),
        ("either", "kind=Node", "inner", "kind=Wheel", "diameter_mm"),
        ("either", "kind=Node", "inner", "kind=Wheel", "spokes"),
        ("number",),
        ("number",),
        ("deep", "[]", "[]"),
    ]
    assert [row(key) for key in numeric_keys(Choice) if key.name == "number"] == [
        (True, 1.0, False, 5.0, False, "small"),
        (False, -1.0, False, 1.0, False, "pair"),
    ]
    found = first_breach(Choice.model_validate({"deep": ((0.0,), (0.0, 3.0))}))
    assert found is not None
    assert found.path == ("deep", 1, 1)
