"""Facts of runs for queries: those of the recording, and results of the evaluation."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from bufferstand.evaluation.across_runs.conformity import Purpose
from bufferstand.evaluation.archive.evaluate import ArchiveEvaluation
from bufferstand.evaluation.archive.stored_run import StoredRun
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts import EXTREME_NAMES
from bufferstand.recording.finding import PLANNED, RECORDED, QueryField

_UNIT = re.compile(r"_(mm_per_s|kN_per_mm|mm|kN|Hz|J|C)$")


def _mean_name(name: str) -> str:
    """Return the name under which the mean of a figure is asked for, where its own means something else."""
    if name in PLANNED:
        return f"measured_{name}"
    return f"mean_{name}" if name in EXTREME_NAMES else name


RESULTS = ("verdict", "purpose", *EXTREME_NAMES, *(_mean_name(name) for name in QUANTITIES.names))
"""Facts that only an evaluation gives: ``…_max`` and ``…_min`` are extremes of the run, others are means."""


_TEXTS = ("verdict", "purpose")


def _fields() -> dict[str, QueryField]:
    fields = {**RECORDED, **{n: QueryField(n, "text" if n in _TEXTS else "number") for n in RESULTS}}
    for name, field in list(fields.items()):
        fields.setdefault(_UNIT.sub("", name), field)  # prestress for prestress_mm
    return fields


FIELDS: Mapping[str, QueryField] = _fields()
"""Every name that a query may use; those with a unit also without it."""


def result_facts(run: StoredRun, purpose: Purpose | None = None) -> list[dict[str, Any]]:
    """Return what its evaluation says of a run, by the names in :data:`RESULTS`.

    One set of facts. Of a run with several steps one each, and ``part`` is the number of the step then (else
    None); and one of the run as a whole, which has extremes and nothing else: they may lie between steps.
    """
    facts = run.facts
    common = {"verdict": facts["verdict"], "purpose": None if purpose is None else purpose.purpose}
    parts = [{**common, "part": part.get("index"), **_figures(part)} for part in facts["steps"] or [facts]]
    return [*parts, {"part": None, **_extremes(facts)}] if facts["steps"] else parts


def _figures(part: Mapping[str, Any]) -> dict[str, float | None]:
    means = part["means"]
    return {**{_mean_name(n): means[n][0] for n in QUANTITIES.names if n in means}, **_extremes(part)}


def _extremes(part: Mapping[str, Any]) -> dict[str, float | None]:
    return {name: extreme[0] for name, extreme in part["extremes"].items()}


def results_by_path(evaluation: ArchiveEvaluation) -> dict[str, list[dict[str, Any]]]:
    """Return the results of runs and copies by their file, as
    :func:`bufferstand.foundation.files.names.readable` writes it."""
    both = zip(evaluation.runs, evaluation.decided.purposes, strict=True)
    results = {run.path: result_facts(run, purpose) for run, purpose in both}
    return results | {copy.path: results[copy.of] for copy in evaluation.copies}
