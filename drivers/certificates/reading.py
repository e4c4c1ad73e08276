"""Reading a digital calibration certificate of PTB's schema, versions 3.0 to 3.3 (https://ptb.de/dcc).

Reference and measured values are known by the names that PTB's good practice gives them (``refType``).
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date
from pathlib import Path
from xml.etree import ElementTree as ET

from bufferstand.drivers.certificates.certificate import Certificate, CertificateTable, Values
from bufferstand.drivers.certificates.quantities import Refuse, columns
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import xml_tree

DCC = "https://ptb.de/dcc"
VERSIONS = ("3.0.", "3.1.", "3.2.", "3.3.")
_ROOT = "digitalCalibrationCertificate"
_SIGNATURE = "{http://www.w3.org/2000/09/xmldsig#}Signature"
_REFERENCE, _SHOWN, _ERROR = "basic_referenceValue", "basic_measuredValue", "basic_measurementError"
_RECALIBRATION = "basic_recalibration"


def read_certificate(path: Path) -> Certificate:
    """Return what a calibration certificate says.

    Raises
    ------
    BadInput
        If the file is no certificate of a version that is known here, is of several items, has no table of
        reference and measured values, or says no number, day or laboratory.
    """
    root = xml_tree(path)
    _demand_kind(root, path)
    data = _only(root, "administrativeData", path)
    core = _only(data, "coreData", path)
    tables = tuple(_tables(root, path))
    if not tables:
        raise BadInput(
            f"it has no table with quantities {_REFERENCE} and {_SHOWN}",
            file=path,
            place="dcc:measurementResults",
            remedy="ask its laboratory for a certificate by PTB's good practice, or write the points by hand",
        )
    return Certificate(
        file=path,
        number=_demanded(core, "uniqueIdentifier", path),
        laboratory=_demanded(data, "calibrationLaboratory/contact/name/content", path),
        item=_item(data, path),
        day=_day(_demanded(core, "endPerformanceDate", path), "endPerformanceDate", path),
        valid_until=_valid_until(data, path),
        signed=root.find(_SIGNATURE) is not None,
        tables=tables,
    )


def _demand_kind(root: ET.Element, path: Path) -> None:
    if root.tag != f"{{{DCC}}}{_ROOT}":
        space, _, name = root.tag.rpartition("}")
        of = f" of “{space.lstrip('{')[:80]}”" if space else ""
        raise BadInput(
            f"it begins with <{name[:60]}>{of}, and not with <{_ROOT}> of “{DCC}”",
            file=path,
            remedy="give a digital calibration certificate (DCC)",
        )
    version = root.get("schemaVersion", "")
    if not version.startswith(VERSIONS):
        raise BadInput(
            f"it is of version “{version[:40]}” of the schema; known are 3.0 to 3.3",
            file=path,
            place="schemaVersion",
            remedy="ask its laboratory for one of these versions",
        )


def _tables(root: ET.Element, path: Path) -> Iterator[CertificateTable]:
    results = "/".join(
        f"{{{DCC}}}{n}" for n in ("measurementResults", "measurementResult", "results", "result")
    )
    for result in root.iterfind(results):
        name = _text(result, "name/content") or "without a name"
        for listed in result.iter(f"{{{DCC}}}list"):
            if not all(_of_kind(listed, kind) for kind in (_REFERENCE, _SHOWN)):
                continue
            reference, shown, error = (_columns(listed, kind, path) for kind in (_REFERENCE, _SHOWN, _ERROR))
            if reference and shown:
                yield CertificateTable(name, reference, shown, error)


def _of_kind(listed: ET.Element, kind: str) -> list[ET.Element]:
    return [one for one in listed.iterfind(f"{{{DCC}}}quantity") if kind in one.get("refType", "").split()]


def _columns(listed: ET.Element, kind: str, path: Path) -> tuple[Values, ...]:
    """Return the values of the quantities of one kind of a list, in every unit that they are given in."""
    quantities = _of_kind(listed, kind)
    if len(quantities) > 1:
        raise BadInput(
            f"a table has {len(quantities)} quantities {kind}: which of them is meant is not clear",
            file=path,
            place="dcc:list",
            remedy="write the points by hand (docs/how-to/calibrate.md)",
        )
    return columns(quantities[0], _refusing(path, kind)) if quantities else ()


def _refusing(path: Path, kind: str) -> Refuse:
    def refuse(problem: str, remedy: str) -> BadInput:
        return BadInput(problem, file=path, place=kind, remedy=remedy)

    return refuse


def _item(data: ET.Element, path: Path) -> str:
    items = data.findall(_path("items/item"))
    if len(items) != 1:
        raise BadInput(
            f"it is of {len(items)} items, and does not say which of them its values are of",
            file=path,
            place="dcc:items",
            remedy="write the points by hand (docs/how-to/calibrate.md)",
        )
    (item,) = items
    serials = [
        _text(one, "value")
        for one in item.iterfind(_path("identifications/identification"))
        if _text(one, "issuer") == "manufacturer"
    ]
    known = [_text(item, "model") or _text(item, "name/content"), *serials]
    return " ".join(dict.fromkeys(part for part in known if part))


def _valid_until(data: ET.Element, path: Path) -> date | None:
    days = {
        day
        for statement in data.iterfind(_path("statements/statement"))
        if _RECALIBRATION in statement.get("refType", "").split() and (day := _text(statement, "date"))
    }
    if len(days) > 1:
        raise BadInput(
            f"it names several days of recalibration: {', '.join(sorted(days))}",
            file=path,
            place=_RECALIBRATION,
            remedy="name the right one by --valid-until",
        )
    return _day(days.pop(), _RECALIBRATION, path) if days else None


def _day(text: str, place: str, path: Path) -> date:
    try:
        return date.fromisoformat(text[:10])
    except ValueError:
        raise BadInput(
            f"“{text[:40]}” is no day", file=path, place=place, remedy="ask its laboratory"
        ) from None


def _only(parent: ET.Element, name: str, path: Path) -> ET.Element:
    found = parent.find(_path(name))
    if found is None:
        raise BadInput("it is missing", file=path, place=f"dcc:{name}", remedy="ask its laboratory")
    return found


def _demanded(parent: ET.Element, names: str, path: Path) -> str:
    if text := _text(parent, names):
        return text
    raise BadInput("it is missing or empty", file=path, place=f"dcc:{names}", remedy="ask its laboratory")


def _text(parent: ET.Element, names: str) -> str:
    return " ".join((parent.findtext(_path(names)) or "").split())


def _path(names: str) -> str:
    return "/".join(f"{{{DCC}}}{name}" for name in names.split("/"))
