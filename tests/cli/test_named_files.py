"""A file of the wrong kind, and one that another names and that is not there: said at the place to mend."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from bufferstand.cli.campaign import prepare
from bufferstand.drivers.simulated.settings import model_path
from bufferstand.drivers.stand_file import load_stand
from bufferstand.evaluation.requirements.limit_set import load_limit_set
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen import load_specimen
from bufferstand.model import load_model

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
READERS: dict[str, tuple[Callable[[Path], object], Path]] = {
    "a campaign file": (prepare, SAMPLES / "demo.toml"),
    "a stand file": (load_stand, SAMPLES / "stand.toml"),
    "a specimen file": (load_specimen, SAMPLES / "specimens" / "category-a-elastomer.toml"),
    "a spring model": (load_model, SAMPLES / "models" / "category-a-elastomer.toml"),
}


@pytest.mark.parametrize("given", READERS)
@pytest.mark.parametrize("wanted", READERS)
def test_a_file_of_another_kind_is_called_by_its_name(wanted: str, given: str) -> None:
    read, file = READERS[wanted][0], READERS[given][1]
    if wanted == given:
        read(file)
        return
    with pytest.raises(BadInput) as caught:
        read(file)
    assert str(caught.value) == f"{file}: this is {given}; {wanted} is wanted here; check the path"


def test_a_campaign_is_no_limit_set() -> None:
    with pytest.raises(BadInput, match="this is a campaign file; a limit set is wanted here"):
        load_limit_set(SAMPLES / "demo.toml")


@pytest.mark.parametrize(
    ("file", "old", "place"),
    [
        ("demo.toml", 'stand = "stand.toml"', "campaign.stand"),
        ("demo.toml", 'specimen = "specimens/category-a-elastomer.toml"', "campaign.specimen"),
        (
            "specimens/category-a-elastomer.toml",
            'model = "../models/category-a-elastomer.toml"',
            "specimen.model",
        ),
    ],
)
def test_a_file_that_is_not_there_is_said_where_it_is_named(
    tmp_path: Path, file: str, old: str, place: str
) -> None:
    folder = tmp_path / "lab"
    shutil.copytree(SAMPLES, folder, ignore=shutil.ignore_patterns("runs"))
    text = (folder / file).read_text(encoding="utf-8")
    assert text.count(old) == 1
    line = text[: text.index(old)].count("\n") + 1
    (folder / file).write_text(
        text.replace(old, f'{old.partition(" ")[0]} = "nowhere.toml"'), encoding="utf-8"
    )
    with pytest.raises(BadInput) as caught:
        prepare(folder / "demo.toml")
    missing = (folder / file).parent / "nowhere.toml"
    assert str(caught.value) == (
        f"{folder / file}: line {line}: {place}: it names {missing}, and there is no such file; "
        "mend the path, which starts from the folder of this file"
    )


def test_so_are_a_stands_profile_and_its_simulated_spring(tmp_path: Path) -> None:
    text = (SAMPLES / "stand.toml").read_text(encoding="utf-8")
    stand = tmp_path / "stand.toml"
    stand.write_text(text, encoding="utf-8")
    with pytest.raises(
        BadInput, match=r"stand.toml: line \d+: simulation.model: it names .*there is no such"
    ):
        model_path(load_stand(stand))
    stand.write_text(text.replace('profile = "ring"', 'profile = "mine.toml"'), encoding="utf-8")
    with pytest.raises(BadInput, match=r"controller.profile: there is no register profile .*mine.toml; mend"):
        load_stand(stand)
