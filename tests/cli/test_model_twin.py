"""``model twin`` and ``model specimens``: what they say of runs and of models, and what they refuse."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.model.specimens import command as specimens
from bufferstand.cli.commands.model.twin import command as twin
from bufferstand.foundation.errors import BadInput
from bufferstand.model.file import load_model, save_model
from bufferstand.model.fit_uncertainty import FitUncertainty, knot_name
from tests.model.cases import spring
from tests.model.twin.specimens import drawn_spring, known_model

SAMPLES = Path(__file__).parents[2] / "sample_runs"
STATIC = SAMPLES / "runs" / "001-static-5mm_s.h5"


def known_sample(folder: Path, factor: float) -> Path:
    """The model of the sample runs, ``factor`` times as strong, with what a fit of them knows."""
    model = load_model(SAMPLES / "models" / "category-a-elastomer.toml")
    names = [knot_name("loading_kN", x) for x in model.curves.stroke_mm[:40:4]]
    known = np.diag([*[0.04] * len(names), 1e-4])
    names.append("ln capacity_J_per_K")
    fit = FitUncertainty.of(tuple(names), known, 2000.0, (18, 0.5, 0.001))
    path = folder / f"{factor:g}.toml"
    save_model(replace(model, curves=model.curves.scaled(factor), fit=fit), path)
    return path


def said(command, *words) -> str:
    done = CliRunner().invoke(command, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.mark.slow
def test_a_run_of_the_model_s_own_spring_is_quiet_and_one_of_another_is_not(tmp_path):
    report = tmp_path / "twin.json"
    assert "no run of cycles lies outside" in said(
        twin, known_sample(tmp_path, 1.0), STATIC, "--json", report
    )
    quiet = json.loads(report.read_text(encoding="utf-8"))
    assert (quiet["schema"], len(quiet["cycles"]), quiet["alarms"]) == ("bufferstand/model-twin/1", 3, [])
    softer = json.loads(said(twin, known_sample(tmp_path, 0.93), STATIC, "--json", "-"))
    (alarm,) = softer["alarms"]
    assert alarm["moved"][0]["name"] == "stiffness"
    assert alarm["moved"][0]["value"] == pytest.approx(1.0 / 0.93 - 1.0, abs=0.01)
    assert "lie outside the model's band: stiffness +7" in alarm["sentence"]


def test_a_model_without_its_uncertainty_is_refused_with_its_file(tmp_path):
    path = tmp_path / "plain.toml"
    save_model(spring(), path)
    for command, words in ((twin, (path, STATIC)), (specimens, (path, path, path))):
        with pytest.raises(BadInput) as caught:
            said(command, *words)
        assert str(caught.value).startswith(str(path))
        assert "model fit" in str(caught.value)


def test_two_models_are_no_family(tmp_path):
    path = tmp_path / "m.toml"
    save_model(known_model(), path)
    with pytest.raises(BadInput, match=r"MODEL\.toml"):
        said(specimens, path, path)
    with pytest.raises(BadInput, match="--used"):
        said(specimens, path, path, path, "--used", path)


@pytest.mark.slow
def test_specimens_are_shown_and_written(tmp_path):
    random, files = np.random.default_rng(5), []
    for number in range(6):
        files.append(tmp_path / f"{number}.toml")
        model = drawn_spring(random)
        save_model(replace(model, curves=model.curves.scaled(1.0 if number < 3 else 0.9)), files[-1])
    report = tmp_path / "s.json"
    used = [word for file in files[3:] for word in ("--used", file)]
    shown = said(specimens, *files[:3], *used, "--json", report)
    assert "told apart" in shown
    written = json.loads(report.read_text(encoding="utf-8"))
    figures = {one["name"]: one for one in written["figures"]}
    assert figures["loading at 96 mm"]["difference"]["distinguished"]
    assert figures["beta"]["group"]["specimens"] == 3
