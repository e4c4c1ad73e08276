"""Tables for Modelica and MBDyn: read back by readers of their documents, against the model's own curves."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bufferstand.model import load_model
from bufferstand.model.export import export_mbdyn, export_modelica
from bufferstand.model.export.losses import MULTIBODY
from tests.cli.processes import bufferstand
from tests.model.cases import parallel_curves, spring
from tests.model.recipes import FOLDER, category_a, draw_hook


def read_modelica(file: Path) -> dict[str, np.ndarray]:
    """Read by the rules of the format: first line of two characters, headers of one line, # for comments."""
    content = file.read_bytes()
    assert content.isascii()
    lines = content.decode().split("\n")
    assert lines[0] == "#1"
    words, tables = [line.partition("#")[0].split() for line in lines[1:]], {}
    rows = iter(row for row in words if row)
    for head in rows:
        name, n, m = re.fullmatch(r"double ([A-Za-z_]\w*)\((\d+),(\d+)\)", " ".join(head)).groups()
        table = np.array([[float(cell) for cell in next(rows)] for _ in range(int(n))])
        assert table.shape == (int(n), int(m))
        assert np.all(np.diff(table[:, 0]) > 0.0)
        tables[name] = table
    return tables


def read_mbdyn(file: Path) -> dict[str, np.ndarray]:
    """Read by the rules of the manual: cards end with ;, fields are parted by commas, # for comments."""
    text = "\n".join(line.partition("#")[0] for line in file.read_text(encoding="ascii").split("\n"))
    functions = {}
    for card in (part.strip() for part in text.split(";")):
        if not card:
            continue
        kind, _, rest = card.partition(":")
        name, law, *figures = (field.strip() for field in rest.split(","))
        assert (kind.strip(), law) == ("scalar function", "multilinear")
        points = np.array([float(figure) for figure in figures]).reshape(-1, 2)
        assert np.all(np.diff(points[:, 0]) > 0.0)
        functions[name.strip('"')] = points
    return functions


def extrapolated(x: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Linear between the points, and on with the slope of the nearest pair, as both programs do."""
    k = np.clip(np.searchsorted(points[:, 0], x) - 1, 0, len(points) - 2)
    (x_0, y_0), (x_1, y_1) = points[k].T, points[k + 1].T
    return y_0 + (x - x_0) * (y_1 - y_0) / (x_1 - x_0)


def wanted(model, stroke_mm: np.ndarray, temperature_C: float) -> tuple[np.ndarray, np.ndarray]:
    """Loading and unloading force [N] of the model at a temperature by eq. (5), straight from its curves."""
    law, tables = model.temperature, model.tables
    end = model.curves.end_mm
    x = np.clip(stroke_mm, 0.0, end)
    s = 1.0 - law.softening(temperature_C) * (1.0 - np.exp(-x / law.depth_mm))
    at = tables.cells_of(x)
    loading, width = tables.at(tables.loading, at), tables.at(tables.width, at)
    beyond = model.curves.stop_stiffness_kN_per_mm * np.maximum(stroke_mm - end, 0.0)
    pressed = stroke_mm > 0.0
    unloading = loading - model.width_scale(temperature_C) * width
    return tuple(1e3 * np.where(pressed, s * force + beyond, 0.0) for force in (loading, unloading))


MODELS = {"buffer": category_a(), "hook": draw_hook(), "straight": spring(parallel_curves())}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("temperature_C", [-12.5, 25.0, 60.0])
def test_what_is_read_back_is_the_model_from_before_contact_into_the_stop(tmp_path, name, temperature_C):
    model = MODELS[name]
    degrees = {-12.5: "minus12p5degC", 25.0: "25degC", 60.0: "60degC"}[temperature_C]
    modelica = read_modelica(export_modelica(model, tmp_path, name, (temperature_C,)))
    mbdyn = read_mbdyn(export_mbdyn(model, tmp_path, name, (temperature_C,)))
    end = model.curves.end_mm
    stroke = np.concatenate([[-30.0, -1.0, -0.2], np.linspace(0.05, end, 397), [end + 0.5, end + 20.0]])
    sign = 1.0 if model.sense == "extension" else -1.0
    table = modelica[f"curves_{degrees}"]
    forces = wanted(model, stroke, temperature_C)
    for column, (curve, force) in enumerate(zip(("loading", "unloading"), forces, strict=True), start=1):
        within = 2e-3 * force.max()  # straight pieces of 1 mm
        read = extrapolated(1e-3 * stroke, table[:, [0, column]])
        np.testing.assert_allclose(read, force, atol=within)
        points = mbdyn[f"{name}_{curve}_{degrees}"]
        np.testing.assert_allclose(sign * extrapolated(sign * 1e-3 * stroke, points), read, atol=1e-3)
    assert table[-1, 0] == pytest.approx(1e-3 * (end + 1.0))


def test_without_a_choice_they_are_at_the_models_own_temperatures(tmp_path):
    model = draw_hook()
    assert set(read_modelica(export_modelica(model, tmp_path, "h"))) == {"curves_25degC", "curves_75degC"}
    names = set(read_mbdyn(export_mbdyn(model, tmp_path, "my hook-2")))
    assert names == {f"my_hook_2_{c}_{t}degC" for c in ("loading", "unloading") for t in (25, 75)}


def test_each_file_says_what_it_loses_and_where_the_model_was_identified(tmp_path):
    model = category_a()
    for write in (export_modelica, export_mbdyn):
        text = write(model, tmp_path / "new", "b").read_text(encoding="ascii")
        for sentence in MULTIBODY:
            assert f"# Lost: {sentence}" in text
    page = (Path(__file__).parents[2] / "docs/model-export.md").read_text(encoding="utf-8")
    for sentence in MULTIBODY:
        assert f"- {sentence}" in page


def test_the_command_writes_both(tmp_path):
    file = FOLDER / "draw-hook-elastomer.toml"
    done = bufferstand(
        "model", "export", file, "--modelica", tmp_path, "--mbdyn", tmp_path, "--temperature", "40"
    )
    assert done.returncode == 0, done.stderr
    names = [Path(line).name for line in done.stdout.split()]
    assert names == ["draw-hook-elastomer-modelica.txt", "draw-hook-elastomer-mbdyn.mbd"]
    table = read_modelica(tmp_path / names[0])["curves_40degC"]
    force = wanted(load_model(file), np.array([42.5]), 40.0)[0]
    assert extrapolated(np.array([0.0425]), table[:, :2]) == pytest.approx(force, rel=2e-3)
