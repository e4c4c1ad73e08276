"""What deserves a warning: a limit passed, a target missed, a condition close to its edge."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.report.content import limits_text, significant, usable, value_text
from bufferstand.evaluation.report.sections.verdicts import is_condition, name_of
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.evaluation.wording import said

CLOSE = 0.05
"""A condition is close to its edge within this share of the permitted span, or within its U."""
_LIMITED = (
    ("force_max_kN", said("force"), "kN"),
    ("stroke_max_mm", said("stroke"), "mm"),
    ("speed_max_mm_per_s", said("speed"), "mm/s"),
)
_COUNTED = frozenset({"", "1", "cycles"})


def beyond_limits(source: ReportSource) -> list[str]:
    """Return where a run's samples passed a limit that was in force."""
    texts = []
    for run in source.runs:
        for name, words, unit in _LIMITED:
            extreme, (limit, by) = run.extreme(name), run.limit(name)
            if extreme is None or extreme.value is None or limit is None or extreme.value <= limit:
                continue
            value = value_text(extreme.value, extreme.expanded_uncertainty)
            whose = said(", set by {by}", by=by) if by else ""
            texts.append(
                said(
                    "Run {number}: the {words} reached {value} {unit}, above the limit of {limit} "
                    "{unit}{whose}.",
                    number=run.number,
                    words=words,
                    value=value,
                    unit=unit,
                    limit=significant(limit),
                    whose=whose,
                )
            )
    return texts


def missed_targets(run: ReportRun) -> list[str]:
    """Return which cycles of a run turned elsewhere than was asked, by more than the campaign permits."""
    texts = []
    for row in (*run.strokes, *run.forces):
        if off := row.get("cycles_off"):
            what = said("stroke") if "reached_mean_mm" in row else said("force")
            texts.append(
                said(
                    "Run {number}: the {what} missed its target in cycles {off} of {cycles}; see Strokes and "
                    "forces reached.",
                    number=run.number,
                    what=what,
                    off=off,
                    cycles=row["cycles"],
                )
            )
    return texts


def near_conditions(source: ReportSource) -> list[str]:
    """Return the conditions of the test that were only just kept, each in the cycle nearest to its edge."""
    texts = []
    for run in source.runs:
        close: dict[str, list[tuple[float, Mapping[str, Any]]]] = {}
        for row in run.stated:
            if is_condition(row) and row["verdict"] == "pass" and (share := _share_left(row)) is not None:
                close.setdefault(str(row["id"]), []).append((share, row))
        for rows in close.values():
            share, row = min(rows, key=lambda one: one[0])
            if share <= 1.0:
                texts.append(said("Run {number}: {row}.", number=run.number, row=_near(row)))
    return texts


def _share_left(row: Mapping[str, Any]) -> float | None:
    """Return how far a value is from its limits in units of what is close; None of what is counted."""
    value, U = usable(row.get("measured")), usable(row.get("expanded_uncertainty"))
    ends = [end for key in ("lower_limit", "upper_limit") if (end := usable(row.get(key))) is not None]
    if value is None or not ends or str(row.get("unit") or "") in _COUNTED:
        return None
    span = ends[-1] - ends[0] if len(ends) > 1 else abs(ends[0])
    near = max(CLOSE * span, U or 0.0)
    return min(abs(value - end) for end in ends) / near if near else None


def _near(row: Mapping[str, Any]) -> str:
    value = value_text(float(row["measured"]), usable(row.get("expanded_uncertainty")))
    permitted = limits_text(row.get("lower_limit"), row.get("upper_limit"))
    at = "" if row.get("cycle") is None else said(" in cycle {cycle}", cycle=row["cycle"])
    unit = str(row["unit"])
    return said(
        "{row}{at} is close to its limit: {value} {unit}, permitted {permitted} {unit}",
        row=name_of(row),
        at=at,
        value=value,
        unit=unit,
        permitted=permitted,
    )
