"""Writing the first files: all of them valid, or none."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from bufferstand.cli.beginning.answers import NONE, Answers, is_like_shipped
from bufferstand.cli.beginning.campaign_text import CHECKLIST, campaign_text, specimen_text
from bufferstand.cli.beginning.profile_text import PROFILE, profile_text
from bufferstand.cli.beginning.recorder_text import recorder_text
from bufferstand.cli.beginning.stand_text import stand_text
from bufferstand.cli.campaign import prepare
from bufferstand.cli.samples import sample
from bufferstand.drivers.stand_file import load_recording_stand
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import read_text
from bufferstand.foundation.specimen import load_specimen

STAND = "stand.toml"
MODEL = "models/category-a-elastomer.toml"


def write_first_files(folder: Path, answers: Answers) -> list[Path]:
    """Write stand, specimen, model, campaign and checklist into a folder, made if it is not there.

    The campaign is planned first, as ``bufferstand plan`` does: nothing is written of what would be refused.

    Returns
    -------
    list of Path
        What was written: the stand first, then the campaign, or the specimen of one that is recorded only.

    Raises
    ------
    BadInput
        If a file of that name is there, an answer cannot be, or the folder cannot be written.
    """
    if answers.model and not is_like_shipped(answers.kind, answers.elastic_system, answers.max_stroke_mm):
        raise BadInput(
            "the shipped spring is that of a buffer with elastomer and 105 mm stroke: force and heat of "
            "another cannot be planned with it, and nothing was written",
            file="--model",
            remedy="give --no-model",
        )
    specimen = f"specimens/{_file_name(answers.specimen)}.toml"
    campaign = f"{answers.campaign}.toml"
    texts = _texts(answers, specimen, campaign)
    there = [name for name in texts if (folder / name).exists() and name != MODEL]
    if there:
        raise BadInput(
            "is there already; nothing was written", file=folder / there[0], remedy="name another folder"
        )
    with tempfile.TemporaryDirectory(prefix="bufferstand-init-") as name:
        trial = Path(name)
        for path, text in texts.items():
            (trial / path).parent.mkdir(parents=True, exist_ok=True)
            (trial / path).write_text(text, encoding="utf-8")
        try:
            if answers.controller == NONE:
                load_recording_stand(trial / STAND)
                load_specimen(trial / specimen)
            else:
                prepare(trial / campaign)
        except BadInput as error:
            said = str(error).replace(f"{trial}/", "")
            what = "stand" if answers.controller == NONE else "campaign"
            raise BadInput(f"these answers make no valid {what}, and nothing was written: {said}") from None
        return _moved(trial, folder, list(texts))


def _texts(answers: Answers, specimen: str, campaign: str) -> dict[str, str]:
    """Return the files by their names: the stand first, then what is run on it."""
    about_specimen = {
        specimen: specimen_text(answers, f"../{MODEL}"),
        "checklist.toml": CHECKLIST,
        MODEL: read_text(sample(MODEL)),
    }
    if answers.controller == NONE:
        return {STAND: recorder_text(read_text(sample("stand.toml")), answers, STAND), **about_specimen}
    own = {} if (profile := profile_text(answers)) is None else {PROFILE: profile}
    return {
        STAND: stand_text(read_text(sample("stand.toml")), answers, STAND),
        campaign: campaign_text(answers, campaign, specimen),
        **about_specimen,
        **own,
    }


def _moved(trial: Path, folder: Path, names: list[str]) -> list[Path]:
    written = []
    try:
        for name in names:
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                shutil.copyfile(trial / name, path)
            written.append(path)
    except OSError as error:
        raise BadInput(f"cannot be written: {error.strerror}", file=error.filename or folder) from None
    return written


def _file_name(specimen: str) -> str:
    """Return a specimen's id as the name of a file.

    Raises
    ------
    BadInput
        If nothing is left of it.
    """
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", specimen).strip("-.")[:80]
    if not name:
        raise BadInput(f"“{specimen}” is no id of a specimen", file="--specimen", remedy="write e.g. A-0815")
    return name
