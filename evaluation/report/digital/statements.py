"""What the report states as a whole, and the conformity of each requirement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.content import Section, Texts, usable
from bufferstand.evaluation.report.digital.elements import add, add_si, add_text
from bufferstand.evaluation.report.digital.quantities import DSI_UNITS, exact
from bufferstand.evaluation.report.sections import (
    deviations_section,
    is_draft,
    name_of,
    not_tested_section,
    opinions_section,
    reference_text,
    remarks_section,
    rule_section,
    signatures,
    warnings_section,
)
from bufferstand.evaluation.report.source import ReportSource, purpose_texts

CONFORMITY = "basic_conformity"
"""The refType that PTB's examples give to a statement of conformity."""
DRAFT = "bufferstand_draft"
_CONVENTIONS = {
    "simple": "ILAC-G8:09/2019, simple acceptance, w = 0",
    "guard-band": "ILAC-G8:09/2019, guard band, w = U",
}
_CONFORMITY = {
    "pass": "pass",
    "conditional-pass": "conditionalPass",
    "conditional-fail": "conditionalFail",
    "fail": "fail",
}
"""Verdicts that the schema has a word for; an open or invalid one has none, and is told in words."""


def add_statements(
    parent: ET.Element, source: ReportSource, notices: Iterable[str], missing: Sequence[str]
) -> None:
    """Add what holds for the whole report: a draft first, then notices, conformity, rule, what is open."""
    statements = add(parent, "statements")
    if missing:
        _add_texts(statements, "Draft", ("This report is a draft. It lacks:", *missing), kind=DRAFT)
    for notice in notices:
        _add_texts(statements, "Notice", (notice,))
    for statement, text in zip(source.statements, purpose_texts(source), strict=True):
        _add_conformity_test(statements, source, statement, text)
    if source.fields.place_of_test:
        _add_texts(statements, "Place of the test", (source.fields.place_of_test,))
    for section in (
        deviations_section(source),
        not_tested_section(source),
        warnings_section(source),
        rule_section(source),
        opinions_section(source),
        remarks_section(source),
    ):
        if section is not None:
            _add_section(statements, section)
    _add_texts(statements, "Validity", signatures(source)[1].items)


def _add_section(parent: ET.Element, section: Section) -> None:
    texts = [text for block in section.blocks if isinstance(block, Texts) for text in block.items]
    _add_texts(parent, section.title, texts)


def _add_texts(parent: ET.Element, name: str, texts: Iterable[str], *, kind: str = "") -> None:
    entry = add(parent, "statement", kind=kind)
    add_text(entry, "name", name)
    add_text(entry, "declaration", *texts)


def _add_conformity_test(
    parent: ET.Element, source: ReportSource, statement: Mapping[str, Any], text: str
) -> None:
    """Add on which runs a statement of conformity rests, and its verdict."""
    runs = [run for run in source.runs if run.id in statement["runs"]]
    requirements = [requirement for run in runs for requirement in run.stated]
    entry = _start(parent, "statement", "Conformity test", requirements, source)
    verdict = statement["verdict"]
    add_text(entry, "declaration", text, f"Verdict: {verdict or 'none'}.")
    if verdict in _CONFORMITY:
        add(entry, "conformity", _CONFORMITY[verdict])


def add_conformity(parent: ET.Element, requirement: Mapping[str, Any], source: ReportSource) -> None:
    """Add to a measured quantity which requirement it was judged by, its limits, and the verdict."""
    data = add(parent, "measurementMetaData")
    entry = _start(data, "metaData", str(requirement["requirement"]), [requirement], source)
    probability = usable(requirement.get("conformance_probability"))
    texts = [
        f"{str(requirement['verdict']).replace('-', ' ')}: {requirement.get('why') or name_of(requirement)}"
    ]
    if probability is not None:
        texts.append(f"Conformance probability {probability:.4f}")
    add_text(entry, "declaration", *texts)
    if requirement["verdict"] in _CONFORMITY:
        add(entry, "conformity", _CONFORMITY[str(requirement["verdict"])])
    unit = str(requirement.get("unit") or "")
    limits = [
        (words, value)
        for words, key in (("Lower limit", "lower_limit"), ("Upper limit", "upper_limit"))
        if (value := usable(requirement.get(key))) is not None
    ]
    if limits:
        held = add(entry, "data")
        for words, value in limits:
            _add_limit(held, words, value, unit)


def _add_limit(parent: ET.Element, words: str, value: float, unit: str) -> None:
    quantity = add(parent, "quantity")
    add_text(quantity, "name", words)
    if unit not in DSI_UNITS:
        add_text(quantity, "noQuantity", f"{exact(value)} {unit}")
        return
    real = add_si(quantity, "real")
    add_si(real, "value", exact(value))
    add_si(real, "unit", DSI_UNITS[unit])


def _start(
    parent: ET.Element,
    name: str,
    words: str,
    requirements: Iterable[Mapping[str, Any]],
    source: ReportSource,
) -> ET.Element:
    """Add a statement of conformity with its rule, standards and clauses; a draft is marked as one."""
    requirements = list(requirements)
    draft = not requirements or any(is_draft(one) for one in requirements)
    entry = add(parent, name, kind=f"{CONFORMITY} {DRAFT}" if draft else CONFORMITY)
    add_text(entry, "name", f"Draft: {words}" if draft else words)
    if convention := _CONVENTIONS.get(str(source.decision_rule)):
        add(entry, "convention", convention)
    for norm in dict.fromkeys(norm_of(one) for one in requirements):
        add(entry, "norm", norm)
    for reference in dict.fromkeys(reference_text(one) for one in requirements):
        add(entry, "reference", reference)
    return entry


def norm_of(requirement: Mapping[str, Any]) -> str:
    """Return standard and edition, or that the edition is not on record."""
    return f"{requirement['standard']}:{requirement.get('edition') or ' edition not on record'}"
