"""Elements of a DCC: names in the namespaces, texts with their language, and the file's bytes."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as ET

from bufferstand.foundation import plain

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"
PROOF = "urn:bufferstand:digital-report:1"
"""Of what stands in ``dcc:comment``: which files the report was made of."""
VERSION = "3.2.1"
LANGUAGE = "en"
NOT_ON_RECORD = "not on record"
_INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
_PREFIXES = {"dcc": DCC, "si": SI, "xsi": _INSTANCE, "proof": PROOF}
_NO_LETTERS = dict.fromkeys((0xFFFE, 0xFFFF), "�")


def root() -> ET.Element:
    """Return the root of a certificate, with the version of its schema and where that is published."""
    at = f"{DCC} {DCC}/v{VERSION}/dcc.xsd"
    return ET.Element(f"{{{DCC}}}digitalCalibrationCertificate", _attributes(at))


def _attributes(at: str) -> dict[str, str]:
    return {f"{{{_INSTANCE}}}schemaLocation": at, "schemaVersion": VERSION}


def add(parent: ET.Element, name: str, text: object = None, *, kind: str = "") -> ET.Element:
    """Add a ``dcc:`` element to ``parent`` and return it; ``kind`` is its refType."""
    child = ET.SubElement(parent, f"{{{DCC}}}{name}", {"refType": kind} if kind else {})
    if text is not None:
        child.text = said(text)
    return child


def add_si(parent: ET.Element, name: str, text: str | None = None) -> ET.Element:
    """Add an ``si:`` element (D-SI) to ``parent`` and return it."""
    child = ET.SubElement(parent, f"{{{SI}}}{name}")
    child.text = text
    return child


def add_text(parent: ET.Element, name: str, *texts: object, kind: str = "") -> ET.Element:
    """Add an element whose texts say in which language they are (``textType``, ``richContentType``)."""
    child = add(parent, name, kind=kind)
    for text in texts:
        add(child, "content", text).set("lang", LANGUAGE)
    return child


def add_software(parent: ET.Element, name: object, version: object, what: str) -> ET.Element:
    """Add a program and what it did; its version as PTB's rules want it, with a letter before the digits."""
    entry = add(parent, "software")
    add_text(entry, "name", name)
    release = str(version or "")
    add(entry, "release", f"v{release}" if release[:1].isdigit() else release)
    add(entry, "type", "application")
    add_text(entry, "description", what)
    return entry


def said(text: object) -> str:
    """Return a text as XML takes it: without control characters, and no blanks at its ends; never empty."""
    return " ".join(plain(str(text)).translate(_NO_LETTERS).split()) or NOT_ON_RECORD


def written(whole: ET.Element, notes: Iterable[str]) -> bytes:
    """Return a document as a file's bytes, with notes for whoever opens it in an editor before the root.

    Returns
    -------
    bytes
        UTF-8, indented; the same for the same elements.
    """
    for prefix, namespace in _PREFIXES.items():
        ET.register_namespace(prefix, namespace)
    ET.indent(whole)
    body = ET.tostring(whole, encoding="unicode")
    said_before = "".join(f"<!-- {said(note).replace('--', '−−')} -->\n" for note in notes)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{said_before}{body}\n'.encode()
