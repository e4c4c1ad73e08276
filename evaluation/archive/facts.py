"""What can be asked of runs: the facts of their recording, and the results of their evaluation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from evaluation.archive.evaluate import ArchiveEvaluation
from evaluation.archive.kept import KeptRun
from evaluation.conformity import Purpose
from evaluation.summary import SUMMARY_NAMES
from recording.index import PLANNED, RECORDED
from recording.query import Field

_UNIT = re.compile(r"_(mm_per_s|kN_per_mm|mm|kN|Hz|J|C)$")
RESULTS = ("verdict", "purpose", *(f"measured_{name}" if name in PLANNED else name for name in SUMMARY_NAMES))
"""Facts that only an evaluation gives."""


_TEXTS = ("verdict", "purpose")


def _fields() -> dict[str, Field]:
    fields = {**RECORDED, **{n: Field(n, "text" if n in _TEXTS else "number") for n in RESULTS}}
    for name, field in list(fields.items()):
        fields.setdefault(_UNIT.sub("", name), field)  # prestress for prestress_mm
    return fields


FIELDS: Mapping[str, Field] = _fields()
"""Every name that a query may use; those with a unit also without it."""


def result_facts(run: KeptRun, purpose: Purpose | None = None) -> list[dict[str, Any]]:
    """Return what its evaluation says of a run, by the names in :data:`RESULTS`.

    One set of facts; of a run with several steps one each, and ``part`` is the number of the step then (else
    None).
    """
    facts = run.facts
    common = {"verdict": facts["verdict"], "purpose": None if purpose is None else purpose.purpose}
    return [
        {**common, "part": part.get("index"), **_means(part["means"])}
        for part in facts["steps"] or [{"means": facts["means"]}]
    ]


def _means(means: Mapping[str, Sequence[float | None]]) -> dict[str, float | None]:
    return {f"measured_{n}" if n in PLANNED else n: means[n][0] for n in SUMMARY_NAMES if n in means}


def results_by_path(evaluation: ArchiveEvaluation) -> dict[str, list[dict[str, Any]]]:
    """Return the results of runs by their file, as :func:`foundation.names.readable` writes it."""
    both = zip(evaluation.runs, evaluation.decided.purposes, strict=True)
    return {run.path: result_facts(run, purpose) for run, purpose in both}
