"""The number that a report has in the laboratory's own range."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bufferstand.evaluation.report.build import missing_of
from bufferstand.evaluation.report.source import ReportSource, is_pattern, number_of_range, without_paths
from bufferstand.evaluation.wording import said
from bufferstand.foundation.files import content_hash

_OF_A_DRAFT = said("given when the report is no draft any more")


def with_number(source: ReportSource) -> ReportSource:
    """Return the source with its number, where ``report.toml`` has the pattern of a range.

    A draft takes no number. The same evaluation (runs, results, decision rule, the report that it amends)
    has the number that it got before, so that a report can be made anew.

    Raises
    ------
    BadInput
        As :func:`~bufferstand.evaluation.report.source.number_range.number_of_range`.
    """
    fields = source.fields
    if not is_pattern(fields.number):
        return source
    if missing_of(source) or fields.issued is None:
        number = _OF_A_DRAFT
    else:
        number = number_of_range(
            fields.number,
            Path(fields.number_register),
            year=fields.issued.year,
            evaluation=_evaluation(source),
            report=source.name,
        )
    return replace(source, fields=fields.model_copy(update={"number": number}))


def _evaluation(source: ReportSource) -> str:
    """Return a hash of what is reported: the runs' content and results, wherever their files lie."""
    return content_hash(
        {
            "runs": sorted(
                without_paths(source.evaluation["runs"]), key=lambda entry: str(entry["run"].get("id"))
            ),
            "decision_rule": source.decision_rule,
            "amends": source.fields.amends,
        }
    )
