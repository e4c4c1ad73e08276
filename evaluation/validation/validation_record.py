"""The record of a validation: what was judged, by what software, when, and how it came out."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.evaluation.archive import Software, software
from bufferstand.evaluation.validation.evaluate_sets import SetResult, evaluate_set, judge_results
from bufferstand.evaluation.validation.standard_sets import StandardSet, hash_of_sets
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import content_hash, json_object
from bufferstand.foundation.settings import read_text

SCHEMA = "bufferstand/validation/1"


@dataclass(frozen=True)
class Validation:
    """A validation: results of every set, the moment, the software and who made it.

    ``judged`` names the program whose results these are; empty: this installation.
    """

    results: tuple[SetResult, ...]
    made: datetime
    software: Software
    by: str = ""
    judged: str = ""

    @property
    def good(self) -> bool:
        """Whether every agreed value of every set was found."""
        return bool(self.results) and all(result.good for result in self.results)

    @property
    def checks(self) -> int:
        """How many agreed values were compared."""
        return sum(len(result.checks) for result in self.results)

    @property
    def missed(self) -> int:
        """How many of them were not found."""
        return sum(len(result.missed) for result in self.results)

    def document(self) -> dict[str, Any]:
        """Return the record as a JSON object with a hash of its own content."""
        own = self.software
        content: dict[str, Any] = {
            "schema": SCHEMA,
            "made": self.made.isoformat(timespec="seconds"),
            "by": self.by,
            "judged": self.judged or f"bufferstand {own.text}",
            "other_program": bool(self.judged),
            "good": self.good,
            "sets_judged": len(self.results),
            "values_compared": self.checks,
            "values_missed": self.missed,
            "software": {
                "version": own.version,
                "code_sha256": own.code_sha256,
                "python": own.python,
                "libraries": dict(own.libraries),
            },
            "machine": {"system": platform.system(), "processor": platform.machine()},
            "sets_sha256": hash_of_sets([result.standard for result in self.results]),
            "sets": [_entry(result) for result in self.results],
        }
        return {**content, "sha256": content_hash(content)}


def _entry(result: SetResult) -> dict[str, Any]:
    truth = result.standard.truth
    return {
        "id": truth.id,
        "title": truth.title,
        "files_sha256": dict(result.standard.hashes()),
        "good": result.good,
        "problem": result.problem,
        "checks": [
            {
                "of": check.agreed.of.text,
                "what": check.agreed.what,
                "agreed": check.agreed.value,
                "tolerance": check.agreed.tolerance,
                "unit": check.agreed.unit,
                "source": check.agreed.source,
                "found": check.found,
                "deviation": check.deviation,
                "good": check.good,
            }
            for check in result.checks
        ],
        "warnings": list(result.warnings),
    }


def validate(
    sets: Sequence[StandardSet],
    *,
    by: str = "",
    results: Mapping[str, Any] | None = None,
    judged: str = "",
    made: datetime | None = None,
    report: Callable[[SetResult], None] = lambda _: None,
) -> Validation:
    """Evaluate standard data sets with this installation and compare with what is agreed.

    Parameters
    ----------
    sets : sequence of StandardSet
    by : str
        Who validates.
    results : mapping, optional
        Results of another program by set
        (:func:`bufferstand.evaluation.validation.evaluate_sets.judge_results`): judge these instead.
    judged : str
        The name of that program.
    made : datetime, optional
        The moment; now by default.
    report : callable
        Told of each set when it is done.

    Returns
    -------
    Validation

    Raises
    ------
    BadInput
        If the other program's results are of none of the sets.
    """
    found: list[SetResult] = []
    for standard in sets:
        result = evaluate_set(standard) if results is None else judge_results(standard, results)
        if result is not None:
            found.append(result)
            report(result)
    if not found:
        raise BadInput(
            "holds results of none of the sets",
            file="--results",
            remedy="its keys are the ids of the sets, such as closed-form/ellipse-100",
        )
    return Validation(tuple(found), made or datetime.now(UTC), software(), by, judged)


def load_validation(path: Path) -> Mapping[str, Any]:
    """Read a validation record (``validation.json``).

    Raises
    ------
    BadInput
        If it cannot be read, is none, or its content is not what its hash says.
    """
    remedy = "make one: bufferstand validate --out DIR"
    document = json_object(read_text(path), path, remedy=remedy)
    if document.get("schema") != SCHEMA:
        raise BadInput("is no validation record", file=path, remedy=remedy)
    content = {key: value for key, value in document.items() if key != "sha256"}
    try:
        whole = content_hash(content) == document.get("sha256")
    except (ValueError, TypeError):
        whole = False
    if not whole:
        raise BadInput(
            "the validation record was altered: its hash is not that of its content",
            file=path,
            place="sha256",
            remedy="make it anew: bufferstand validate --out DIR",
        )
    return document
