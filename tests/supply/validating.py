"""Holds a bill of materials to CycloneDX's schema, by the library of those who make it.

It lies in an environment of its own, by hash from ``cyclonedx.lock``: ``bash .ci/peers`` makes it.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from tests.supply.locks import ROOT

ENVIRONMENT = Path(os.environ.get("BUFFERSTAND_CYCLONEDX", ROOT / ".venv" / "cyclonedx"))
PYTHON = ENVIRONMENT / "bin" / "python"
_SCRIPT = """
import sys
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(open(sys.argv[1], encoding="utf-8").read())
print("" if error is None else repr(error))
"""


def is_there() -> bool:
    """Return whether the library is installed."""
    return PYTHON.exists()


def problems(file: Path) -> list[str]:
    """Return what the schema says against a file.

    Raises
    ------
    FileNotFoundError
        If the library is not there.
    """
    if not is_there():
        raise FileNotFoundError(f"{PYTHON}: run “bash .ci/peers”, which installs CycloneDX's library")
    said = subprocess.run(
        [str(PYTHON), "-c", _SCRIPT, str(file)], capture_output=True, text=True, check=True
    ).stdout.strip()
    return [said] if said else []
