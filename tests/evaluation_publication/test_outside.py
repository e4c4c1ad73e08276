"""The validator of the RO-Crate community, in an environment of its own, finds nothing wrong (.ci/peers)."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
import rocrate

from bufferstand.evaluation.publication import publish

from .conftest import LEAST, QUICK, ROOT, Crate, campaign

pytestmark = pytest.mark.slow

PYTHON = ROOT / ".venv" / "roc-validator" / "bin" / "python"
CONTEXT = Path(rocrate.__file__).parent / "data" / "ro-crate.jsonld"
WISHES = {
    "ro-crate-1.2_42.1": "the preview has the name that the specification gives it",
    "ro-crate-1.2_86.2": "an organisation’s address is the laboratory’s to give",
    "ro-crate-1.2_89.0": "so is its identifier in ror.org",
    "ro-crate-1.2_90.1": "nobody’s address for letters is published unasked",
    "ro-crate-1.2_91.0": "not everybody who worked on a test has an ORCID",
    "ro-crate-1.2_93.0": "nobody’s address for letters is published unasked",
}
"""What is recommended and not done, and why."""


def checked(crate: Path, cache: Path) -> dict[str, Any]:
    """Return what the validator says of a crate."""
    if not PYTHON.exists():
        pytest.skip(
            "roc-validator is not installed: NO CRATE IS CHECKED FROM OUTSIDE; “bash .ci/peers” installs it"
        )
    script = Path(__file__).with_name("outside_check.py")
    done = subprocess.run(
        [PYTHON, "-I", script, crate, CONTEXT, cache],
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return said


def test_a_crate_is_as_the_specification_requires_and_recommends(crate: Crate, tmp_path: Path) -> None:
    said = checked(crate.folder, tmp_path / "cache")
    assert said["passed"], said["issues"]
    assert {issue["check"] for issue in said["issues"]} <= set(WISHES), said["issues"]


def test_so_is_one_file_with_the_least_that_is_asked_for(tmp_path: Path) -> None:
    publish(campaign(tmp_path / "campaign", LEAST), tmp_path / "crate.zip", judging=QUICK)
    said = checked(tmp_path / "crate.zip", tmp_path / "cache")
    assert said["passed"], said["issues"]


def test_the_validator_finds_what_is_wrong(crate: Crate, tmp_path: Path) -> None:
    metadata = crate.folder / "ro-crate-metadata.json"
    document = json.loads(metadata.read_text(encoding="utf-8"))
    (root,) = [one for one in document["@graph"] if one["@id"] == "./"]
    del root["license"]
    (tmp_path / metadata.name).write_text(json.dumps(document), encoding="utf-8")
    said = checked(tmp_path, tmp_path / "cache")
    assert not said["passed"]
