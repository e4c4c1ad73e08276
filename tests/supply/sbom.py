"""The bill of materials (CycloneDX 1.6) of what runs: every package of the lock, its licence and its hashes.

The same lock gives the same bytes: no time of day is in it, and its serial number is made of its content.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
import uuid
from collections.abc import Sequence
from typing import Any

from tests.supply.licences import known, licence_of
from tests.supply.locks import ROOT, RUN, Pin, pins

SPECIFICATION = "1.6"
_SPACE = uuid.UUID("5b0f1d4e-6a0e-4f0e-9a3c-2f3a1b7f5d11")
MARKER, EACH = "bufferstand:marker", "bufferstand:hashes"
"""Properties of a component: on which systems it is installed, and what its hashes are of."""


def document(pinned: Sequence[Pin] | None = None) -> dict[str, Any]:
    """Return the bill of materials; of the lock for running if no other pins are given."""
    pinned = pins(ROOT / RUN) if pinned is None else pinned
    rules = known()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    own = f"pkg:pypi/{project['name']}@{project['version']}"
    components = [_component(pin, licence_of(pin.name, rules)) for pin in pinned]
    content = json.dumps(components, sort_keys=True)
    return {
        "$schema": f"http://cyclonedx.org/schema/bom-{SPECIFICATION}.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": SPECIFICATION,
        "serialNumber": f"urn:uuid:{uuid.uuid5(_SPACE, content)}",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": own,
                "name": project["name"],
                "version": project["version"],
                "purl": own,
                "licenses": [{"expression": project["license"]}],
            },
            "properties": [
                {"name": "bufferstand:lock", "value": RUN},
                {
                    "name": "bufferstand:lock-sha256",
                    "value": hashlib.sha256((ROOT / RUN).read_bytes()).hexdigest(),
                },
            ],
        },
        "components": components,
        "dependencies": [{"ref": own, "dependsOn": sorted({pin.purl for pin in pinned})}],
        "compositions": [{"aggregate": "complete", "assemblies": [own]}],
    }


def text(pinned: Sequence[Pin] | None = None) -> str:
    """Return it as JSON."""
    return json.dumps(document(pinned), indent=2, ensure_ascii=False) + "\n"


def _component(pin: Pin, licence: str | None) -> dict[str, Any]:
    found: dict[str, Any] = {
        "type": "library",
        "bom-ref": pin.purl,
        "name": pin.name,
        "version": pin.version,
        "purl": pin.purl,
        "hashes": [{"alg": "SHA-256", "content": one} for one in pin.sha256],
        "properties": [{"name": EACH, "value": "each of one distribution file that the lock admits"}],
    }
    if licence is not None:
        found["licenses"] = [{"expression": licence}]
    if pin.marker:
        found["properties"].append({"name": MARKER, "value": pin.marker})
    return found
