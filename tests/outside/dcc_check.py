"""Checks DCC files with PTB's own programs; run by the Python of the environment that has them (.ci/peers).

    python dcc_check.py SCHEMAS FILE.xml...

SCHEMAS is a folder with dcc.xsd and SI_Format.xsd, or empty. Nothing is fetched. Prints JSON: of each file
what the schema finds wrong (null without one), what PTB's rules (schematron) find, and which units are none
of D-SI.
"""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import xmlschema
from dcclib.validation.schematron import SchematronValidator
from dsi_unit import DsiUnit

SI = "https://ptb.de/si"
SIGNATURES = "http://www.w3.org/2000/09/xmldsig#"


def schema_of(folder: Path) -> Any:
    """Return the schema of a folder, with that of signatures from the library: nothing is fetched."""
    signatures = Path(xmlschema.__file__).parent / "schemas" / "DSIG" / "xmldsig-core-schema.xsd"
    return xmlschema.XMLSchema(
        str(folder / "dcc.xsd"),
        locations={SI: str(folder / "SI_Format.xsd"), SIGNATURES: str(signatures)},
        allow="local",
    )


def unknown_units(file: Path) -> list[str]:
    """Return the units of a file that D-SI does not have."""
    found = {str(unit.text) for unit in ET.parse(file).iter(f"{{{SI}}}unit")}
    wrong = []
    for unit in sorted(found):
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            if not DsiUnit(unit).valid:
                wrong.append(unit)
    return wrong


def main(schemas: str, files: list[Path]) -> None:
    schema = schema_of(Path(schemas)) if schemas else None
    rules = SchematronValidator.for_dcc()
    said = {}
    for file in files:
        result = rules.validate_file(str(file))
        reports = [*result.failed_assertions, *result.successful_reports]
        said[str(file)] = {
            "schema": None
            if schema is None
            else [f"{error.path}: {error.reason}" for error in schema.iter_errors(str(file))],
            "rules": [
                {"role": report.role, "text": " ".join(report.text.split())}
                for report in reports
                if report.role != "information"
            ],
            "units": unknown_units(file),
        }
    print(json.dumps(said))


if __name__ == "__main__":
    main(sys.argv[1], [Path(name) for name in sys.argv[2:]])
