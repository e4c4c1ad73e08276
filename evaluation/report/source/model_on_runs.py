"""A given spring model, applied to the runs of a report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bufferstand.evaluation.figures.model_comparison import (
    AT_CONTACT_MM,
    KINDS,
    answer_to,
    check_run,
    drive_of,
)
from bufferstand.evaluation.report.source.model_answer import ModelAnswer
from bufferstand.evaluation.report.source.source import ReportRun
from bufferstand.evaluation.wording import kind_words, said
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import file_hash
from bufferstand.model import load_model


def apply_model(path: Path, runs: Sequence[ReportRun]) -> ModelAnswer:
    """Let the model of a file answer to every run that shows the spring alone.

    Raises
    ------
    BadInput
        If the file cannot be read, or no run is one to compare with.
    """
    model = load_model(path)
    checks, left_out = {}, {}
    for run in runs:
        if run.kind not in KINDS or run.record is None:
            left_out[run.number] = run.problem or said(
                "a run of kind “{kind}” does not show the spring alone", kind=kind_words(run.kind)
            )
            continue
        try:
            drive = drive_of(run.record, run.id)
        except BadInput as error:
            left_out[run.number] = error.problem
            continue
        if float(np.max(drive.stroke_mm)) < AT_CONTACT_MM:
            left_out[run.number] = said("nothing was compressed")
            continue
        checks[run.number] = check_run(drive, answer_to(model, drive))
    if not checks:
        raise BadInput(
            "no static or harmonic run to compare the model with", file=path, remedy="leave --model out"
        )
    return ModelAnswer(path.name, file_hash(path), model, checks, left_out)
