"""Which files the report was made of, by their hashes (in ``dcc:comment``, in a namespace of its own)."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.digital.elements import PROOF, add, said
from bufferstand.evaluation.report.source import ReportSource, evaluation_hash


def add_proof(parent: ET.Element, source: ReportSource, content: Content) -> None:
    """Add the hashes of the report's content, of the evaluation, and of each run file and its content."""
    proof = ET.SubElement(add(parent, "comment"), f"{{{PROOF}}}proof", {"procedure": "SHA-256"})
    _add(proof, "report", content.report_id)
    _add(proof, "evaluation", evaluation_hash(source.evaluation))
    for run in source.runs:
        facts = {"number": str(run.number), "identifier": run.id, "file": run.file}
        recorded = run.evaluated["run"].get("sha256")
        if recorded:
            facts["content"] = str(recorded)
        _add(proof, "run", run.sha256, **facts)


def _add(parent: ET.Element, name: str, text: str, **facts: str) -> None:
    one = ET.SubElement(parent, f"{{{PROOF}}}{name}", {key: said(value) for key, value in facts.items()})
    one.text = text
