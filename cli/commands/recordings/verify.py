"""``bufferstand verify``: is what was recorded still what was recorded?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import EXISTING, FILE
from bufferstand.foundation import BadInput, ExitStatus, plain
from bufferstand.foundation.files import readable

if TYPE_CHECKING:
    from bufferstand.evaluation.report.verifying import Against
    from bufferstand.recording.runfile import ContentFault


@click.command("verify", epilog="Example:  bufferstand verify campaign/runs")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--trust",
    metavar="CERT.pem",
    type=FILE,
    help="Of a report: it must be signed with one of these certificates, or one that they issued.",
)
@click.option(
    "--runs",
    "runs_of_report",
    metavar="DIR",
    type=EXISTING,
    multiple=True,
    help="Of a report: where its run files are (default: beside it).",
)
@click.option(
    "--predecessor", metavar="OLD.pdf", type=FILE, help="Of an amended report: the one that it replaces."
)
@click.option(
    "--limits",
    metavar="FILE.toml",
    help="Of a report: the limit set that its runs were judged by, if it is no shipped one.",
)
def command(
    paths: tuple[Path, ...],
    trust: Path | None,
    runs_of_report: tuple[Path, ...],
    predecessor: Path | None,
    limits: str | None,
) -> int:
    """Check that run files and reports are whole and unaltered.

    PATH is a run file, a folder with run files, or the PDF of a report. Run files are checked by their
    checksums; journals that a crash left there, too: what of them can be recovered.

    Of a report: whether its signature is intact and of the whole file, and whose it is; whether the run files
    that it names are those it was made from; and whether they give the same figures when they are evaluated
    anew.

    Exit status 0 if all of it holds; 2 if a file is damaged, altered, or not what it says.
    """
    from bufferstand.evaluation.report.verifying import is_report
    from bufferstand.recording.finding import unsealed

    reports = [path for path in paths if is_report(path)]
    if not reports and (given := _given_for_reports(trust, runs_of_report, predecessor, limits)):
        raise BadInput("it is for a report, and none is named", file=given, remedy="name its PDF")
    others = [path for path in paths if path not in reports]
    journals = unsealed(others)
    damaged = sum(_told(journal, _of_journal(journal), good="whole") for journal in journals)
    runs = _runs_beside(others, journals) if others else []
    damaged += sum(_told(run, _of_run(run), good="whole and unaltered") for run in runs)
    if damaged:
        click.echo(f"bufferstand: {damaged} damaged or altered; do not evaluate them", err=True)
    unsound = 0
    if reports:
        against = _against(trust, runs_of_report, predecessor, limits)
        unsound = sum(_report_told(report, against) for report in reports)
        if unsound:
            click.echo(f"bufferstand: {unsound} report(s) not as they say; do not rely on them", err=True)
    return ExitStatus.BAD_INPUT if damaged or unsound else ExitStatus.DONE


def _given_for_reports(
    trust: Path | None, runs: Sequence[Path], predecessor: Path | None, limits: str | None
) -> str:
    """Return the first option that is given and only for reports."""
    given = {"--trust": trust, "--runs": runs, "--predecessor": predecessor, "--limits": limits}
    return next((name for name, value in given.items() if value), "")


def _against(
    trust: Path | None, runs: tuple[Path, ...], predecessor: Path | None, limits: str | None
) -> Against:
    from bufferstand.evaluation.report.verifying import Against
    from bufferstand.evaluation.requirements import find_limit_set

    return Against(
        trusted=trust,
        runs=runs or None,
        predecessor=predecessor,
        limit_set=None if limits is None else find_limit_set(limits),
        jobs=None,
    )


def _report_told(path: Path, against: Against) -> bool:
    """Say what was found of a report; return whether it must not be relied upon."""
    from bufferstand.evaluation.report.verifying import verify_report

    findings = verify_report(path, against)
    unsound = any(finding.level == "fault" for finding in findings)
    open_ = any(finding.level == "note" for finding in findings)
    good = "holds, as far as it could be checked" if open_ else "holds"
    click.echo(f"{readable(path)}: {'NOT AS IT SAYS' if unsound else good}")
    for finding in findings:
        click.echo(f"    {finding.level}: {plain(finding.place)}: {plain(finding.text)}")
    return unsound


def _runs_beside(paths: Sequence[Path], journals: Sequence[Path]) -> list[Path]:
    """Return the run files that paths stand for; a folder with nothing but journals is no error here."""
    from bufferstand.recording.finding import run_files

    files: list[Path] = []
    for path in paths:
        try:
            files += [] if path in journals else run_files([path])
        except BadInput:
            if not any(journal.is_relative_to(path) for journal in journals):
                raise
    return list(dict.fromkeys(files))


def _of_run(path: Path) -> list[ContentFault]:
    from bufferstand.recording.runfile import ContentFault
    from bufferstand.recording.sealing import verify

    try:
        return verify(path)
    except BadInput as error:
        return [ContentFault("fault", error.place or "file", error.problem)]


def _of_journal(path: Path) -> list[ContentFault]:
    from bufferstand.recording.runfile import ContentFault
    from bufferstand.recording.sealing import DAMAGED_SUFFIX, is_in_use, verify_journal

    if path.suffix == DAMAGED_SUFFIX:
        text = "records behind the damage were not recovered; what lies before it is in the run file"
        return [ContentFault("fault", "journal", text)]
    if is_in_use(path):
        return [ContentFault("note", "journal", "is being recorded, or sealed")]
    try:
        return verify_journal(path)
    except BadInput as error:
        return [ContentFault("fault", error.place or "journal", error.problem)]


def _told(path: Path, findings: Sequence[ContentFault], *, good: str) -> bool:
    """Say what was found of a file; return whether it is damaged."""
    damaged = any(finding.level == "fault" for finding in findings)
    click.echo(f"{path}: {'DAMAGED OR ALTERED' if damaged else good}")
    for finding in findings:
        click.echo(f"    {finding.level}: {finding.place}: {finding.text}")
    return damaged
