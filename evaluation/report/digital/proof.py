"""Which files the report was made of, by their hashes (in ``dcc:comment``, in a namespace of its own)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.digital.elements import PROOF, add, said
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.foundation.files import content_hash

_EVALUATED = (
    "decision_rule",
    "runs",
    "trends",
    "temperature_comparisons",
    "before_after",
    "proof_load_totals",
    "conformity",
)
"""What of an evaluation document says what was found; the rest says where files lay, and what computed it."""


def evaluation_hash(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what an evaluation found, whatever folder and libraries it was made with.

    Parameters
    ----------
    document : mapping
        An evaluation document; of each run its path is left out.

    Returns
    -------
    str
        64 hex digits, of the canonical JSON.
    """
    found = {key: document[key] for key in _EVALUATED if key in document}
    runs = [
        {**entry, "run": {key: value for key, value in entry["run"].items() if key != "path"}}
        for entry in found.get("runs") or []
    ]
    return content_hash({**found, "runs": runs})


def add_proof(parent: ET.Element, source: ReportSource, content: Content) -> None:
    """Add the hashes of the report's content, of the evaluation, and of each run file and its content."""
    proof = ET.SubElement(add(parent, "comment"), f"{{{PROOF}}}proof", {"procedure": "SHA-256"})
    _add(proof, "report", content.report_id)
    _add(proof, "evaluation", evaluation_hash(source.document))
    for run in source.runs:
        facts = {"number": str(run.number), "identifier": run.id, "file": run.file}
        recorded = run.evaluated["run"].get("sha256")
        if recorded:
            facts["content"] = str(recorded)
        _add(proof, "run", run.sha256, **facts)


def _add(parent: ET.Element, name: str, text: str, **facts: str) -> None:
    one = ET.SubElement(parent, f"{{{PROOF}}}{name}", {key: said(value) for key, value in facts.items()})
    one.text = text
