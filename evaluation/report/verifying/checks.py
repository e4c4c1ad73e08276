"""Everything that is checked of a report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bufferstand.evaluation.report.report_file import ReportFile, read_pdf, read_report
from bufferstand.evaluation.report.verifying.against_runs import run_findings
from bufferstand.evaluation.report.verifying.findings import Finding, fault, holds, note
from bufferstand.evaluation.report.verifying.signatures import read_certificates, signature_findings
from bufferstand.evaluation.requirements import LimitSet
from bufferstand.foundation import BadInput


@dataclass(frozen=True)
class Against:
    """What a report is checked against.

    Attributes
    ----------
    trusted : Path or None
        Certificates of signers or issuers that are trusted; None: the report may be signed by anybody.
    runs : tuple of Path or None
        Where its run files are; None: beside it.
    predecessor : Path or None
        The report that it replaces.
    limit_set : LimitSet or None
        What its runs were judged by, where it is no shipped set.
    jobs : int or None
        Processes that evaluate the runs anew; None: one a core.
    """

    trusted: Path | None = None
    runs: tuple[Path, ...] | None = None
    predecessor: Path | None = None
    limit_set: LimitSet | None = None
    jobs: int | None = 1


def verify_report(path: Path, against: Against) -> list[Finding]:
    """Check a report: its signature, the files inside, the runs that it names, the report that it replaces.

    Parameters
    ----------
    path : Path
        A PDF.
    against : Against

    Returns
    -------
    list of Finding

    Raises
    ------
    BadInput
        If the extra ``sign`` is missing, or what it is checked against cannot be read.
    """
    trusted = () if against.trusted is None else read_certificates(against.trusted)
    try:
        data, reader = read_pdf(path)
    except BadInput as error:
        if not path.is_file() or "pyHanko" in error.problem:
            raise
        return [fault(error.place or "file", error.problem)]
    findings = list(signature_findings(data, reader, trusted))
    try:
        report = read_report(path)
    except BadInput as error:
        return [*findings, fault(error.place or "files inside", error.problem)]
    findings += _of_proof(report)
    findings += _of_predecessor(report, against.predecessor)
    findings += run_findings(report, against.runs, against.limit_set, against.jobs)
    return findings


def _of_proof(report: ReportFile) -> Iterator[Finding]:
    proof = report.proof
    names = ", ".join([*report.evaluations, *(one.file for one in proof.attached)])
    yield holds("files inside", f"{names}: with the SHA-256 that the report states")
    if proof.draft:
        yield note("report", f"{proof.report} is a draft")


def _of_predecessor(report: ReportFile, path: Path | None) -> Iterator[Finding]:
    """Compare the report that this one replaces with what it says of it."""
    place, amended = "predecessor", report.proof.amends
    if amended is None:
        if path is not None:
            yield fault(place, f"{path} is given, and this report replaces none")
        return
    if path is None:
        yield note(place, f"replaces report {amended.report}: give --predecessor OLD.pdf to compare it")
        return
    old = read_report(path)
    if old.proof.report != amended.report:
        yield fault(place, f"{path} is report {old.proof.report}; this one replaces {amended.report}")
    elif amended.sha256 is None:
        yield note(place, f"is named only by its id, {amended.report}: no hash of it is on record")
    elif old.sha256 != amended.sha256:
        yield fault(place, f"{path} is not the file that was replaced: its SHA-256 is another")
    else:
        yield holds(place, f"{path} is the report {amended.report} that this one replaces, by its SHA-256")
