"""Who, what, where and when (``dcc:administrativeData``)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any
from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.build import every_notice, missing_of
from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.digital.elements import (
    LANGUAGE,
    NOT_ON_RECORD,
    add,
    add_software,
    add_text,
)
from bufferstand.evaluation.report.digital.quantities import add_quantity
from bufferstand.evaluation.report.digital.statements import add_statements
from bufferstand.evaluation.report.sections import customer, laboratory, operator
from bufferstand.evaluation.report.source import ReportRun, ReportSource
from bufferstand.foundation import BadInput

UNKNOWN_COUNTRY = "ZZ"
"""ISO 3166-1 leaves it to users; CLDR: unknown region. Only a draft has it."""
_DESCRIBED = (
    ("kind", "Kind"),
    ("category", "Category"),
    ("elastic_system", "Elastic system"),
    ("assembled", "Assembled"),
    ("year", "Year"),
    ("description", "Description"),
)


def add_administrative(parent: ET.Element, source: ReportSource, content: Content) -> None:
    """Add the administrative data; a draft's lacks are those of both reports.

    Raises
    ------
    BadInput
        If no run says when it was made: the schema demands the dates of the test.
    """
    data = add(parent, "administrativeData")
    software: Mapping[str, Any] = source.document.get("software") or {}
    ours = "Evaluated the runs and wrote this file."
    add_software(add(data, "dccSoftware"), "bufferstand", software.get("version"), ours)
    _add_core(data, source, content)
    _add_items(add(data, "items"), source)
    fields = source.fields
    _add_contact(
        add(add(data, "calibrationLaboratory"), "contact"),
        laboratory(source),
        (fields.laboratory_address,),
        fields.country,
    )
    _add_persons(add(data, "respPersons"), source)
    _add_contact(add(data, "customer"), customer(source), (fields.customer_address,), None)
    # Those of the content are in the report's language; the texts of this file are in one, English.
    add_statements(data, source, every_notice(source), (*missing_of(source), *lacking(source)))


def lacking(source: ReportSource) -> tuple[str, ...]:
    """Return what a digital report lacks besides what a printed one does, in words."""
    return () if source.fields.country else ("country of the laboratory (country = “…” in report.toml)",)


def _add_core(parent: ET.Element, source: ReportSource, content: Content) -> None:
    fields = source.fields
    begun = [run.started.date() for run in source.runs if run.started is not None]
    ended = [run.ended.date() for run in source.runs if run.ended is not None]
    if not begun:
        raise BadInput(
            "no run says when it was made, and a digital report must",
            place="started",
            remedy="import the records anew with “started” in [test], or report without --dtr",
        )
    core = add(parent, "coreData")
    add(core, "countryCodeISO3166_1", fields.country or UNKNOWN_COUNTRY)
    add(core, "usedLangCodeISO639_1", LANGUAGE)
    add(core, "mandatoryLangCodeISO639_1", LANGUAGE)
    add(core, "uniqueIdentifier", content.report_id)
    if fields.number:
        _add_identifications(core, [("calibrationLaboratory", "Number of the report", fields.number)])
    if fields.received:
        add(core, "receiptDate", fields.received.isoformat())
    add(core, "beginPerformanceDate", min(begun).isoformat())
    add(core, "endPerformanceDate", max(ended or begun).isoformat())
    add(core, "performanceLocation", _location(source))
    if fields.issued:
        add(core, "issueDate", fields.issued.isoformat())
    if fields.amends:
        replaced = add(core, "reportAmendedSubstituted")
        add(replaced, "typeOfChange", "substituted")
        add(replaced, "replacedUniqueIdentifier", fields.amends)


def _location(source: ReportSource) -> str:
    """Return where it was tested in the schema's words: the laboratory, its customer's, or another place."""
    place = source.fields.place_of_test
    if place and place in (laboratory(source), source.fields.laboratory_address):
        return "laboratory"
    return "customer" if place and place in (customer(source), source.fields.customer_address) else "other"


def _add_items(parent: ET.Element, source: ReportSource) -> None:
    """Add each specimen of the runs once."""
    for run in {str(run.fact("specimen", "id")): run for run in reversed(source.runs)}.values():
        _add_item(parent, run, source)


def _add_item(parent: ET.Element, run: ReportRun, source: ReportSource) -> None:
    facts: Mapping[str, Any] = run.fact("specimen") or {}
    item = add(parent, "item")
    kind = str(facts.get("kind") or "specimen").replace("-", " ")
    add_text(item, "name", f"{kind} {facts.get('id') or ''}")
    described = [f"{words}: {facts[key]}" for key, words in _DESCRIBED if facts.get(key)]
    if source.fields.specimen_condition:
        described.append(f"Condition: {source.fields.specimen_condition}")
    if described:
        add_text(item, "description", *described)
    if facts.get("maker"):
        add_text(add(item, "manufacturer"), "name", facts["maker"])
    known = [("calibrationLaboratory", "Id of the specimen", facts.get("id") or NOT_ON_RECORD)]
    if facts.get("serial"):
        known.append(("manufacturer", "Serial number", facts["serial"]))
    _add_identifications(item, known)
    if facts.get("max_stroke_mm") is not None:
        quantities = add(item, "itemQuantities")
        add_quantity(quantities, "Full stroke", facts["max_stroke_mm"], "mm", element="itemQuantity")


def _add_identifications(parent: ET.Element, known: Iterable[tuple[str, str, object]]) -> None:
    identifications = add(parent, "identifications")
    for issuer, name, value in known:
        one = add(identifications, "identification")
        add(one, "issuer", issuer)
        add(one, "value", value)
        add_text(one, "name", name)


def _add_contact(parent: ET.Element, name: str, lines: Iterable[str], country: str | None) -> None:
    add_text(parent, "name", name)
    location = add(parent, "location")
    if country:
        add(location, "countryCode", country)
    add_text(location, "further", *lines)


def _add_persons(parent: ET.Element, source: ReportSource) -> None:
    """Add who answers for the report; who authorised it, or would, signs it."""
    fields = source.fields
    roles = (("tested by", operator(source)), ("checked by", fields.checked_by))
    for role, name in (*roles, ("authorised by", fields.authorised_by or NOT_ON_RECORD)):
        if name:
            person = add(parent, "respPerson")
            add_text(add(person, "person"), "name", name)
            add(person, "role", role)
            add(person, "mainSigner", "true" if role == "authorised by" else "false")
