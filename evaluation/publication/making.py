"""From a campaign's folder to a crate: runs that are whole, evaluated and reported as they are published."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bufferstand.evaluation.archive import (
    EvaluationSettings,
    LocalWorkers,
    document,
    evaluate_archive,
    software,
)
from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.publication.crate import check_library, write_crate
from bufferstand.evaluation.publication.entities import PublishedRun
from bufferstand.evaluation.publication.fields import Publication, read_publication
from bufferstand.evaluation.publication.packing import check_crate_output, staged
from bufferstand.evaluation.report import Given, formats_here, write_report
from bufferstand.evaluation.report.source import ReportFields, read_fields
from bufferstand.evaluation.requirements import LimitSet, shipped_limit_set
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import write_text
from bufferstand.recording.finding import run_files, unsealed
from bufferstand.recording.runfile import read_metadata
from bufferstand.recording.sealing import DAMAGED_SUFFIX, verify
from bufferstand.recording.withholding import copy_without_machine

REPORT_FIELDS = "report.toml"
EVALUATION_NAME = "evaluation.json"


@dataclass(frozen=True)
class Judging:
    """How the runs are evaluated and judged, as for a report."""

    options: Options = field(default_factory=Options)
    limit_set: LimitSet = field(default_factory=shipped_limit_set)
    conformity: tuple[str, ...] = ()
    jobs: int | None = 1
    """Processes that evaluate; None: one a core, spawned."""


@dataclass(frozen=True)
class Published:
    """What was published.

    Attributes
    ----------
    runs : int
        Number of runs.
    withheld : tuple of str
        Keys of the run files that were left out, in one run at least.
    names : tuple of str
        Names of operators and customers that the run files state, and that are published.
    remarks : tuple of str
        What the user should know: keys that a repository would like to have, journals that were left out.
    """

    runs: int
    withheld: tuple[str, ...]
    names: tuple[str, ...]
    remarks: tuple[str, ...]


def publish(
    folder: Path,
    out: Path,
    *,
    fields: Path | None = None,
    judging: Judging | None = None,
    as_recorded: bool = False,
) -> Published:
    """Make an RO-Crate of a campaign.

    Parameters
    ----------
    folder : Path
        The campaign's folder, with ``publication.toml`` and, for the report, ``report.toml``.
    out : Path
        A ``.zip`` file, or a new folder.
    fields : Path, optional
        Another file than ``publication.toml``.
    judging : Judging, optional
        How the runs are evaluated.
    as_recorded : bool
        Whether run files are published byte by byte, with what they say of the machine.

    Returns
    -------
    Published

    Raises
    ------
    BadInput
        If the library is missing; something is missing in ``publication.toml``; there are no runs, one is
        damaged, altered, not sealed or cannot be evaluated; or the crate cannot be written.

    Notes
    -----
    The same folder, software and libraries give the same bytes.
    """
    check_library()
    judging = judging or Judging()
    check_crate_output(out, folder)
    publication = read_publication(folder, fields)
    files, remarks = _whole_runs(folder)
    report_fields = (
        read_fields(folder / REPORT_FIELDS) if (folder / REPORT_FIELDS).exists() else ReportFields()
    )
    if report_fields.number_register:
        # A copy for others is no further report of the laboratory: it takes no number of its range.
        report_fields = report_fields.model_copy(update={"number": "", "number_register": ""})
        remarks.append(_NO_NUMBER)
    with staged(out, _name_of(files)) as crate:
        withheld, runs = _copied(folder, files, crate, as_recorded=as_recorded)
        evaluated = _evaluated(crate, runs, judging)
        write_text(crate / EVALUATION_NAME, json.dumps(evaluated, indent=1, ensure_ascii=False) + "\n")
        given = Given(
            options=judging.options,
            limit_set=judging.limit_set,
            fields=report_fields,
            conformity=judging.conformity,
        )
        report = write_report(
            crate, crate / "report", formats=formats_here(), document=evaluated, given=given
        )
        write_crate(crate, publication, runs, crate / EVALUATION_NAME, report, software().version)
    return Published(len(runs), withheld, _names(runs), (*_wishes(publication), *remarks))


_NO_NUMBER = (
    "the report in the crate has no number of the range: it is of copies, and not the one that was issued"
)


def _whole_runs(folder: Path) -> tuple[list[Path], list[str]]:
    """Return the run files of a campaign that is at rest, and what was left out.

    Raises
    ------
    BadInput
        If ``verify`` refuses a run, or one is recorded or waits to be sealed.
    """
    if not folder.is_dir():
        raise BadInput("is no folder of a campaign", file=folder, remedy="name the folder that run made")
    remarks = []
    for journal in unsealed([folder]):
        if journal.suffix != DAMAGED_SUFFIX:
            raise BadInput(
                "a run that is not sealed yet",
                file=journal,
                remedy="wait for its end, or let “bufferstand resume” seal it",
            )
        remarks.append(f"{journal.name} is left out: what of it could be recovered is in its run file")
    files = run_files([folder])
    for file in files:
        for fault in verify(file):
            if fault.level == "fault":
                raise BadInput(
                    f"damaged or altered: {fault.text}",
                    file=file,
                    place=fault.place,
                    remedy="restore it from a copy, or put it elsewhere; it is not published so",
                )
    return files, remarks


def _name_of(files: Sequence[Path]) -> str:
    """Return the id of the campaign, if the runs are of one: the report is called so."""
    campaigns = {str((read_metadata(file).get("run") or {}).get("campaign") or "") for file in files}
    (name,) = campaigns if len(campaigns) == 1 else ("",)
    return name if name and all(letter.isalnum() or letter in "._-" for letter in name) else "campaign"


def _copied(
    folder: Path, files: Sequence[Path], crate: Path, *, as_recorded: bool
) -> tuple[tuple[str, ...], list[PublishedRun]]:
    """Copy the runs to the places that they have in their folder; return what was left out, and the runs."""
    withheld: set[str] = set()
    runs = []
    for file in files:
        place = file.relative_to(folder).as_posix()
        if not place.isprintable() or any("\ud800" <= letter <= "\udfff" for letter in place):
            raise BadInput("others could not read this name", file=file, remedy="give it another name")
        copy = crate / place
        copy.parent.mkdir(parents=True, exist_ok=True)
        if as_recorded:
            shutil.copyfile(file, copy)
        else:
            withheld.update(copy_without_machine(file, copy))
        runs.append(PublishedRun(place, read_metadata(copy)))
    return tuple(sorted(withheld)), runs


def _evaluated(crate: Path, runs: Sequence[PublishedRun], judging: Judging) -> dict[str, Any]:
    """Return the evaluation document of the published files, which it names by their places in the crate.

    Raises
    ------
    BadInput
        If one cannot be evaluated.
    """
    evaluation = evaluate_archive(
        [crate / run.place for run in runs],
        EvaluationSettings(judging.options, judging.limit_set),
        LocalWorkers(judging.jobs),
        conformity=judging.conformity,
    )
    for failure in evaluation.failures:
        raise BadInput(failure.problem, file=failure.path.replace(f"{crate}/", ""))
    found: dict[str, Any] = _replaced(document(evaluation), f"{crate}/", "")
    return found


def _replaced(value: Any, old: str, new: str) -> Any:
    """Return what JSON holds with another text in all its texts."""
    if isinstance(value, str):
        return value.replace(old, new)
    if isinstance(value, Mapping):
        return {key: _replaced(inner, old, new) for key, inner in value.items()}
    if isinstance(value, list):
        return [_replaced(inner, old, new) for inner in value]
    return value


def _names(runs: Sequence[PublishedRun]) -> tuple[str, ...]:
    stated = {
        f"{key} “{facts[key]}”"
        for run in runs
        for table, key in (("run", "operator"), ("campaign", "customer"), ("specimen", "customer"))
        if isinstance(facts := run.document.get(table), Mapping) and facts.get(key)
    }
    return tuple(sorted(stated))


def _wishes(publication: Publication) -> list[str]:
    return [f"publication.toml has no {key}, which repositories ask for" for key in publication.wanting()]
