"""``bufferstand samples``: all samples, as files that the commands can use, and nothing written over."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.campaign import prepare
from bufferstand.cli.commands.samples import command
from bufferstand.evaluation.requirements import find_limit_set
from bufferstand.foundation import BadInput

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
LIMIT_SETS = ROOT / "evaluation" / "requirements" / "limit_sets"


def test_all_samples_are_copied_and_a_copied_campaign_can_be_planned(tmp_path: Path) -> None:
    folder = tmp_path / "my samples"
    done = CliRunner().invoke(command, [str(folder)], standalone_mode=False)
    assert done.exception is None
    files = {path.relative_to(SAMPLES): path.read_bytes() for path in SAMPLES.rglob("*") if path.is_file()}
    files |= {Path("limit_sets", path.name): path.read_bytes() for path in LIMIT_SETS.glob("*.toml")}
    copied = {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert copied == files
    assert f"{len(files)} files in '{folder}'" in done.output
    assert f"bufferstand plan '{folder}'/demo.toml" in done.output
    assert len(prepare(folder / "demo.toml").plan.steps) == 13


def test_what_is_there_is_not_written_over_and_nothing_is_copied_beside_it(tmp_path: Path) -> None:
    (tmp_path / "stand.toml").write_text("mine", encoding="utf-8")
    done = CliRunner().invoke(command, [str(tmp_path)], standalone_mode=False)
    assert isinstance(done.exception, BadInput)
    assert "nothing was copied" in str(done.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["stand.toml"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match="cannot be written"):
        CliRunner().invoke(
            command, [str(tmp_path / "file" / "inner")], standalone_mode=False, catch_exceptions=False
        )


def test_a_copied_limit_set_with_edition_and_clauses_of_ones_own_is_taken(tmp_path: Path) -> None:
    """The way out of a draft (docs/limit-sets.md): copy, give an id, an edition and a clause."""
    CliRunner().invoke(command, [str(tmp_path)], standalone_mode=False, catch_exceptions=False)
    text = (tmp_path / "limit_sets" / "en15551-105mm.toml").read_text(encoding="utf-8")
    text = text.replace('id = "en15551-105mm"', 'id = "ours"\nclause = "6.2"').replace(
        'edition = ""', 'edition = "2022"'
    )
    (tmp_path / "ours.toml").write_text(text, encoding="utf-8")
    ours = find_limit_set(str(tmp_path / "ours.toml"))
    assert (ours.id, ours.edition, ours.clause) == ("ours", "2022", "6.2")
