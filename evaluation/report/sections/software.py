"""The section on the software: whether this version was validated (ISO/IEC 17025, 7.11.2)."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Cell, Section, Sheet, Texts, moment_text
from bufferstand.evaluation.report.sections.identity import given, recording_software
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import said

_NONE = said(
    "No validation record is named. One is made by “bufferstand validate --out DIR”; name it in "
    "report.toml: validation = “validation.json”."
)
_OTHER = said(
    "The record is of another version than the one that evaluated these runs: it does not show "
    "that this one is right."
)
_BAD = said("The record says that values were not as agreed: these results must not be relied upon.")


def software_section(source: ReportSource) -> Section:
    """Return what validated the software that evaluated the runs, or that nothing did."""
    record = source.validation
    version = (source.document.get("software") or {}).get("version")
    used = Sheet(
        "",
        (
            (said("Recorded with"), recording_software(source)),
            (
                said("Evaluated with"),
                given(
                    said("bufferstand {version}", version=version) if version else "",
                    said("not stated in the document"),
                ),
            ),
        ),
    )
    if record is None:
        return Section("software", said("Validation of the software"), (used, Texts((_NONE,))), annex=True)
    validated, evaluated = record["software"], source.document.get("software") or {}
    compared, missed = record["values_compared"], record["values_missed"]
    facts = (
        (said("Validated"), Cell(str(record["judged"]))),
        (said("On"), Cell(moment_text(str(record["made"])) or str(record["made"]))),
        (said("By"), given(record["by"], said("not stated in the record"))),
        (
            said("Result"),
            Cell(
                said(
                    "{compared} of {compared_2} agreed values in {sets_judged} sets",
                    compared=compared - missed,
                    compared_2=compared,
                    sets_judged=record["sets_judged"],
                )
            ),
        ),
        (said("SHA-256 of the record"), Cell(str(record["sha256"]), "code")),
        (said("SHA-256 of the validated code"), Cell(str(validated["code_sha256"]), "code")),
    )
    doubts = []
    if record["other_program"] or evaluated.get("code_sha256") != validated["code_sha256"]:
        doubts.append(_OTHER)
    if not record["good"]:
        doubts.append(_BAD)
    blocks = (used, Sheet("", facts), *((Texts(tuple(doubts)),) if doubts else ()))
    return Section("software", said("Validation of the software"), blocks, annex=True)
