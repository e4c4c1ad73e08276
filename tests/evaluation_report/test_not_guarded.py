"""The report says what the stand could not guard, and in which runs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from bufferstand.evaluation.report.sections.identity import _not_guarded
from bufferstand.evaluation.report.source.source import ReportSource


def source(*runs: tuple[int, list[str] | None]) -> ReportSource:
    def fact_of(said: list[str] | None) -> Any:
        return lambda *path: said if path == ("limits", "not_guarded") else None

    found = tuple(SimpleNamespace(number=number, fact=fact_of(said)) for number, said in runs)
    return cast(ReportSource, SimpleNamespace(runs=found))


def test_what_is_true_of_all_runs_is_said_once_and_else_with_its_runs() -> None:
    told = _not_guarded(source((1, ["no second force", "no stop"]), (2, ["no second force"])))
    assert told == ["no second force", "no stop (run 1)"]


def test_runs_of_earlier_versions_say_nothing() -> None:
    assert _not_guarded(source((1, None), (2, []))) == []
