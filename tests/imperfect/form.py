"""Holds a document against its own rules: contracts, section 4."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from .judgement import Judgement
from .requirements import CONDITIONS

WEAKEST = ("pass", "conditional-pass", "conditional-fail")


def hold_form(j: Judgement, run: dict[str, Any], *, stated: bool) -> None:
    """Note numbers that are none, U's of nothing, a summary beside steps, a verdict not of its rows."""
    for place, value in _numbers(run, "run"):
        if not math.isfinite(value):
            j.say("document", "not a number", place)
    if run.get("steps") and run.get("summary") is not None:
        j.say("document", "a summary of the run beside its steps", str(run["summary"].get("cycles_used")))
    if not stated:
        given = [
            n
            for n, e in (run.get("summary") or {}).items()
            if isinstance(e, dict) and e.get("expanded_uncertainty")
        ]
        energies = [n for n in given if "energy" in n or "force" in n or "stiffness" in n]
        if energies:
            j.say("document", "U where nothing is stated", ", ".join(energies))
    wanted = _verdict(run["requirements"])
    if run["requirements"] and run["verdict"] != wanted:
        j.say("document", "verdict of the run", f"{run['verdict']}, its rows make {wanted}")
    for row in run["requirements"]:
        p = row.get("conformance_probability")
        if p is not None and not 0.0 <= p <= 1.0:
            j.say("document", "conformance probability", f"{row['id']}: {p}")


def _verdict(rows: list[dict[str, Any]]) -> str | None:
    verdicts = [r["verdict"] for r in rows]
    if any(r["id"] in CONDITIONS and r["verdict"] == "fail" for r in rows):
        return "invalid"
    if "fail" in verdicts:
        return "fail"
    if {"inconclusive", "not-tested"} & set(verdicts):
        return "inconclusive"
    return max(verdicts, key=WEAKEST.index) if set(verdicts) <= set(WEAKEST) and verdicts else None


def _numbers(value: Any, place: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield place, value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _numbers(item, f"{place}.{key}")
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from _numbers(item, f"{place}[{i}]")
