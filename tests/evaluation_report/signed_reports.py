"""A small report of a recorded run, signed; for the tests of signing and of verifying."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.report import write_report
from bufferstand.evaluation.report.signing import open_key, signed
from bufferstand.evaluation.report.source import Given, ReportFields
from tests.evaluation_report import keys

ROOT = Path(__file__).resolve().parents[2]
RUN = ROOT / "sample_runs" / "runs" / "004-harmonic-20mm-20mm-0.637Hz.h5"
GIVEN = Given(options=Options(draws=200), fields=ReportFields())


@dataclass(frozen=True)
class SignedReport:
    """A report beside its run."""

    run: Path
    plain: bytes
    signed: bytes
    key: keys.Made

    def put(self, folder: Path, data: bytes, *, with_run: bool = True) -> Path:
        """Write a report, and its run beside it."""
        folder.mkdir(parents=True, exist_ok=True)
        if with_run:
            shutil.copyfile(self.run, folder / self.run.name)
        (folder / "report.pdf").write_bytes(data)
        return folder / "report.pdf"


def sign(pdf: bytes, key: keys.Made) -> bytes:
    """Return a PDF signed with a key."""
    with open_key(str(key.p12), lambda: keys.PASSWORD) as opened:
        return signed(pdf, opened, reason="report")


def made(folder: Path) -> SignedReport:
    """Make the report below a folder."""
    key = keys.make(folder / "key")
    (pdf,) = write_report(RUN, folder, formats=("pdf",), given=GIVEN)
    plain = pdf.read_bytes()
    return SignedReport(RUN, plain, sign(plain, key), key)
