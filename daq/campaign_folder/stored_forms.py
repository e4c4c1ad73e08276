"""What ``campaign.json`` keeps as plain data, the plan and the starts: the form of the keys that are read."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Required, TypeVar

from pydantic import AfterValidator, TypeAdapter
from typing_extensions import TypedDict

Number = float | None


class _Step(TypedDict, total=False):
    index: int
    name: str
    kind: str
    plan_hash: Required[str]
    pause: bool
    cycles: int | None
    expected_duration_s: float
    duration_s: float
    expected_peak_force_kN: Number
    expected_heat_J: Number
    stops: list[dict[str, Any]]
    motions: list[dict[str, Any]]
    asked: dict[str, Any] | None
    start_band: _Band | None


class _Band(TypedDict):
    low_C: float
    high_C: float


class _Bound(TypedDict, total=False):
    value: Required[Number]


class _Limits(TypedDict, total=False):
    in_force: dict[str, _Bound | Number | list[list[float]]]
    test: dict[str, float | str | bool | None]


class _Conditions(TypedDict, total=False):
    ambient_C: float


class _Plan(TypedDict, total=False):
    campaign: dict[str, str | bool | float | None]
    conditions: _Conditions
    limits: _Limits
    not_guarded: list[str] | None
    specimen: dict[str, Any]
    steps: list[_Step]


class _Change(TypedDict):
    what: str
    before: str
    now: str


class _Trip(TypedDict, total=False):
    guard: str
    reason: str


class _Start(TypedDict, total=False):
    at_utc: Required[str]
    arming: dict[str, Any]
    changes: list[_Change] | None
    edits: dict[str, Any] | None
    trip: _Trip | None
    simulated: bool | None


Form = TypeVar("Form")


@cache
def _adapter(form: type[Form]) -> TypeAdapter[Form]:
    return TypeAdapter(form)


def _as_plan(content: dict[str, Any]) -> dict[str, Any]:
    _adapter(_Plan).validate_python(content, strict=True)
    return content


def _as_start(content: dict[str, Any]) -> dict[str, Any]:
    _adapter(_Start).validate_python(content, strict=True)
    return content


StoredPlan = Annotated[dict[str, Any], AfterValidator(_as_plan)]
"""A plan as data; kept as it is."""
StoredStart = Annotated[dict[str, Any], AfterValidator(_as_start)]
"""What a start has noted; kept as it is."""
