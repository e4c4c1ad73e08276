"""``model twin``, ``model specimens`` and ``run --twin``: what they say, and what they refuse."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bufferstand.model.file import load_model, save_model
from bufferstand.model.fit_uncertainty import FitUncertainty, knot_name
from tests.cli.processes import bufferstand
from tests.model.cases import spring
from tests.model.twin.specimens import drawn_spring, known_model

SAMPLES = Path(__file__).parents[2] / "sample_runs"


def known_sample(folder: Path, factor: float = 1.0) -> Path:
    """The model of the sample runs, ``factor`` times as strong, with what a fit of them knows."""
    model = load_model(SAMPLES / "models" / "category-a-elastomer.toml")
    names = [knot_name("loading_kN", x) for x in model.curves.stroke_mm]
    deviation = [0.002 * force for force in model.curves.loading_kN]
    fit = FitUncertainty.of(tuple(names), np.diag(np.square(deviation)), 2000.0, (18, 0.5, 0.001))
    save_model(replace(model, curves=model.curves.scaled(factor), fit=fit), folder / "m.toml")
    return folder / "m.toml"
