"""What a given spring model answers to the runs of a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bufferstand.evaluation.figures.model_comparison import RunCheck
from bufferstand.model import SpringModel


@dataclass(frozen=True, eq=False)
class ModelAnswer:
    """A spring model and its answer to each run, by the run's number."""

    file: str
    sha256: str
    model: SpringModel
    checks: Mapping[int, RunCheck]
    left_out: Mapping[int, str]
