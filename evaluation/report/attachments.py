"""What the PDF of a report has inside: its evaluation, and what it rests on with hashes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bufferstand.evaluation.report.content import Attachment, Content
from bufferstand.evaluation.report.report_file import PROOF_NAME, PROOF_SCHEMA
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.foundation.files import canonical_json

DIGITAL_NAME = "digital-report.xml"
"""Name of the digital test report inside the PDF."""


def attachments_of(
    content: Content, source: ReportSource, evaluations: Mapping[str, bytes], digital: bytes | None = None
) -> tuple[Attachment, ...]:
    """Return the files that the PDF of a report has inside.

    Parameters
    ----------
    content : Content
        The report.
    source : ReportSource
        What it is made from; of a comparison, the whole of it.
    evaluations : mapping of str to bytes
        Evaluation documents as JSON, by the name of the file.
    digital : bytes or None
        The digital test report, where there is one.

    Returns
    -------
    tuple of Attachment
        The evaluations, the digital test report, :data:`PROOF_NAME`: the same bytes for the same report.
    """
    documents = tuple(
        Attachment(name, "Evaluation document that the report is made from", "application/json", data)
        for name, data in evaluations.items()
    )
    further: tuple[Attachment, ...] = ()
    if digital is not None:
        further = (Attachment(DIGITAL_NAME, "Digital test report (DCC 3.2.1)", "application/xml", digital),)
    proof = canonical_json(_proof(content, source, documents, further)).encode()
    told = "What the report rests on: run files and evaluation, with their hashes"
    return (*documents, *further, Attachment(PROOF_NAME, told, "application/json", proof))


def _proof(
    content: Content,
    source: ReportSource,
    documents: Sequence[Attachment],
    further: Sequence[Attachment],
) -> dict[str, Any]:
    fields = source.fields
    amends = None
    if fields.amends:
        amends = {
            "report": fields.amends,
            "sha256": source.predecessor.sha256 if source.predecessor else None,
            "issued": fields.amends_issued.isoformat() if fields.amends_issued else None,
            "reason": fields.amendment_reason,
            "changes": list(fields.amendment_changes),
        }
    return {
        "schema": PROOF_SCHEMA,
        "report": content.report_id,
        "number": fields.number,
        "draft": bool(content.missing),
        "software": content.software,
        "evaluations": [{"file": one.name, "sha256": one.sha256} for one in documents],
        "attached": [{"file": one.name, "sha256": one.sha256} for one in further],
        "runs": [
            {"number": run.number, "id": run.id, "file": run.file, "sha256": run.sha256}
            for run in source.runs
        ],
        "amends": amends,
    }
