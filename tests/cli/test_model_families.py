"""``bufferstand model families`` and ``model fit --json`` on recorded samples."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.model.families import command as families
from bufferstand.cli.commands.model.fit import command as fit
from bufferstand.foundation.errors import BadInput

RUNS = Path(__file__).parents[2] / "sample_runs" / "runs"
SOME = [str(RUNS / f"{name}.h5") for name in ("001-static-5mm_s", "005-harmonic-20mm-20mm-1.27Hz")]


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    file = tmp_path_factory.mktemp("families") / "families.json"
    outcome = CliRunner().invoke(
        families, [*SOME, "--knots", "8", "--json", str(file)], standalone_mode=False
    )
    assert outcome.exception is None, outcome.output
    return outcome.output, json.loads(file.read_text(encoding="utf-8"))


def test_every_family_is_ranked(compared):
    _, document = compared
    assert document["schema"] == "bufferstand/model-families/1"
    ranked = document["families"]
    assert len(ranked) == 8
    over = [one["bic_over_least"] for one in ranked]
    assert over[0] == 0.0
    assert over == sorted(over)
    likely = {one["family"] for one in ranked if one["bic_over_least"] < 10.0}
    assert likely <= {"ours", "ours-spectrum", "ours-return-points"}  # the simulated specimen is of the first
    assert "ours" in likely
    for one in ranked:
        for parameter in one["parameters"]:
            low, high = parameter["interval_95"]
            assert low <= parameter["value"] <= high


def test_what_the_runs_leave_open_is_said_with_the_run_that_would_tell(compared):
    output, document = compared
    left = [one for one in document["families"] if one["not_told_from_the_first"]]
    assert left  # one frequency cannot tell a spectrum from none
    assert output.count("These runs cannot tell") == len(left)
    for one in left:
        assert one["telling_run"]["standard_deviations"] >= 0.0
        assert 0.02 <= one["telling_run"]["frequency_Hz"] <= 2.5


def test_runs_that_are_none_are_refused(tmp_path: Path):
    outcome = CliRunner().invoke(families, [str(tmp_path)], standalone_mode=False)
    assert isinstance(outcome.exception, BadInput)
    assert "no run files" in str(outcome.exception)


def test_a_fit_as_json_has_null_for_what_the_runs_do_not_tell(tmp_path: Path):
    given = ["--out", str(tmp_path / "m.toml"), "--knots", "8", "--no-validation", "--json", "-"]
    outcome = CliRunner().invoke(fit, [SOME[0], *given], standalone_mode=False)
    assert outcome.exception is None, outcome.output
    document = json.loads(outcome.stdout)
    assert document["schema"] == "bufferstand/model-fit/1"
    by_name = {one["name"]: one for one in document["parameters"]}
    for name in ("transition_length_mm", "sensitivity_per_K", "beta", "spectrum_per_decade"):
        assert by_name[name]["interval_95"] is None
        assert by_name[name]["why"]
    assert all(one["interval_95"][0] <= one["value"] <= one["interval_95"][1] for one in document["curves"])
