"""``bufferstand plan``: what it prints, and the picture it draws."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.cli.commands.campaign.plan import command
from bufferstand.foundation.errors import BadInput
from tests.cli.test_edits import Lab

SAMPLES = Path(__file__).parents[2] / "sample_runs"


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_the_picture_is_drawn_for_every_step(tmp_path: Path, ending: str) -> None:
    target = tmp_path / "pictures" / f"plan.{ending}"
    done = CliRunner().invoke(command, [str(SAMPLES / "demo.toml"), "--picture", str(target)])
    assert done.exit_code == 0, done.output
    assert f"{target} written" in done.output
    content = target.read_bytes()
    assert content.startswith(b"\x89PNG" if ending == "png" else b"<?xml")
    assert len(content) > 20_000


def test_a_picture_of_another_kind_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(command, [str(SAMPLES / "demo.toml"), "--picture", str(tmp_path / "a.jpg")])
    assert isinstance(done.exception, BadInput)
    assert "png or .svg" in str(done.exception)


def test_order_and_missed_conditions_are_told(tmp_path: Path) -> None:
    text = (SAMPLES / "demo.toml").read_text("utf-8").replace("cycles = 3\npause_s", "cycles = 2\npause_s")
    for name in ("stand.toml", "specimens/category-a-elastomer.toml"):
        text = text.replace(f'"{name}"', f'"{(SAMPLES / name).as_posix()}"')
    campaign = tmp_path / "campaign.toml"
    campaign.write_text(text + '\n[plan]\norder = "soonest"\n', "utf-8")
    done = CliRunner().invoke(command, [str(campaign)])
    assert done.exit_code == 0, done.output
    assert re.search(r"order “soonest” \(best of \d+ tried\): .* pauses; as given .* less\)", done.output)
    assert (
        "warning: step 1 “quasi-static, three cycles” is no test by EN 15551: 2 cycles (3 needed)"
        in done.output
    )
    document = json.loads(CliRunner().invoke(command, [str(campaign), "--json"]).stdout)
    assert document["ordering"]["given_s"] >= document["ordering"]["chosen_s"]
    assert document["warnings"][0].startswith("step 1")


STEP_OF_YEARS = """
[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 0.0001
cycles = 100000
"""


def test_a_step_of_days_is_pointed_at(tmp_path: Path) -> None:
    text = (SAMPLES / "en15551.toml").read_text("utf-8")
    for name in ("stand.toml", "specimens/category-a-elastomer.toml"):
        text = text.replace(f'"{name}"', f'"{(SAMPLES / name).as_posix()}"')
    campaign = tmp_path / "campaign.toml"
    campaign.write_text(text + STEP_OF_YEARS, "utf-8")
    done = CliRunner().invoke(command, [str(campaign)])
    assert done.exit_code == 0, (done.output, done.exception)
    flat = " ".join(done.output.split())
    assert re.search(r"warning: step 3 “[^”]*” takes 2777\d\d h \d\d min: look at its cycles", flat)
    assert re.search(r"warning: at most \d+ MB are recorded, and this folder's disk has \d+ MB free", flat)


def test_a_specimen_with_a_model_and_a_catalogue_is_told_which_is_taken(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    path = lab.campaign.parent / "specimens/category-a-elastomer.toml"
    assert not any("catalogue" in note for note in prepare(lab.campaign).plan.notes)
    path.write_text(path.read_text() + "\n[catalogue]\npoints = [[0.0, 15.0], [100.0, 600.0]]\n")
    said = "category-a-elastomer.toml has a spring model and a [catalogue]: the model is taken"
    assert any(note.startswith(said) for note in prepare(lab.campaign).plan.notes)
