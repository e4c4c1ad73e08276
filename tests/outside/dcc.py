"""PTB's own checks of a DCC (schema, rules, units): ``.ci/peers`` installs the programs into ``.venv/dcc``.

The schema itself (dcc.xsd 3.2.1 and SI_Format.xsd 2.1.0, LGPL-3) is in no package, and no copy of it is kept
here. It is taken from the folder that BUFFERSTAND_DCC_SCHEMA names, or from ``shared/data/dcc`` beside the
repository.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / ".venv" / "dcc" / "bin" / "python"
NO_PROGRAMS = (
    "dcclib is not installed: NO DIGITAL REPORT IS CHECKED FROM OUTSIDE; “bash .ci/peers” installs it"
)
NO_SCHEMA = (
    "the DCC's schema is not here: NO DIGITAL REPORT IS CHECKED AGAINST ITS SCHEMA; put "
    "https://ptb.de/dcc/v3.2.1/dcc.xsd and https://ptb.de/si/v2.1.0/SI_Format.xsd into a folder, and name "
    "that in BUFFERSTAND_DCC_SCHEMA"
)
VERSION_NOTE = "You are not using the latest version of the DCC"
"""What PTB's rules say of 3.2.1 since 3.3.0 is there: that is no fault."""


@dataclass(frozen=True)
class Faults:
    """What is wrong with a file; ``schema`` is None where no schema is here."""

    schema: tuple[str, ...] | None
    rules: tuple[str, ...]
    units: tuple[str, ...]


def faults_of_dcc(files: Sequence[Path]) -> dict[Path, Faults]:
    """Return what PTB's programs find wrong with files; skip the test, loudly, where they are missing.

    Raises
    ------
    AssertionError
        If they end with an error.
    """
    if not PYTHON.exists():
        pytest.skip(NO_PROGRAMS)
    script = Path(__file__).with_name("dcc_check.py")
    done = subprocess.run(
        [PYTHON, "-I", script, str(schema_folder() or ""), *files],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout.splitlines()[-1])
    return {
        file: Faults(
            None if found["schema"] is None else tuple(found["schema"]),
            tuple(rule["text"] for rule in found["rules"] if not rule["text"].startswith(VERSION_NOTE)),
            tuple(found["units"]),
        )
        for file, found in ((file, said[str(file)]) for file in files)
    }


def schema_folder() -> Path | None:
    """Return the folder with the DCC's schema, or None where there is none."""
    named = os.environ.get("BUFFERSTAND_DCC_SCHEMA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data" / "dcc"
    return folder if (folder / "dcc.xsd").is_file() and (folder / "SI_Format.xsd").is_file() else None
