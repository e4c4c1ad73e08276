"""``bufferstand validate``: the record says what was found, and a wrong installation is told as one."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pypdfium2
import pytest
from click.testing import CliRunner

from bufferstand.cli.commands.recordings.validate import command
from bufferstand.evaluation.validation.evaluate_sets import evaluate_set, judge_results
from bufferstand.evaluation.validation.standard_sets import shipped_sets
from bufferstand.evaluation.validation.validation_record import Validation, load_validation, validate
from bufferstand.foundation.errors import BadInput

SETS = {one.id: one for one in shipped_sets()}
MOMENT = datetime(2026, 3, 5, 14, 2, 11, tzinfo=UTC)


@pytest.fixture
def elastic(tmp_path: Path) -> Path:
    shutil.copytree(SETS["closed-form/elastic"].folder, tmp_path / "sets" / "elastic")
    return tmp_path / "sets"


def with_truth(folder: Path, **change: Any) -> None:
    path = folder / "elastic" / "truth.json"
    truth = json.loads(path.read_text(encoding="utf-8"))
    truth["agreed"][2] |= change
    path.write_text(json.dumps(truth), encoding="utf-8")


def run(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(command, [str(argument) for argument in arguments], standalone_mode=False)
    if done.exception is not None:
        raise done.exception
    return int(done.return_value), done.stdout, done.stderr


def test_the_record_holds_every_value_with_versions_and_hashes(elastic: Path, tmp_path: Path) -> None:
    status, out, _ = run("--out", tmp_path / "made", "--sets", elastic, "--by", "J. Novák")
    assert status == 0
    assert "3 of 3 agreed values found in 1 sets" in out
    record = load_validation(tmp_path / "made" / "validation.json")
    assert record["good"] is True
    assert record["by"] == "J. Novák"
    assert datetime.fromisoformat(record["made"]).tzinfo is not None
    assert len(record["software"]["code_sha256"]) == 64
    (entry,) = record["sets"]
    assert set(entry["files_sha256"]) == {"record.csv", "record.toml", "truth.json"}
    stored = entry["checks"][2]
    assert stored["agreed"] == pytest.approx(2700.0)
    assert stored["found"] == pytest.approx(2700.0, rel=1e-5)
    assert abs(stored["deviation"]) <= stored["tolerance"]
    pdf = pypdfium2.PdfDocument((tmp_path / "made" / "validation.pdf").read_bytes())
    text = "".join(page.get_textpage().get_text_range().replace("\u200b", "") for page in pdf)
    text = text.replace("\u00a0", " ")  # which keeps the symbol of a verdict beside its word
    for words in (
        "Validation record",
        "J. Novák",
        "as agreed",
        "stored energy",
        "2700 J",
        record["sha256"][:20],
    ):
        assert words in text, words


def test_a_value_that_is_not_as_agreed_ends_with_2_and_is_named(elastic: Path, tmp_path: Path) -> None:
    with_truth(elastic, value=2701.0)
    status, out, error = run("--out", tmp_path, "--sets", elastic)
    assert status == 2
    assert "2 of 3 agreed values" in out
    assert "summary: stored_energy_J: agreed 2701 ± 0.027 J, found 2700" in error
    record = load_validation(tmp_path / "validation.json")
    assert record["good"] is False
    assert record["values_missed"] == 1


def test_what_is_missing_is_not_as_agreed(elastic: Path) -> None:
    with_truth(elastic, what="no_such_figure_J")
    from bufferstand.evaluation.validation.standard_sets import load_sets

    result = evaluate_set(load_sets(elastic)[0])
    assert [check.found for check in result.missed] == [None]
    assert not result.good


def test_a_record_that_is_refused_is_a_result(elastic: Path) -> None:
    from bufferstand.evaluation.validation.standard_sets import load_sets

    (elastic / "elastic" / "record.csv").write_text("nothing,of,use\n1,2,3\n", encoding="utf-8")
    result = evaluate_set(load_sets(elastic)[0])
    assert result.problem.startswith("refused: ")
    assert len(result.missed) == len(result.checks) == 3


def test_the_record_cannot_be_altered_unseen(elastic: Path, tmp_path: Path) -> None:
    run("--out", tmp_path, "--sets", elastic)
    path = tmp_path / "validation.json"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"good": true', '"good": false', 1), encoding="utf-8")
    with pytest.raises(BadInput, match="altered"):
        load_validation(path)
    path.write_text("[]", encoding="utf-8")
    with pytest.raises(BadInput, match="a JSON object is expected here"):
        load_validation(path)


def test_another_program_is_judged_by_what_it_offers(tmp_path: Path) -> None:
    ours = {
        "closed-form/ellipse-100": {"summary": {"damping": 0.18844, "stored_energy_J": {"value": 3000.0}}}
    }
    result = judge_results(SETS["closed-form/ellipse-100"], ours)
    assert result is not None
    assert {check.agreed.what: check.good for check in result.checks} == {
        "damping": True,
        "stored_energy_J": False,
    }
    assert judge_results(SETS["closed-form/elastic"], ours) is None
    file = tmp_path / "plain.json"
    file.write_text(json.dumps(ours), encoding="utf-8")
    status, out, _ = run("--out", tmp_path, "--results", file)
    assert status == 2
    assert "1 of 2 agreed values found in 1 sets" in out
    assert load_validation(tmp_path / "validation.json")["other_program"] is True


@pytest.mark.parametrize("text", ["{}", "[1]", "{", '{"closed-form/elastic": 3}'])
def test_results_that_are_none_are_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "other.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput):
        run("--out", tmp_path, "--results", file)


@pytest.mark.parametrize("identity", list(SETS))
def test_this_installation_finds_what_is_agreed(identity: str) -> None:
    result = evaluate_set(SETS[identity])
    missed = [
        f"{c.agreed.of.text} {c.agreed.what}: {c.agreed.value} ± {c.agreed.tolerance}, found {c.found}"
        for c in result.missed
    ]
    assert (result.problem, missed) == ("", [])


def test_a_validation_of_nothing_is_none() -> None:
    assert not Validation((), MOMENT, validate([SETS["closed-form/elastic"]]).software).good
