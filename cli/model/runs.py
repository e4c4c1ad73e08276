"""Recorded runs as the spring model's identification takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from bufferstand.cli.options import warn
from bufferstand.evaluation.facts import RunFacts
from bufferstand.evaluation.figures.model_comparison import AT_CONTACT_MM, KINDS, drive_of
from bufferstand.evaluation.loading import load_run
from bufferstand.evaluation.record import Record
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from bufferstand.model.identification import Drive, FitSettings, join
from bufferstand.recording.finding import list_runs

LONGEST_GAP_S = 3600.0
"""Runs further apart are not taken to follow each other."""


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """A run and its drive; the drive's clock is that of the run."""

    path: Path
    record: Record
    facts: RunFacts
    drive: Drive


def find_runs(paths: Sequence[Path]) -> list[Path]:
    """Return the run files among paths and in folders, each once, in order.

    Raises
    ------
    BadInput
        If there is none, or one cannot be read.
    """
    found: dict[Path, None] = {}
    for path in paths:
        for run in list_runs(path):
            if run.problem is not None:
                raise BadInput(run.problem, file=run.path, remedy="leave this file out")
            found[run.path] = None
    if not found:
        raise BadInput("there are no runs here", file=paths[0], remedy="give run files or a folder of them")
    return list(found)


def read_run(path: Path, ambient_C: float | None = None) -> MeasuredRun:
    """Read a run and reduce it.

    Parameters
    ----------
    path : Path
    ambient_C : float, optional
        Temperature of the air; that of the run's own sensor if not given.

    Raises
    ------
    BadInput
        If it has no usable samples.
    """
    record, facts = load_run(path)
    try:
        drive = drive_of(record, path.stem, ambient_C)
    except BadInput as error:
        raise BadInput(error.problem, file=path, remedy="leave this run out") from None
    return MeasuredRun(path, record, facts, drive)


def read_runs(paths: Sequence[Path], ambient_C: float | None = None) -> list[MeasuredRun]:
    """Read every static and harmonic run among paths; say on standard error which are left out."""
    runs = []
    for path in find_runs(paths):
        run = read_run(path, ambient_C)
        if run.facts.kind not in KINDS:
            warn(f"{path.name}: left out, a run of kind “{run.facts.kind}” does not show the spring alone")
        elif float(np.max(run.drive.stroke_mm)) < AT_CONTACT_MM:
            warn(f"{path.name}: left out, nothing was compressed")
        else:
            runs.append(run)
    if not runs:
        raise BadInput("no static or harmonic run is left", file=paths[0])
    _same_specimen(runs)
    return runs


def _same_specimen(runs: Sequence[MeasuredRun]) -> None:
    names = sorted({str(run.facts.specimen.get("id")) for run in runs})
    if len(names) > 1:
        raise BadInput(
            f"these runs are of different specimens: {', '.join(names)}",
            remedy="a model is identified from the runs of one specimen",
        )


def settings_of(runs: Sequence[MeasuredRun], name: str | None = None) -> FitSettings:
    """Return the settings of an identification from these runs: name, sense and origin of the model."""
    specimen = runs[0].facts.specimen
    return FitSettings(
        name=name or str(specimen.get("id") or "identified spring"),
        sense="extension" if specimen.get("kind") == "draw-gear" else "compression",
        origin=f"Identified from {len(runs)} runs: {', '.join(run.path.stem for run in runs)}.",
    )


def beyond_the_runs(
    settings: FitSettings, runs: Sequence[MeasuredRun], specimen_file: Path | None
) -> FitSettings:
    """Return settings with what is known of the specimen beyond its runs: full stroke, the maker's curve.

    Parameters
    ----------
    settings : FitSettings
    runs : sequence of MeasuredRun
        Their own specimen's ``max_stroke_mm`` is the full stroke.
    specimen_file : Path, optional
        Has the points of a catalogue, and the full stroke of runs that do not state it.

    Raises
    ------
    BadInput
        If the runs contradict each other or the file, the file cannot be read, or it is of another specimen.
    """
    strokes = {float(s) for run in runs if (s := run.facts.specimen.get("max_stroke_mm")) is not None}
    if specimen_file is not None:
        content = load_specimen(specimen_file)
        known = runs[0].facts.specimen.get("id")
        if known is not None and content.specimen.id != known:
            raise BadInput(
                f"is of the specimen {content.specimen.id}, the runs are of {known}",
                file=specimen_file,
                place="specimen.id",
                remedy="give the file of the specimen that was tested",
            )
        if content.specimen.max_stroke_mm is not None:
            strokes.add(content.specimen.max_stroke_mm)
        if content.catalogue is not None:
            settings = replace(
                settings,
                catalogue_points=content.catalogue.points,
                catalogue_margin=content.catalogue.force_margin,
            )
    if len(strokes) > 1:
        raise BadInput(
            f"the specimen's full stroke is stated as {' and '.join(f'{s:g}' for s in sorted(strokes))} mm",
            file=specimen_file or runs[0].path,
            place="specimen.max_stroke_mm",
            remedy="leave out what states it wrongly",
        )
    return replace(settings, full_stroke_mm=min(strokes, default=None))


def sittings(runs: Sequence[MeasuredRun], *, chain: bool = False) -> list[Drive]:
    """Return the drives of runs, each by itself, or with ``chain`` those that follow each other as one.

    Runs follow each other if they are dated, no more than an hour apart, and begin and end at contact. Then
    the cooling between them counts, too; nothing that is not recorded may have warmed the spring.
    """
    dated = sorted((run for run in runs if run.facts.started is not None), key=_started)
    groups: list[list[MeasuredRun]] = [[run] for run in runs if run.facts.started is None]
    for run in dated:
        if chain and groups and groups[-1][-1].facts.started is not None and _follows(groups[-1][-1], run):
            groups[-1].append(run)
        else:
            groups.append([run])
    return [join([_shifted(run, group[0]) for run in group]) for group in groups]


def _started(run: MeasuredRun) -> datetime:
    assert run.facts.started is not None
    return run.facts.started


def _follows(before: MeasuredRun, after: MeasuredRun) -> bool:
    gap = (_started(after) - _started(before)).total_seconds() - float(before.drive.time_s[-1])
    at_contact = (
        abs(before.drive.stroke_mm[-1]) < AT_CONTACT_MM and abs(after.drive.stroke_mm[0]) < AT_CONTACT_MM
    )
    return bool(at_contact and 0.0 < gap + float(after.drive.time_s[0]) <= LONGEST_GAP_S)


def _shifted(run: MeasuredRun, first: MeasuredRun) -> Drive:
    if run is first:
        return run.drive
    shift = (_started(run) - _started(first)).total_seconds()
    return replace(
        run.drive,
        time_s=run.drive.time_s + shift,
        sensor_s=run.drive.sensor_s + shift,
        runs=tuple((begin + shift, name) for begin, name in run.drive.runs),
    )
