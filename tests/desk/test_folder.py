"""What the desk finds in its folder, and that it never leaves it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.daq.desk.folder import Folder
from bufferstand.foundation import BadInput
from tests.desk.served import laboratory


def test_it_finds_stands_specimens_and_campaigns_and_nothing_else(tmp_path: Path) -> None:
    laboratory(tmp_path)
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "stand.toml").write_text('[stand]\nid = "x"\n')
    (tmp_path / "other.toml").write_text("[tool]\nx = 1\n")
    found = Folder(tmp_path).contents()
    assert {(one.kind, one.path) for one in found.settings} == {
        ("campaign", "demo.toml"),
        ("campaign", "en15551.toml"),
        ("stand", "stand.toml"),
        ("specimen", "specimens/category-a-elastomer.toml"),
        ("specimen", "specimens/draw-hook-elastomer.toml"),
    }
    assert not any(one.problem for one in found.settings)
    assert [one.id for one in found.of_kind("stand")] == ["simulated-630kN"]


def test_a_stored_zero_is_no_specimen(tmp_path: Path) -> None:
    laboratory(tmp_path)
    text = (
        'schema = "bufferstand/zero/1"\nhow = "touch"\nspecimen = "A-105-E-01"\n[channel.force]\nzero = 0.5\n'
    )
    (tmp_path / "stand.zero.toml").write_text(text)
    (tmp_path / "two.toml").write_text('campaign = "demo"\n[stand]\nid = "other"\n')
    found = {one.path: one.kind for one in Folder(tmp_path).contents().settings}
    assert "stand.zero.toml" not in found
    assert found["two.toml"] == "stand"


def test_a_file_that_cannot_be_used_is_there_with_its_reason_and_place(tmp_path: Path) -> None:
    laboratory(tmp_path)
    stand = tmp_path / "stand.toml"
    stand.write_text(stand.read_text().replace("force_max_kN = 600.0", 'force_max_kN = "600"'))
    (tmp_path / "broken.toml").write_text('[campaign]\nid = "b\n')
    problems = {one.path: one.problem for one in Folder(tmp_path).contents().settings if one.problem}
    assert set(problems) == {"stand.toml", "broken.toml"}
    assert "force_max_kN" in problems["stand.toml"]
    assert "line" in problems["broken.toml"]
    assert str(tmp_path) not in problems["stand.toml"]


def test_a_file_that_is_mended_is_read_again(tmp_path: Path) -> None:
    laboratory(tmp_path)
    folder, demo = Folder(tmp_path), tmp_path / "demo.toml"
    text = demo.read_text()
    demo.write_text(text + "\n[nonsense]\n")
    assert any(one.problem for one in folder.contents().settings)
    demo.write_text(text)
    assert not any(one.problem for one in folder.contents().settings)


@pytest.mark.parametrize("name", ["../secret.toml", "/etc/hostname", "link.toml", "a\x00b", "a\nb"])
def test_nothing_outside_is_named(tmp_path: Path, name: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.toml").write_text("[stand]\n")
    (inside / "link.toml").symlink_to(tmp_path / "secret.toml")
    folder = Folder(inside)
    for take in (folder.inside, folder.new):
        with pytest.raises(BadInput):
            take(name)


def test_a_folder_that_leads_round_in_a_circle_ends(tmp_path: Path) -> None:
    (tmp_path / "again").symlink_to(tmp_path)
    laboratory(tmp_path)
    assert len(Folder(tmp_path).contents().settings) == 5


def test_a_record_that_is_none_is_shown_as_such(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "campaign.json").write_text("{")
    (run,) = Folder(tmp_path).contents().runs
    assert run.status == "unreadable"
    assert str(tmp_path) not in run.problem, "no place of this machine"
    assert run.problem.startswith("campaign.json: ")
    assert run.problem


def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    """Found by fuzzing: the desk answered with a traceback of its own in the log."""
    for name in ("a" * 300, "a/" * 3000, "{a = " * 500):
        for look in (Folder(tmp_path).inside, Folder(tmp_path).new, Folder(tmp_path).within):
            with pytest.raises(BadInput):
                look(name)
