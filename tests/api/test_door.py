"""The door of the package: ``import bufferstand as bs``; its list, what it costs, and each of its uses."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bufferstand as bs
from bufferstand.evaluation.document import python_api as api

ROOT = Path(__file__).resolve().parents[2]
RUNS = ROOT / "sample_runs" / "runs"
PAGE = (ROOT / "docs" / "python-api.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_every_name_of_the_list_is_there_documented_and_on_the_page() -> None:
    assert bs.__all__ == sorted(bs.__all__)
    for name in bs.__all__:
        assert getattr(bs, name).__doc__, name
        assert name in dir(bs)
    functions = [name for name in bs.__all__ if name[0].islower()]
    assert sorted(re.findall(r"^\| `(\w+)\(", PAGE, re.MULTILINE)) == sorted(functions)


def test_types_see_the_same_names_from_the_same_modules() -> None:
    """What a type checker is told under TYPE_CHECKING is what a program gets."""
    tree = ast.parse((ROOT / "bufferstand" / "__init__.py").read_text(encoding="utf-8"))
    (told,) = [node for node in tree.body if isinstance(node, ast.If)]
    named = {
        alias.name: node.module
        for node in told.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(named) == bs.__all__
    for name, module in named.items():
        assert getattr(bs, name) is getattr(sys.modules[str(module)], name)


def test_all_of_the_tables_are_at_the_door() -> None:
    assert set(api.__all__) - set(bs.__all__) == {"Imported", "Run"}  # types of answers


def test_an_unknown_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="no attribute 'evaluat'"):
        bs.evaluat  # noqa: B018


@pytest.mark.slow
def test_the_import_loads_nothing_until_something_is_used() -> None:
    code = (
        "import sys, bufferstand as bs; before = set(sys.modules); "
        "print(sorted({'numpy', 'pandas', 'h5py', 'bufferstand.evaluation'} & before)); bs.runs; "
        "print('pandas' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split("\n")[:2] == ["[]", "True"]


def test_evaluations_are_compared(tmp_path: Path) -> None:
    run = RUNS / "004-harmonic-20mm-20mm-0.637Hz.h5"
    old, new = bs.evaluate(run, draws=0), bs.evaluate(run, draws=0)
    assert bs.compare(old, new).moves == ()
    new["runs"][0]["summary"]["damping"]["value"] += 0.01
    assert [move.quantity for move in bs.compare(old, new).moves] == ["damping"]
    with pytest.raises(bs.BadInput, match="no such file"):
        bs.compare(tmp_path / "none.json", new)


@pytest.mark.slow
def test_a_report_is_written(tmp_path: Path) -> None:
    (html, *_) = bs.write_report(RUNS / "004-harmonic-20mm-20mm-0.637Hz.h5", tmp_path / "report")
    assert "004-harmonic" in html.read_text(encoding="utf-8")
    with pytest.raises(bs.BadInput, match="no run was given"):
        bs.write_report([], tmp_path)


@pytest.mark.slow
def test_a_model_is_fitted_saved_read_and_simulated(tmp_path: Path) -> None:
    found = bs.fit_model([RUNS / "001-static-5mm_s.h5"])
    bs.save_model(found.model, tmp_path / "spring.toml")
    model = bs.load_model(str(tmp_path / "spring.toml"))
    assert model == found.model
    time_s = np.linspace(0.0, 20.0, 2001)
    done = bs.simulate(model, time_s, 25.0 * (1.0 - np.cos(0.2 * np.pi * time_s)), temperature_C=25.0)
    assert 0.0 < done.heat_J[-1] < done.work_J.max()


def test_a_campaign_is_planned_and_asks_for_the_specimen_before_it_moves_a_real_stand(tmp_path: Path) -> None:
    plan = bs.plan_campaign(ROOT / "sample_runs" / "demo.toml")
    assert len(plan.steps) > 5
    with pytest.raises(bs.BadInput, match="specimen's id") as refused:
        bs.run_campaign(ROOT / "sample_runs" / "demo.toml", tmp_path / "out")
    assert "yes_move" in str(refused.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_campaign_is_run_on_a_simulated_stand(tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    folder.mkdir()
    for name in ("stand.toml", "specimens", "models"):
        (folder / name).symlink_to(ROOT / "sample_runs" / name)
    text = (ROOT / "sample_runs" / "demo.toml").read_text(encoding="utf-8")
    head = text[: text.index("[[step]]")]
    (folder / "one.toml").write_text(
        head + '[[step]]\nkind = "sweep"\nname = "one"\nprestress_mm = [20.0]\namplitude_mm = [10.0]\n'
        "frequency_Hz = [1.0]\ncycles = 4\n",
        encoding="utf-8",
    )
    outcome = bs.run_campaign(folder / "one.toml", tmp_path / "out", simulate=True, speed=5.0)
    assert outcome.status == "complete"
    assert list(bs.runs(tmp_path / "out" / "runs")["status"]) == ["complete"]
    with pytest.raises(bs.BadInput, match="holds a campaign already"):
        bs.run_campaign(folder / "one.toml", tmp_path / "out", simulate=True)
