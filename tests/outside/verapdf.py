"""veraPDF, the reference checker of PDF/A; ``.ci/peers`` copies it into ``.venv/verapdf``."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import pytest

Flavour = Literal["2b", "3b"]

FOLDER = Path(__file__).resolve().parents[2] / ".venv" / "verapdf"
NOT_HERE = (
    "veraPDF is not installed: NO PDF IS CHECKED AGAINST PDF/A FROM OUTSIDE; “bash .ci/peers” installs it"
)


def faults_of_pdfa(pdfs: Sequence[Path], flavour: Flavour, home: Path) -> dict[Path, tuple[str, ...]]:
    """Return what veraPDF finds wrong with files; skip the test, loudly, where veraPDF is not installed.

    Parameters
    ----------
    pdfs : sequence of Path
        The files. One call for many: each start of Java takes a second or two.
    flavour : {"2b", "3b"}
        The part and level of ISO 19005 that they are checked against, whatever they declare.
    home : Path
        A folder of the test, where veraPDF keeps settings of its own.

    Returns
    -------
    dict of Path to tuple of str
        Of each file the rules that it breaks, with clause and what is wrong; empty where it conforms.

    Raises
    ------
    AssertionError
        If veraPDF gives no answer, or one for other files.
    """
    java = shutil.which("java")
    if java is None or not FOLDER.is_dir():
        pytest.skip(NOT_HERE)
    done = subprocess.run(
        [
            java,
            f"-Dapp.home={home}",
            "-cp",
            f"{FOLDER}/*",
            "org.verapdf.apps.GreenfieldCliWrapper",
            *("--flavour", flavour, "--format", "json"),
            *(str(pdf.resolve()) for pdf in pdfs),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.stdout.startswith("{"), f"veraPDF ended with {done.returncode}: {done.stderr}"
    jobs = {Path(job["itemDetails"]["name"]): job for job in json.loads(done.stdout)["report"]["jobs"]}
    assert jobs.keys() == {pdf.resolve() for pdf in pdfs}, sorted(jobs)
    return {pdf: _faults(jobs[pdf.resolve()]) for pdf in pdfs}


def _faults(job: dict[str, Any]) -> tuple[str, ...]:
    """Say what is wrong with one file: it could not be read, or it breaks rules."""
    if failed := job.get("taskException"):
        return (f"not read: {failed['exceptionMessage']}",)
    (result,) = job["validationResult"]
    faults = tuple(
        f"{rule['specification']}, {rule['clause']}-{rule['testNumber']}: {rule['description']} "
        f"({rule['checks'][0].get('errorMessage', rule['test'])})"
        for rule in result["details"]["ruleSummaries"]
    )
    assert result["compliant"] == (not faults), result
    return faults
