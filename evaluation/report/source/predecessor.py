"""The report that an amended one replaces: by its PDF, and so by its hash (ISO/IEC 17025, 7.8.8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bufferstand.evaluation.archive import compare_evaluations
from bufferstand.evaluation.report.report_file import read_report
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.foundation import BadInput


@dataclass(frozen=True, eq=False)
class Predecessor:
    """A report that another one replaces.

    Attributes
    ----------
    report : str
        Its id.
    sha256 : str
        Hash of its PDF.
    evaluation : mapping or None
        The evaluation inside; None where it has several, being a comparison.
    """

    report: str
    sha256: str
    evaluation: Mapping[str, Any] | None

    def moved(self, document: Mapping[str, Any]) -> bool:
        """Say whether an evaluation has another result, verdict or run than that of this report."""
        if self.evaluation is None:
            return False
        changes = compare_evaluations(self.evaluation, document)
        return bool(changes.moves or changes.verdicts or changes.only_old or changes.only_new)


def predecessor_of(fields: ReportFields) -> tuple[ReportFields, Predecessor | None]:
    """Return the report that is replaced, where its PDF is given, and the fields with its id.

    Raises
    ------
    BadInput
        If the PDF cannot be read, is no report of bufferstand, or is another one than ``amends`` says; or the
        extra ``sign`` is missing, which reads it.
    """
    if not fields.amends_report:
        return fields, None
    path = Path(fields.amends_report)
    report = read_report(path)
    identity = report.proof.report
    if fields.amends and fields.amends != identity:
        raise BadInput(
            f"this is report {identity}, and amends says {fields.amends}",
            file=path,
            remedy="correct amends or amends_report in report.toml",
        )
    documents = list(report.evaluations.values())
    only = documents[0] if len(documents) == 1 else None
    return fields.model_copy(update={"amends": identity}), Predecessor(identity, report.sha256, only)
